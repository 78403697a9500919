"""The plant's figures over the nights: how many loops oscillate and why, and what they lose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

import numpy as np

from analyzer.columns import BY_NAME
from analyzer.loop.decisions import CAUSES, Cause, counts
from analyzer.pages.cost import LOSS, SIGNIFICANCE, cost, cost_column
from analyzer.pages.reading import read_nights
from analyzer.pages.words import number
from analyzer.store.store import Store
from reports.pages import Block, Floats, Line, Panels, Plot

COLUMNS = (*("loop", "status", "oscillating_pct", "cause", "importance", LOSS, SIGNIFICANCE),)
MOST = 60
"""Nights that are shown."""
LEAST = 3
"""Nights from which a curve says something."""


@dataclass(frozen=True, slots=True)
class NightSum:
    """One night of the plant: its name, loops that oscillate, those of each cause, and what all cost by a column."""

    name: str
    oscillate: int
    causes: Mapping[Cause, int]
    cost: float
    by: str = LOSS


def summed(name: str, rows: Sequence[Mapping[str, Any]]) -> NightSum:
    """The sums of one night's rows."""
    swinging = [r for r in rows if counts(r["oscillating_pct"])]
    of = {c: sum(r["cause"] == c for r in swinging) for c in (*CAUSES, Cause.UNDECIDED)}
    by = cost_column(rows)
    return NightSum(name, len(swinging), of, sum(cost(r, by) for r in rows), by)


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
    return (Panels("over-the-nights", "The plant over the nights", (loops, _costs(sums, day, axis))),)


def _costs(sums: Sequence[NightSum], day: Floats, axis: str) -> Plot:
    """What all loops cost together, of the nights whose figure is that of the last one."""
    by = sums[-1].by
    cost = np.array([s.cost if s.by == by else np.nan for s in sums])
    named = BY_NAME[by].heading.lower()
    title = f"The loops' {named} together, now {number(float(cost[-1]))}"
    return Plot("loss", title, axis, named, (Line(named, day, cost, kind="recorded"),), reach=(0.0, 1.0))
