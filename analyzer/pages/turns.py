"""The events that convict: half-cycles laid over one another from each turn of OP, and the plane of PV over OP."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from analyzer.loop.decisions import Cause
from analyzer.pages.engineering import Scale
from analyzer.pages.trends import LEAST_PCT
from reports.pages import Floats, Line, Panels, Plot

Row = Mapping[str, Any]
SAID = {
    Cause.VALVE: "Thick: OP has turned and moves, the stem does not follow yet. PV stands there, or goes on, "
    "and answers only afterwards; behind a sound valve it would answer at once.",
    Cause.TUNING: "PV follows OP from the turn on, time and again: the valve answers, the swing is the loop's own.",
    Cause.LOAD: "PV turns before OP does, or without it: what moves PV comes from outside, OP only follows.",
}


STANDS = "OP moves, the stem stands"


def _minutes(n: int, step_s: float) -> Floats:
    return np.arange(n, dtype=np.float64) * (step_s / 60.0)


def turn_panels(row: Row, scale: Scale) -> Panels | None:
    """The pictures of a night's half-cycles; None where the night kept none."""
    kept = json.loads(row.get("turns") or "null")
    if not kept:
        return None
    step = kept["step_s"]
    drawn = [_Drawn.of(h, scale) for h in kept["halves"]]
    least = LEAST_PCT * scale.span / 100.0
    op = [(h.turned(h.op), h.stuck) for h in drawn]
    pv = [(h.turned(h.pv), h.stuck) for h in drawn]
    plots = (
        _over_time("turns-op", "OP since its turn", "OP [%]", op, step),
        _over_time("turns-pv", "PV since OP's turn", f"PV [{scale.label}]", pv, step),
        _plane(drawn, scale, kept["dead_s"], least),
    )
    said = SAID.get(row["cause"], "Half-cycles laid over one another.")
    title = f"The last {len(drawn)} half-cycles, from each turn of OP (falling ones turned over)"
    return Panels("turns", title, plots, said)


@dataclass(frozen=True)
class _Drawn:
    """A half-cycle in the units of its axes."""

    op: Floats
    pv: Floats
    late: Floats
    stuck: slice

    @classmethod
    def of(cls, kept: Row, scale: Scale) -> _Drawn:
        """As the store kept it."""
        pv, late = (scale.of(np.array(kept[name], dtype=np.float64)) for name in ("pv", "late"))
        first, last = kept["stuck"]
        return cls(
            np.array(kept["op"], dtype=np.float64), pv, late, slice(first, last + 1 if last > first else last)
        )

    def turned(self, y: Floats) -> Floats:
        """A signal since the turn, that of a falling half turned over so that all lie on one another."""
        way = 1.0 if self.op[-1] >= self.op[0] else -1.0
        return way * (y - y[0])


def _over_time(name: str, title: str, label: str, halves: list[tuple[Floats, slice]], step_s: float) -> Plot:
    lines = [Line("since the turn", _minutes(y.size, step_s), y, kind="pv") for y, _ in halves]
    stood = [(_minutes(y.size, step_s)[part], y[part]) for y, part in halves]
    stuck = [Line(STANDS, x, y, kind="stuck") for x, y in stood if x.size > 1]
    return Plot(name, title, "min since OP's turn", label, (*lines, *stuck), reach=(0.0, 0.0))


def _plane(drawn: list[_Drawn], scale: Scale, dead_s: float, least: float) -> Plot:
    """PV over OP, PV taken the dead time later, so that the process's delay does not look like play."""
    lines = [Line("since the turn", h.op, h.late, kind="pv") for h in drawn]
    stuck = [
        Line(STANDS, h.op[h.stuck], h.late[h.stuck], kind="stuck") for h in drawn if h.op[h.stuck].size > 1
    ]
    delay = f", PV {dead_s:.3g} s later" if dead_s > 0 else ""
    middle = float(np.median(drawn[0].late))
    reach = (middle - 0.5 * least, middle + 0.5 * least)
    return Plot(
        "turns-plane", f"PV over OP{delay}", "OP [%]", f"PV [{scale.label}]", (*lines, *stuck), reach=reach
    )
