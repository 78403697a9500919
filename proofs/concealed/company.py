"""The surroundings of a loop: neighbours in the same export, and loads taken from real residuals."""

import pathlib
from dataclasses import replace

import numpy as np
import pandas as pd

from proofs.concealed.plant import Drive, close_loop
from proofs.concealed.recorder import rounded
from proofs.concealed.scene import Rng, Scene, draw_plant, drive, log_uniform, sizes_of, tune


def neighbour_trend(rng: Rng, scene: Scene, n: int) -> np.ndarray:
    """SP, PV and OP of another loop of the same kind, shape (3, n)."""
    plant = draw_plant(rng, scene.kind)
    pi = tune(rng, plant, scene.scan, log_uniform(rng, 1.0, 5.0))
    d = drive(rng, n, plant, scene.scan, sizes_of(rng, plant, pi, scene.scan))
    return np.vstack([d.sp, close_loop(plant, pi, d, scene.scan)])


def with_neighbour(rng: Rng, scene: Scene) -> Scene:
    """The scene with another loop next to it in both recordings."""
    trends = tuple(neighbour_trend(rng, scene, len(d.sp)) for d in (scene.fit, scene.later))
    return replace(scene, neighbours=trends)


def add_neighbour(frame: pd.DataFrame, tag: str, trend: np.ndarray) -> pd.DataFrame:
    """The export with the neighbour's columns; `trend` has shape (3, rows)."""
    for name, row, step in zip(("SP", "PV", "OP"), trend, (0.0, 0.02, 0.05), strict=True):
        frame[f"{tag}.{name}"] = rounded(row, step).astype("float32")
    return frame


def read_residuals(folder: pathlib.Path | None) -> list[np.ndarray]:
    """Residual series, each shape (n,), from every .npy, .csv and .parquet of a folder (last column)."""
    readers = {
        ".npy": np.load,
        ".csv": lambda f: pd.read_csv(f).iloc[:, -1].to_numpy(float),
        ".parquet": lambda f: pd.read_parquet(f).iloc[:, -1].to_numpy(float),
    }
    files = sorted(folder.iterdir()) if folder else []
    series = [np.asarray(readers[f.suffix](f), float).ravel() for f in files if f.suffix in readers]
    return [x for x in (s[np.isfinite(s)] for s in series) if len(x) >= 500 and np.std(x) > 0]


def stretch(rng: Rng, x: np.ndarray, n: int) -> np.ndarray:
    """A random part of a series, mirrored where it is too short, shape (n,), mean 0, variance 1."""
    long = np.resize(np.concatenate([x, x[::-1]]), max(2 * n, 2 * len(x)))
    start = rng.integers(0, len(long) - n + 1)
    part = long[start : start + n] - np.mean(long[start : start + n])
    return part / max(float(np.std(part)), 1e-9)


def borrow(rng: Rng, scene: Scene, library: list[np.ndarray]) -> Scene:
    """The scene with its load taken from a residual, with the same size at PV as its own load."""
    x = library[rng.integers(len(library))]

    def lend(d: Drive) -> Drive:
        size = rng.uniform(0.15, 0.4)
        return replace(d, load=0.0 * d.load, pre=size * stretch(rng, x, len(d.sp)))

    return replace(scene, fit=lend(scene.fit), later=lend(scene.later))
