"""Loops found in tags without names: python -m proofs.finder [--shared ../shared] [--seeds 1 2]

Tags lose their names and their order. Twenty signals that belong to no loop are added: drift, slow noise,
oscillations, sensors that follow a PV, white noise. The plants are those of the shared folder, if it exists, at 1, 10
and 60 s, and the sample mill at 10 s. The folder's recording of the Tennessee Eastman process is used at 3 s. A pair
is right where PV and OP belong to one loop; only sure pairs count. Gains and integral times are compared with
loops.csv where the control law explains .9 of OP's moves. False pairs are also counted in sets without a controller.
These are the same plants without OP and without moving set points, and a thousand tags of noise, drift and
oscillations. Writes finder.md here.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from analyzer.finder.pair import LEAST_LAW_SHARE, SURE_PCT, FoundPair
from analyzer.finder.pairs import found_pairs
from analyzer.loops.spec import LoopSpec, read_loops
from analyzer.loops.tags import controller
from benchmarks.world.__main__ import spec_of
from benchmarks.world.draw import drawn, run
from proofs.common import command, command_line, publish, table

STRANGERS = 20
NEAR = 0.2
"""Permitted relative error of a gain or an integral time."""
Bag = tuple[str, pd.DataFrame, float, dict[str, LoopSpec]]
"""Name, tags in columns, time between samples [s], and what loops.csv states."""


def strangers(values: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Signals that belong to no loop, shape (n, count)."""
    n = len(values)
    e, t = rng.normal(size=(n, count)), np.arange(n)
    out = np.empty((n, count))
    for k in range(count):
        beside = values[:, rng.integers(values.shape[1])]
        out[:, k] = (
            0.02 * np.cumsum(e[:, k]),
            0.3 * lfilter([1.0], [1.0, -0.98], e[:, k]),
            5.0 * np.sin(2 * np.pi * t / rng.uniform(200, 2000)) + 0.3 * e[:, k],
            lfilter([0.0, 0.0, 0.05], [1.0, -0.95], beside - beside.mean()) + 0.1 * beside.std() * e[:, k],
            e[:, k],
        )[k % 5]
    return np.round(50.0 + out, 2)


def bags(shared: Path) -> Iterator[Bag]:
    """The plants; those of the shared folder where it exists."""
    mill = pd.read_parquet("sample_data/mill.parquet")
    day = mill[(mill["timestamp"] >= "2026-03-08") & (mill["timestamp"] < "2026-03-09")]
    yield "sample mill, 10 s", day, 10.0, _stated(Path("sample_data/loops.csv"))
    for folder, file, intervals in (
        ("plants/a", "export", (1, 10, 60)),
        ("plants/b", "export", (1, 10, 60)),
        ("recordings/tep", "idv14", (3,)),
    ):
        path = shared / folder / f"{file}.parquet"
        if path.exists():
            held, stated = pd.read_parquet(path), _stated(shared / folder / "loops.csv")
            for every in intervals:
                thinned = held if every == 3 else held.iloc[::every]
                yield f"{folder}, {every} s", thinned, float(every), stated


def of_world(seed: int) -> Iterator[Bag]:
    """Loops of benchmarks/world, an independent generator on which no limit of the finder was set. Each kind has its
    own seed, because loops of one seed share their load and noise."""
    kinds = ("backlash", "stiction", "tight", "load", "healthy", "sluggish")
    loops = [d for k, kind in enumerate(kinds) for d in drawn(10 * seed + k, 4, (kind,))]
    trends = {d.name: run(d) for d in loops}
    columns = {
        f"{name}.{role.upper()}": np.round(getattr(t, role), 3)
        for name, t in trends.items()
        for role in ("sp", "pv", "op")
    }
    held, stated = pd.DataFrame(columns), {d.name: spec_of(d) for d in loops}
    for every in (1, 10, 60):
        yield f"world {seed}, {every} s", held.iloc[::every], float(every), stated


def _stated(path: Path) -> dict[str, LoopSpec]:
    return {spec.loop: spec for spec in read_loops(path)}


def in_disorder(held: pd.DataFrame, seed: int) -> tuple[list[str], np.ndarray]:
    """True names and values, shape (n, tags), in random order together with signals of no loop."""
    rng = np.random.default_rng(seed)
    numbers = held.select_dtypes("number").ffill().bfill().fillna(0.0)
    values = np.column_stack([numbers, strangers(numbers.to_numpy(float), STRANGERS, rng)])
    names = [*numbers.columns, *(f"stranger.{k}" for k in range(STRANGERS))]
    order = rng.permutation(len(names))
    return [names[k] for k in order], values[:, order]


def counted(names: list[str], values: np.ndarray, dt_s: float, stated: dict[str, LoopSpec]) -> Counter[str]:
    """Counts of right and wrong pairs and settings of one set of tags."""
    found: Counter[str] = Counter(loops=sum(name.endswith(".OP") for name in names))
    for pair in found_pairs(values):
        if pair.sure_pct < SURE_PCT:
            continue
        loop, same = names[pair.pv].rpartition(".")[0], _names(names, values, pair.op)
        right = names[pair.pv] == f"{loop}.PV" and f"{loop}.OP" in same
        found["right"] += right
        found["wrong"] += not right
        if right:
            found["sp"] += pair.sp is not None and f"{loop}.SP" in _names(names, values, pair.sp)
            found += _settings(pair, stated[loop], dt_s)
    return found


def _names(names: list[str], values: np.ndarray, tag: int) -> set[str]:
    """Names of all tags with the same values as one tag: the output of a master is the set point of its slave."""
    return {names[k] for k in np.flatnonzero((values == values[:, [tag]]).all(axis=0))}


def _settings(pair: FoundPair, spec: LoopSpec, dt_s: float) -> Counter[str]:
    """Whether gain and integral time agree with the stated ones."""
    span = (spec.pv_hi or 100.0) - (spec.pv_lo or 0.0)
    pid = controller(spec, span)
    if pid is None or pair.law_share < LEAST_LAW_SHARE:
        return Counter()
    kp, ti = pair.kp * span / (spec.op_hi - spec.op_lo), (pair.ti_samples or 0.0) * dt_s
    near_ti = ti == pid.ti_s or abs(ti / pid.ti_s - 1) < NEAR
    near_kp = abs(kp / pid.kp - 1) < NEAR
    return Counter(
        told=1,
        kp=int(near_kp),
        sign=int(kp * pid.kp > 0),
        ti=int(near_ti),
        ti_told=int(pair.ti_samples is not None),
    )


def without_controllers(held: pd.DataFrame, seed: int) -> int:
    """Pairs reported in the measurements of a plant alone, with the constant set points."""
    still = [c for c in held if c.endswith(".SP") and held[c].nunique() == 1]
    _, values = in_disorder(held[[*still, *(c for c in held if c.endswith(".PV"))]], seed)
    return sum(p.sure_pct >= SURE_PCT for p in found_pairs(values))


def of_nothing(seed: int) -> int:
    """Pairs reported in forty tags of noise, drift and oscillations."""
    rng = np.random.default_rng(seed)
    values = strangers(np.cumsum(rng.normal(size=(3000, 8)), axis=0), 40, rng)[:, np.arange(40) % 5 != 3]
    return sum(p.sure_pct >= SURE_PCT for p in found_pairs(values))


def main() -> None:
    """Look for the loops of all plants and write the page."""
    given = command_line(__doc__, shared=Path("../shared"), seeds=[1, 2], worlds=[41, 42, 43, 44])
    rows, nothing = [], 0
    totals = {"limits were set on": Counter[str](), "of an independent generator": Counter[str]()}
    fitted = ((x, "limits were set on") for x in bags(given.shared))
    others = ((x, "of an independent generator") for seed in given.worlds for x in of_world(seed))
    for (name, held, dt_s, stated), group in chain(fitted, others):
        found, took_s = Counter[str](), 0.0
        for seed in given.seeds:
            names, values = in_disorder(held, seed)
            begun = time.monotonic()
            found += counted(names, values, dt_s, stated)
            took_s += (time.monotonic() - begun) / len(given.seeds)
            nothing += without_controllers(held, seed)
        totals[group] += found
        rows.append((*_cells(name, found), f"{took_s:.1f}"))
    noise = sum(of_nothing(seed) for seed in range(32))
    heads = "plant | loops | right | wrong | SP of right | Kp | sign | of pairs | Ti | of pairs | s"
    publish(
        __file__,
        "Loops found in tags without names",
        command(__file__, seeds=given.seeds, worlds=given.worlds),
        (__doc__ or "").split("\n\n")[1].replace("\n", " ").split(" Writes finder.md")[0],
        table(heads, [*rows, *((*_cells(f"all {k}", c), "") for k, c in totals.items())], numbers=True),
        f"Pairs reported in data without a controller: {nothing} in the measurements of the plants alone, {noise} in "
        "1,024 tags of noise, drift and oscillations.",
    )


def _cells(name: str, found: Counter[str]) -> tuple[object, ...]:
    loops = found["loops"] or 1
    shares = f"{found['right'] / loops:.2f}", found["wrong"], f"{found['sp'] / max(found['right'], 1):.2f}"
    return (
        name,
        found["loops"],
        *shares,
        found["kp"],
        found["sign"],
        found["told"],
        found["ti"],
        found["ti_told"],
    )


if __name__ == "__main__":
    main()
