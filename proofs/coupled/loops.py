"""Loops of a plant without faults, their cascades and names."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from proofs.coupled.kernel import Plant
from proofs.coupled.trends import log_uniform

KINDS = ("flow", "pressure", "level", "temperature")
SHARES = (0.42, 0.18, 0.2, 0.2)
"""Shares of the types among single loops."""
TIMES = {"flow": (3, 12, 1, 4), "pressure": (15, 120, 2, 12), "level": (150, 1500, 2, 12)}
TIMES["temperature"] = (60, 900, 10, 90)
"""Shortest and longest time constant and dead time [s]; of a level, for one percent a percent."""
ARREST = (60.0, 500.0)
"""Arrest times of levels [s]."""
CASCADES = (0.05, 0.14)
"""Number of cascades, relative to the number of loops."""
MASTER_SLOWER = 4.0
"""Least ratio of the time constants of a master and its slave."""
HARMLESS = 0.1
"""Largest backlash of a valve without a fault [% OP]."""
AREA = (8, 25)
"""Number of loops in an area of the plant."""


@dataclass(frozen=True)
class Tag:
    """Name, kind and area of a loop."""

    name: str
    kind: str
    area: str


def _loop(rng: np.random.Generator, kind: str, step: float, inner: float) -> dict[str, float]:
    """A process of that kind and a controller without a fault; inner: closed-loop time of its slave [s], 0: a
    valve."""
    low, high, soon, late = TIMES[kind]
    first = max(log_uniform(rng, low, high), 1.5 * step, MASTER_SLOWER * inner)
    dead = max(round(log_uniform(rng, soon, late) / step), 1)
    second = first * rng.uniform(0.05, 0.25) if kind != "flow" and rng.random() < 0.5 else 0.0
    gain, wait = rng.uniform(0.6, 2.2), (dead + 0.5) * step + second + inner
    row = {"gain": gain, "first": first, "second": second, "dead": dead, "integrating": kind == "level"}
    if kind == "level":
        closed = max(log_uniform(rng, *ARREST), 3 * wait)
        row["kp"] = first / gain * (2 * closed + wait) / (closed + wait) ** 2
        row["ti"] = 2 * closed + wait
    else:
        closed = wait * rng.uniform(1.2, 4)
        row["kp"], row["ti"] = first / gain / (closed + wait), first * rng.uniform(0.9, 1.2)
        if kind == "flow" and rng.random() < 0.5:
            row["kp"], row["ti"] = row["kp"] * 0.5, row["ti"] * rng.uniform(0.6, 1)
    return row | {"closed": closed + wait}


def _tags(rng: np.random.Generator, kinds: list[str], near: list[int]) -> list[Tag]:
    """Names by kind, area and a number without meaning; near[i]: the loop whose area i shares."""
    n = len(kinds)
    places = max(round(n / rng.uniform(*AREA)), 1)
    area = rng.integers(places, size=n)
    numbers = rng.permutation(900)[:n] + 100
    out = []
    for i, kind in enumerate(kinds):
        here = int(area[near[i]]) + 1
        out.append(Tag(f"{kind[0].upper()}IC{here}{numbers[i]}", kind, f"U{here}"))
    return out


def drawn(rng: np.random.Generator, n: int, step: float) -> tuple[Plant, list[Tag]]:
    """n loops without faults, some of them in cascades, without couplings."""
    rows, kinds, near = [], [], []
    for _ in range(round(n * rng.uniform(*CASCADES))):
        slave = _loop(rng, "flow", step, 0.0)
        kind = str(rng.choice(["temperature", "level", "pressure"], p=(0.5, 0.35, 0.15)))
        at, op0 = len(rows), rng.uniform(35, 65)
        rows.append(_loop(rng, kind, step, slave["closed"]) | {"slave": at + 1, "op0": op0})
        rows.append(slave | {"master": at, "sp0": op0})
        kinds, near = [*kinds, kind, "flow"], [*near, at, at]
    while len(rows) < n:
        kinds.append(str(rng.choice(KINDS, p=SHARES)))
        near.append(len(rows))
        rows.append(_loop(rng, kinds[-1], step, 0.0))
    for row in rows:
        usual = {"sp0": rng.uniform(35, 65), "op0": rng.uniform(35, 65), "master": -1, "slave": -1}
        usual |= {
            "stick": 0.0,
            "slip": 0.0,
            "scatter": 0.0,
            "backlash": rng.uniform(0, HARMLESS),
            "beat": 0.0,
        }
        row.update({k: v for k, v in usual.items() if k not in row})
        del row["closed"]
    columns = {k: np.array([row[k] for row in rows], dtype=float) for k in rows[0]}
    for k in ("master", "slave"):
        columns[k] = columns[k].astype(int)
    return Plant(step, **columns), _tags(rng, kinds, near)
