"""Trends for the pages: thinned, with ten periods fine, and the last ten half-cycles of an oscillation."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from analyzer.loop.decisions import Cause
from analyzer.loop.oscillation.detection import Oscillations, counting
from analyzer.loop.record.quality import Prepared
from identification.estimation.model import Fitted
from identification.record import LoopRecord
from identification.signals.reversals import StemMarks, halves, op_reversals

if TYPE_CHECKING:
    from analyzer.loop.assess import Assessment

QUICK = 0.2  # Time constant over a half-cycle up to which PV settles within it and can be seen as constant

BUCKETS = 1200
"""Buckets a day: 72 s each, about a pixel of a screen's width."""
FINE_BUCKETS = 6000
"""Buckets a day of a loop that oscillates, sufficient to zoom into its cycle."""
PERIODS = 10.0
"""Periods of the close view that a page opens on."""
TYPICAL = 0.2
"""Deviation of the amplitude of typical periods from the usual one, over that [-]; ours."""
CLOSE_BUCKETS = 600
"""Buckets of the close view at most, 60 a period; fewer if the record has fewer samples."""
HALVES = 10
"""Half-cycles that are kept."""
SEARCHED_PERIODS = 30.0
"""Periods before the close view's end that are searched for half-cycles; ours: those with gaps are omitted."""


def close_view(part: LoopRecord, found: Oscillations, before: int) -> tuple[int, int] | None:
    """First and last sample (excluded) of the last ten typical periods of the oscillation in a part of a record,
    which `before` samples precede; None if there is none."""
    if found.first is None or found.active is None or not found.active.any():
        return None
    skipped = len(part) * part.dt_s - found.active.size * found.active_dt_s
    count = max(round(PERIODS * found.first.period_s / found.active_dt_s), 1)
    end_s = skipped + _last_typical(found.active, found.level, count) * found.active_dt_s
    last = min(round(end_s / part.dt_s), len(part))
    first = max(last - round(PERIODS * found.first.period_s / part.dt_s), 0)
    return (before + first, before + last) if last - first > 2 else None


def _last_typical(active: np.ndarray, level: np.ndarray | None, count: int) -> int:
    """End of the last `count` samples in which an oscillation is on all the time and has about its usual amplitude;
    else the end of its last active samples."""
    end = int(np.flatnonzero(active)[-1]) + 1
    if level is None or active.size <= count:
        return end
    sums = [np.concatenate(([0.0], np.cumsum(x))) for x in (active, np.where(active, level, 0.0))]
    on, size = ((x[count:] - x[:-count]) / count for x in sums)
    usual = float(np.median(level[active]))
    typical = np.flatnonzero((on == 1.0) & (np.abs(size - usual) <= TYPICAL * usual))
    return int(typical[-1]) + count if typical.size else end


def _edges(n: int, buckets: int, close: tuple[int, int] | None) -> np.ndarray:
    """First samples of the buckets, shape (b,): even, but finer within the close view."""
    even = (np.arange(buckets) * n) // buckets
    if close is None:
        return even
    first, last = close
    step = max(-(-(last - first) // CLOSE_BUCKETS), 1)
    if step >= n / buckets:
        return even
    return np.unique(
        np.concatenate((even[even < first], np.arange(first, last, step), even[even >= last], [0]))
    )


def thinned(
    record: LoopRecord, a_day: int = BUCKETS, close: tuple[int, int] | None = None
) -> Mapping[str, np.ndarray]:
    """Columns time_s and, for SP, PV and OP, least and greatest of each bucket [% of span], shape (b,); bad, manual
    and frozen: True where all of a bucket is; a frozen PV is not bad, so it is drawn.

    Buckets are the record's own samples if there are fewer of these, and finer between the samples of `close`.
    """
    n = len(record)
    buckets = min(n, max(round(a_day * record.duration_s / 86400.0), 400))
    edges = _edges(n, buckets, close)
    out: dict[str, np.ndarray] = {"time_s": record.start_s + edges * record.dt_s}
    for name in ("sp", "pv", "op"):
        for end, least_or_greatest in (("min", np.minimum), ("max", np.maximum)):
            found = least_or_greatest.reduceat(getattr(record, name), edges)
            out[f"{name}_{end}"] = found.astype(np.float32)
    frozen = record.mask("stale")
    masks = {"bad": record.bad & ~frozen, "manual": record.mask("manual"), "frozen": frozen}
    return out | {name: np.logical_and.reduceat(x, edges) for name, x in masks.items()}


def _marks(faulty: Fitted | None, fit: Fitted | None, period_s: float) -> StemMarks:
    """Data for the marks: PV of a slow process does not settle, and the mark begins at the OP reversal."""
    if fit is None:
        return StemMarks(0.0, 0.0, 0.0)
    quick = fit.time_constant_s <= QUICK * 0.5 * period_s
    answered = fit.dead_time_s + 2.0 * fit.time_constant_s if quick else 0.0
    return StemMarks(0.0 if faulty is None else float(faulty.valve.stickband), fit.dead_time_s, answered)


def half_cycle_data(prepared: Prepared, found: Assessment) -> str | None:
    """Half-cycles as JSON: step_s, dead_s, of each start_s (of the epoch), op, pv, late and stuck; None without."""
    record, first = prepared.record, counting(found.oscillations)
    if first is None or not prepared.op_known or found.close_s is None or found.needs is not None:
        return None
    end = round((found.close_s[1] - record.start_s) / record.dt_s)
    begin = max(end - round(SEARCHED_PERIODS * first.period_s / record.dt_s), 0)
    part = slice(begin, end)
    fit = None if found.verdict.measured is None else found.verdict.fit
    marks = _marks(fit if found.verdict.cause is Cause.VALVE else None, fit, first.period_s)
    turns = op_reversals(record.op[part], first.period_s / record.dt_s)
    good = record.usable[part]
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
