"""A valve that does not move while OP does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analyzer.config import CauseLimits
from analyzer.loop.cause.verdict import Verdict
from analyzer.loop.decisions import (
    Cause,
    Fault,
    Sign,
    SignKind,
)
from identification.record import LoopRecord


def dead_valve(record: LoopRecord, limits: CauseLimits) -> Sign | None:
    """A valve that no longer moves PV: OP winds over much of its range, the error keeps its sign, PV is constant."""
    good = ~(record.mask("gap") | record.mask("manual"))
    if record.sp_estimated or good.sum() < 100:
        return None
    wound = float(np.ptp(record.op[good]))
    if wound < limits.wound_pct:
        return None
    pv, e = record.pv[good], record.error[good]
    low, high = np.quantile(pv, [0.05, 0.95])
    still = float(high - low) <= 0.1 * float(np.median(np.abs(e)))
    one_sided = max(float((e > 0).mean()), float((e < 0).mean()))
    if not still or one_sided < 0.95:
        return None
    return Sign(Cause.VALVE, 0.9, SignKind.DEAD_VALVE, (wound,))


def with_dead_valve(verdict: Verdict, sign: Sign) -> Verdict:
    """A verdict of a clear valve fault without oscillation."""
    confidence = {Cause.VALVE: 90.0, Cause.TUNING: 0.0, Cause.LOAD: 0.0}
    return replace(
        verdict,
        cause=Cause.VALVE,
        confidence=confidence,
        fault=Fault.UNDECIDED,
        signs=(sign, *verdict.signs),
        dead=True,
    )
