"""A found model kept in a file, read again with suspicion, and run over another recording of its loop."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.explain.case import Case
from analyzer.loop.quality import Scale
from identification.errors import InputError
from identification.mismatch.answer import Answer
from identification.mismatch.diagnosis import transmitter_end
from identification.mismatch.explanation import Explanation
from identification.mismatch.model_file import VERSION, carried, carried_closed, constants, to_data
from identification.record import Floats

LARGEST = 1e9
"""Size of a model's numbers at most, in percent and seconds; ours."""
RUNAWAY_PCT = 1e5
"""Size of simulated PV and OP at most [%]; ours: a thousand ranges are no plant."""
RUNS = "a model that can be run on this recording"


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
        data = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
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
    scale = data["scale"] if isinstance(data.get("scale"), dict) else {}
    for name, value in {**held, **placed, **scale}.items():
        number = not isinstance(value, bool) and isinstance(value, int | float)
        if not number or not abs(value) <= LARGEST:  # false of NaN
            raise InputError(
                f"{path}: {name} is {str(value)[:40]}",
                f"a number of at most {LARGEST:g} in size",
                "correct it or save the model anew",
            )
    for name in ("pv_span", "op_span"):
        if name in scale and not scale[name] > 0:
            raise InputError(f"{path}: {name} is {scale[name]:g}", "a span above 0", "save the model anew")
    if not held.get("CLIP_LO", -LARGEST) < held.get("CLIP_HI", LARGEST) or held.get("RATE", 1.0) <= 0:
        raise InputError(
            f"{path}: limits that nothing fits between",
            "CLIP_LO below CLIP_HI, RATE above 0",
            "save the model anew",
        )
    if data.get("version", VERSION) != VERSION:
        seen = f"{path}: a model of version {str(data['version'])[:20]}"
        raise InputError(seen, f"version {VERSION}", "save it anew with this triage")
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
    try:
        if closed and law is None:
            raise InputError(
                f"{c.spec.loop}: no settings of its controller", "kp and ti", "state them in loops.csv"
            )
        if closed and law is not None:
            pv, op = carried_closed(data, sp, op, pv, r.dt_s, law)
        else:
            pv = carried(data, op, pv, r.dt_s)
    except (ZeroDivisionError, OverflowError, FloatingPointError) as error:
        raise InputError(f"{c.spec.loop}: {error}", RUNS, "save the model anew") from error
    if not (np.abs(pv).max() <= RUNAWAY_PCT and np.abs(op).max() <= RUNAWAY_PCT):  # false of NaN
        raise InputError(f"{c.spec.loop}: PV or OP runs away", RUNS, "save the model anew")
    at = r.start_s + r.time_s
    pv_at = np.interp(stamps, at, scale.low + pv * scale.span / 100.0)
    return pv_at, np.interp(stamps, at, scale.op_low + op * scale.op_span / 100.0)
