"""The literature's own indices of a loop, as independent signs that do not enter the verdict."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

from analyzer.config import Config
from analyzer.loop.oscillation.detection import Oscillations, counting
from analyzer.loop.record.quality import Prepared
from identification.controller.check import runs
from identification.models import Pid
from identification.record import Floats, LoopRecord
from identification.signals import field_indices as of

A_CYCLE, MOST_CYCLES = 30.0, 200.0
"""Samples of a cycle to which trends are averaged, and number of the last cycles used: more take more time and give
no further sign."""
IDLE_PARTS = 5.0
"""Means per integral time whose changes of OP and PV are counted."""
LEVEL, FLOW = "level", "flow"
"""Types of loop, as loops.csv has them: an integrator; one whose PV is the flow through the valve."""


def field_indices(
    prepared: Prepared, found: Oscillations, controller: Pid | None, kind: str, config: Config
) -> str:
    """The indices of a loop's longest unbroken stretch in automatic, as the store keeps them (JSON): values by name,
    and the width of the ellipse [% of OP span]; indices without a result are left out.

    Indices of a valve are of oscillating loops with known OP and uncompressed trends; kind as in loops.csv, '' for
    not stated: Yamashita's and Kano's apply to flows, Horch's to all types except levels.
    """
    whole = prepared.record
    first, last = max(runs(whole.usable), key=lambda r: r[1] - r[0], default=(0, 0))
    record = whole.span(first, last)
    if len(record) < 2:
        return "{}"
    out: dict[str, of.Values | None] = {}
    controller = controller if prepared.op_scaled else None
    if controller is not None and controller.kp and math.isfinite(controller.ti_s):
        out["hagglund"] = of.load_disturbances(record.error, record.dt_s, controller.ti_s)
        if prepared.op_known:
            out["idle"] = _idle(record, controller)
    cycle, shapely = counting(found), prepared.compressed_share <= config.quality.straight_share
    if cycle is not None and prepared.op_known and shapely:
        sign = 1.0 if controller is None else math.copysign(1.0, controller.kp or controller.ti_s)
        out |= _of_valve(record, cycle.period_s / record.dt_s, sign, kind)
        if not prepared.op_scaled:
            del out["ellipse"]
    return json.dumps({k: [float(f"{x:.4g}") for x in v] for k, v in out.items() if v is not None})


def _averaged(x: Floats, width: int) -> Floats:
    """Means of a trend over `width` samples each."""
    return x[: x.size // width * width].reshape(-1, width).mean(axis=1)


def _of_valve(record: LoopRecord, period: float, sign: float, kind: str) -> Mapping[str, of.Values | None]:
    """Indices of a valve in a cycle [samples]; sign, the sign of the process gain."""
    width = max(int(period / A_CYCLE), 1)
    last = record.span(len(record) - int(MOST_CYCLES * period), len(record))
    op, pv, error = (_averaged(x, width) for x in (last.op, sign * last.pv, record.error))
    cycle = period / width
    out = {"he": of.curve_fit(pv if kind == LEVEL else op, cycle), "choudhury": of.nonlinearity(error)}
    if kind != LEVEL:
        out["horch"] = of.cross_correlation(op, pv, cycle)
    if kind in (FLOW, ""):
        out["yamashita"] = of.qualitative_shape(op, pv, cycle)
        out["kano"] = of.standing_share(op, pv, cycle)
    chord = of.apparent_stiction(op, pv, cycle)
    out["ellipse"] = None if chord is None else (chord,)
    return out


def _idle(record: LoopRecord, controller: Pid) -> of.Values | None:
    """The idle index on means over a part of the integral time."""
    width = max(int(controller.ti_s / IDLE_PARTS / record.dt_s), 1)
    op, pv, sp = (_averaged(x, width) for x in (record.op, record.pv, record.sp))
    return of.idle_index(op, pv, sp, math.copysign(1.0, controller.kp)) if op.size > 1 else None
