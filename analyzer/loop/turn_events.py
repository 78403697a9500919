"""The last ten half-cycles of an oscillating loop, as the store keeps them and its page draws them."""

from __future__ import annotations

import json

import numpy as np

from analyzer.loop.assess import Assessment
from analyzer.loop.decisions import Cause, Fault
from analyzer.loop.oscillation import counting
from analyzer.loop.quality import Prepared
from identification.estimation.hammerstein import Fit
from identification.estimation.trials import turns_of
from identification.signals.turns import StemMarks, halves

HALVES = 10
"""Half-cycles that are kept."""
PERIODS = 30.0
"""Periods from the close view's end back in which they are looked for; ours: those with gaps are passed over."""


def _fit(found: Assessment) -> Fit | None:
    """The fit that the page's marks rest on: that of the valve at fault, else of the plain loop."""
    v, m = found.verdict, found.verdict.measured
    if m is None:
        return None
    if v.cause is not Cause.VALVE:
        return m.linear
    return m.stick_slip if v.fault is Fault.STICTION and m.stick_slip is not None else m.play


QUICK = 0.2
"""Time constant over a half-cycle up to which PV comes to rest within it and can be seen to stand [-]; ours."""


def _marks(faulty: Fit | None, fit: Fit | None, period_s: float) -> StemMarks:
    """What the marks need: of a slow process PV does not come to rest, and the mark begins at the turn."""
    if fit is None:
        return StemMarks(0.0, 0.0, 0.0)
    quick = fit.time_constant_s <= QUICK * 0.5 * period_s
    answered = fit.dead_time_s + 2.0 * fit.time_constant_s if quick else 0.0
    return StemMarks(0.0 if faulty is None else float(faulty.valve.stickband), fit.dead_time_s, answered)


def turn_events(prepared: Prepared, found: Assessment) -> str | None:
    """Half-cycles as JSON: step_s, dead_s, of each start_s (of the epoch), op, pv, late and stuck; None without."""
    record, first = prepared.record, counting(found.oscillations)
    if first is None or not prepared.op_known or found.close_s is None or found.needs is not None:
        return None
    end = round((found.close_s[1] - record.start_s) / record.dt_s)
    begin = max(end - round(PERIODS * first.period_s / record.dt_s), 0)
    part = slice(begin, end)
    fit = _fit(found)
    marks = _marks(fit if found.verdict.cause is Cause.VALVE else None, fit, first.period_s)
    turns = turns_of(record.op[part], first.period_s / record.dt_s)
    good = ~(record.bad | record.mask("manual"))[part]
    kept = halves(record.op[part], record.pv[part], good, turns, record.dt_s, first.period_s, marks, HALVES)
    if len(kept) < 2:
        return None
    start = record.start_s + begin * record.dt_s
    return json.dumps(
        {
            "step_s": kept[0].step_s,
            "dead_s": round(marks.dead_s, 3),
            "halves": [
                {
                    "start_s": round(start + h.start_s, 3),
                    "op": np.round(h.op, 3).tolist(),
                    "pv": np.round(h.pv, 3).tolist(),
                    "late": np.round(h.late, 3).tolist(),
                    "stuck": list(h.stuck),
                }
                for h in kept
            ],
        }
    )
