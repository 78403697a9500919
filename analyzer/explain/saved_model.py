"""A found model kept in a file, read again with suspicion, and run over another recording of its loop."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.explain.case import Case
from analyzer.quality import Scale
from identification.errors import InputError
from identification.mismatch.answer import Answer
from identification.mismatch.diagnosis import transmitter_end
from identification.mismatch.explanation import Explanation
from identification.mismatch.model_file import carried, carried_closed, constants, to_data
from identification.record import Floats


def saved_model(c: Case, found: Explanation, said: Answer) -> dict[str, Any]:
    """The model found, the plain loop where nothing was, as data to be written."""
    s = c.prepared.scale
    scale = {"pv_low": s.low, "pv_span": s.span, "op_low": s.op_low, "op_span": s.op_span}
    model = found.best.model
    data = to_data(
        c.spec.loop, found.p.inputs, model.c, tuple(e.name for e in said.effects), found.late_s, scale
    )
    end = transmitter_end(found.recorder, c.subject.pv)
    if end is not None:
        data["constants"]["CLIP_HI" if end.upper else "CLIP_LO"] = end.value
    return data


def write_model(data: Mapping[str, Any], path: Path) -> None:
    """Write a model."""
    path.write_text(json.dumps(data, indent=1))


def read_model(path: Path, loop: str) -> dict[str, Any]:
    """Read a model of that loop.

    Raises
    ------
    InputError
        It is no model, or another loop's.
    """
    try:
        data = json.loads(path.read_text())
    except ValueError as error:
        raise InputError(f"{path}: {error}", "a model saved by `triage explain`", "save it anew") from None
    if not isinstance(data, dict) or "constants" not in data:
        raise InputError(f"{path}: no model", "a model saved by `triage explain`", "save it anew")
    if data.get("loop") != loop:
        raise InputError(f"{path}: a model of {data.get('loop')}", f"one of {loop}", "check MODEL and --loop")
    checked(data, path)
    return data


def checked(data: Mapping[str, Any], path: Path) -> None:
    """Raise InputError where a number of a model is none."""
    held = data["constants"] if isinstance(data["constants"], dict) else {}
    placed = {k: data.get(k, 0.0) for k in ("middle_op_pct", "level_pv_pct", "late_s")}
    for name, value in {**held, **placed}.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(
                f"{path}: {name} is {value!r}", "a finite number", "correct it or save the model anew"
            )
    constants(dict(data))


def scale_of(data: Mapping[str, Any], now: Scale) -> Scale:
    """What percent means to a saved model: what it meant in the recording that was fitted.

    Without a stated range percent is of the range recorded, and the next recording has another.
    """
    then = data.get("scale")
    names = ("pv_low", "pv_span", "op_low", "op_span")
    if not isinstance(then, dict) or not all(isinstance(then.get(n), int | float) for n in names):
        return now
    low, span, op_low, op_span = (float(then[n]) for n in names)
    return Scale(low, span, op_low, op_span, now.recorded)


def simulated(c: Case, data: dict[str, Any], stamps: Floats, closed: bool) -> tuple[Floats, Floats]:
    """PV and OP in their own units at each stamp, from a saved model run open loop or, if wished, closed.

    Raises
    ------
    InputError
        The loop is to be closed and its controller is not known.
    """
    r, law = c.prepared.record, c.subject.stated
    scale, now = scale_of(data, c.prepared.scale), c.prepared.scale
    sp, pv = (scale.pv_pct(now.low + x * now.span / 100.0) for x in (r.sp, r.pv))
    op = scale.op_pct(now.op_low + r.op * now.op_span / 100.0)
    if closed:
        if law is None:
            raise InputError(
                f"{c.spec.loop}: no settings of its controller", "kp and ti", "state them in loops.csv"
            )
        pv, op = carried_closed(data, sp, op, pv, r.dt_s, law)
    else:
        pv = carried(data, op, pv, r.dt_s)
    at = r.start_s + r.time_s
    pv_at = np.interp(stamps, at, scale.low + pv * scale.span / 100.0)
    return pv_at, np.interp(stamps, at, scale.op_low + op * scale.op_span / 100.0)
