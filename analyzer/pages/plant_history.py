"""The plant's figures over the nights: how many loops oscillate and why, and what they lose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

import numpy as np

from analyzer.decisions import CAUSES, Cause, counts
from analyzer.pages.reading import read_nights
from analyzer.pages.words import number
from analyzer.store import Store
from reports.pages import Block, Line, Panels, Plot

COLUMNS = (
    *("loop", "status", "oscillating_pct", "cause", "loss", "average_absolute_error_pct"),
    "oscillation_significance",
)
MOST = 60
"""Nights that are shown."""
LEAST = 3
"""Nights from which a curve says something."""


@dataclass(frozen=True, slots=True)
class NightSum:
    """One night of the plant: its name, loops that oscillate, those of each cause, and what all loops lose."""

    name: str
    oscillate: int
    causes: Mapping[Cause, int]
    loss: float


def summed(name: str, rows: Sequence[Mapping[str, Any]]) -> NightSum:
    """The sums of one night's rows."""
    swinging = [r for r in rows if counts(r["oscillating_pct"])]
    of = {c: sum(r["cause"] == c for r in swinging) for c in (*CAUSES, Cause.UNDECIDED)}
    lossy = any(r["loss"] is not None for r in rows)
    key = "loss" if lossy else "oscillation_significance"
    return NightSum(name, len(swinging), of, sum(r[key] or 0.0 for r in rows))


def read_sums(store: Store, night: str) -> list[NightSum]:
    """The sums of a night and of those before it, oldest first."""
    names = [n for n in store.nights() if n <= night][-MOST:]
    return [summed(n, read_nights(store, [n], COLUMNS)) for n in names]


def history(sums: Sequence[NightSum]) -> tuple[Block, ...]:
    """Curves over the nights; none where there are too few."""
    if len(sums) < LEAST:
        return ()
    day = np.array([date.fromisoformat(s.name[:10]).toordinal() for s in sums], float)
    day -= day[-1]
    lines = [Line("all that oscillate", day, np.array([s.oscillate for s in sums], float), kind="recorded")]
    kinds = ((Cause.VALVE, "op"), (Cause.TUNING, "baseline"), (Cause.LOAD, "pv"))
    lines += [Line(f"by {c}", day, np.array([s.causes[c] for s in sums], float), kind=k) for c, k in kinds]
    axis = "days before this night"
    most = max(s.oscillate for s in sums)
    loops = Plot("oscillating", "Loops that oscillate", axis, "loops", tuple(lines), reach=(0.0, most + 1.0))
    lost = np.array([s.loss for s in sums])
    title = f"What the loops lose together, now {number(float(lost[-1]))}"
    loss = Plot("loss", title, axis, "loss", (Line("loss", day, lost, kind="recorded"),), reach=(0.0, 1.0))
    return (Panels("over-the-nights", "The plant over the nights", (loops, loss)),)
