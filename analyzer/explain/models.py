"""Models of a loop in files: the improved one is saved, a user's one is checked, judged and simulated."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.explain.case import Case
from analyzer.loop.record.quality import Scale
from identification.errors import InputError
from identification.mismatch.answer import restored, unanswered
from identification.mismatch.explanation import Explanation
from identification.mismatch.model_file import VERSION, carried, carried_closed, constants
from identification.mismatch.proof import Misfit, misfit
from identification.mismatch.recording import Recording
from identification.mismatch.starts import HELD_OUT
from identification.record import Floats
from identification.simulation.parameters import Slot, neutral

AS_GOOD = 1.05
"""Ratio of two misfits up to which two models simulate alike: misfits of one baseline model from different
starts agree within a hundredth."""

LARGEST = 1000000000.0  # Size of a model's numbers at most, in percent and seconds
RUNAWAY_PCT = 100000.0  # Size of simulated PV and OP at most [%]: a thousand ranges are no plant
SPAN_DIFFERS = 0.01  # Relative difference of two PV spans from which a model's percent are not the record's

HUNDRED = (60.0, 160.0)
"""Ratios of two gains that indicate percent against fractions; ours: a refit moves a gain by less."""
TIMES = (((40.0, 90.0), "minutes"), ((2400.0, 5400.0), "hours"))
"""Ratios of two time constants that indicate minutes, or hours, against seconds."""
SAVED, SAVE_AGAIN = "a model saved by `triage explain`", "save it again"
RUNS = "a model that can be run on this recording"
SCALE = ("pv_low", "pv_span", "op_low", "op_span")


def read_model(path: Path, loop: str) -> dict[str, Any]:
    """Read a model of that loop.

    Raises
    ------
    InputError
        It is not a model, or another loop's.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: {error}", SAVED, SAVE_AGAIN) from None
    if not isinstance(data, dict) or "constants" not in data:
        raise InputError(f"{path}: no model", SAVED, SAVE_AGAIN)
    if data.get("loop") != loop:
        raise InputError(f"{path}: a model of {data.get('loop')}", f"one of {loop}", "check MODEL and --loop")
    checked(data, path)
    return data


def checked(data: Mapping[str, Any], path: Path) -> None:
    """Raise InputError if a number of a model is invalid."""

    def refused(seen: str, expected: str, todo: str = "save the model again") -> InputError:
        return InputError(f"{path}: {seen}", expected, todo)

    held, scale = (data[k] if isinstance(data.get(k), dict) else {} for k in ("constants", "scale"))
    placed, most = {k: data.get(k, 0.0) for k in ("middle_op_pct", "level_pv_pct", "late_s")}, LARGEST
    for name, value in {**held, **placed, **scale}.items():
        number = not isinstance(value, bool) and isinstance(value, int | float)
        if not number or not abs(value) <= most:  # false of NaN
            wanted, todo = f"a number of at most {most:g} in size", "correct it or save the model again"
            raise refused(f"{name} is {str(value)[:40]}", wanted, todo)
    for name in ("pv_span", "op_span"):
        if name in scale and not scale[name] > 0:
            raise refused(f"{name} is {scale[name]:g}", "a span above 0")
    if not held.get("CLIP_LO", -most) < held.get("CLIP_HI", most) or held.get("RATE", 1.0) <= 0:
        raise refused("limits without a range between them", "CLIP_LO below CLIP_HI, RATE above 0")
    if data.get("version", VERSION) != VERSION:
        seen = f"a model of version {str(data['version'])[:20]}"
        raise refused(seen, f"version {VERSION}", "save it again with this triage")
    constants(dict(data))


def plain_start(user_model: Mapping[str, Any]) -> Floats:
    """Baseline constants of a model, shape (SIZE,), as a start; its other constants are only judged."""
    own, out = constants(dict(user_model)), neutral()
    for slot in (Slot.T, Slot.L, Slot.K):
        out[slot] = own[slot]
    return out


@dataclass(frozen=True, slots=True)
class UserModel:
    """The user's model: simulated PV [% PV], shape (n,), its misfit on both parts, one line about it."""

    simulated: Floats = field(repr=False)
    fitted: Misfit
    held_out: Misfit
    note: str


def judged(data: Mapping[str, Any], found: Explanation, s: Recording, more: str = "") -> UserModel:
    """The user's model on the explained recording, with a free mean, compared with the refitted baseline model.

    more : further text about it.
    """
    out = carried(dict(data), s.op, s.pv, s.dt_s)
    cut = int((1.0 - HELD_OUT) * s.pv.size)
    window, (plain, better) = found.proven.window, found.proven.overall
    own = misfit(s.pv, out, window).rmse
    comparison = (
        f"Your model leaves {own:.3g} % of span rms, the baseline model fitted again {plain.rmse:.3g} %"
    )
    if found.accepted:
        comparison += f", the improved model {better.rmse:.3g} %"
    units = "" if unanswered(found) else wrong_units(constants(dict(data)), restored(found.plain.model.c))
    verdict = "" if units else against_plain(own, plain.rmse, AS_GOOD)
    note = "; ".join(x for x in (comparison, verdict, units, more) if x) + "."
    fitted, held_out = misfit(s.pv[:cut], out[:cut], window), misfit(s.pv[cut:], out[cut:], window)
    return UserModel(out, fitted, held_out, note)


def against_plain(own: float, plain: float, as_good: float) -> str:
    """Comparison of a model with the refitted baseline model, from both misfits."""
    if own > as_good * plain:
        return "it is worse than the baseline model"
    better = own * as_good < plain
    return "it is better than the baseline model" if better else "it is as good as the baseline model"


def within(ratio: float, ends: tuple[float, float]) -> bool:
    """Whether a ratio, or its inverse, is between two limits."""
    size = abs(ratio)
    return ends[0] <= size <= ends[1] or (size > 0 and ends[0] <= 1.0 / size <= ends[1])


def wrong_units(own: Floats, found: Mapping[str, float]) -> str:
    """Probable errors in a model's units compared with the identified process; empty if there are none.

    own : constants of the user's model, shape (SIZE,); found : gain [% PV/% OP] and time_constant_s of the baseline
    model fitted to the recording.
    """
    gain, lag_s = found["gain"], found["time_constant_s"]
    its, notes = f"its gain, {own[Slot.K]:.3g},", []
    if within(own[Slot.K] / gain, HUNDRED):
        notes.append(f"{its} is about 100 times off {gain:.3g}, as percent are off fractions")
    elif own[Slot.K] / gain < 0:
        notes.append(f"{its} has another sign than {gain:.3g} found")
    for ends, unit in TIMES:
        if within(own[Slot.T] / lag_s, ends):
            size = f"{own[Slot.T]:.3g} s against {lag_s:.3g} s"
            notes.append(
                f"its time constant, {size} found, looks like {unit} instead of seconds or the reverse"
            )
    return "; ".join(notes)


def span_note(now: Scale, user_model: Mapping[str, Any]) -> str:
    """Note for a model made with another PV span than that of the record; otherwise empty."""
    scale = user_model.get("scale")
    then = scale.get("pv_span") if isinstance(scale, dict) else None
    if not isinstance(then, int | float) or abs(then / now.span - 1.0) < SPAN_DIFFERS:
        return ""
    spans = f"it was made with a PV span of {then:.4g}, this record has {now.span:.4g}"
    return f"{spans}: its gain is off by their ratio"


def saved_scale(data: Mapping[str, Any], now: Scale) -> Scale:
    """Meaning of percent in a saved model: that in the fitted recording.

    Without a stated range percent is of the recorded range, which differs in the next recording.
    """
    then = data.get("scale")
    if not isinstance(then, dict) or not all(isinstance(then.get(n), int | float) for n in SCALE):
        return now
    low, span, op_low, op_span = (float(then[n]) for n in SCALE)
    return Scale(low, span, op_low, op_span, now.recorded)


def rescaled(now: Scale, then: Scale, pv: Floats, op: Floats) -> tuple[Floats, Floats]:
    """PV (or SP) and OP, shape (n,) each, in the percent of another recording's ranges."""
    return then.pv_pct(now.low + pv * now.span / 100.0), then.op_pct(now.op_low + op * now.op_span / 100.0)


def simulated(c: Case, data: dict[str, Any], stamps: Floats, closed: bool) -> tuple[Floats, Floats]:
    """PV and OP in their own units at each stamp, from a saved model in open or, if requested, closed loop.

    Raises
    ------
    InputError
        A closed loop is requested and its controller is unknown.
    """
    r, law, now = c.prepared.record, c.recording.stated, c.prepared.scale
    scale = saved_scale(data, now)
    pv, op = rescaled(now, scale, r.pv, r.op)
    sp, _ = rescaled(now, scale, r.sp, r.op)
    if closed and law is None:
        seen = f"{c.spec.loop}: no settings of its controller"
        raise InputError(seen, "kp and ti", "state them in loops.csv")
    try:
        if closed and law is not None:
            pv, op = carried_closed(data, sp, op, pv, r.dt_s, law)
        else:
            pv = carried(data, op, pv, r.dt_s)
    except (ZeroDivisionError, OverflowError, FloatingPointError) as error:
        raise InputError(f"{c.spec.loop}: {error}", RUNS, "save the model again") from error
    if not (np.abs(pv).max() <= RUNAWAY_PCT and np.abs(op).max() <= RUNAWAY_PCT):  # false of NaN
        raise InputError(f"{c.spec.loop}: the simulated PV or OP diverges", RUNS, "save the model again")
    at = r.start_s + r.time_s
    pv_at = np.interp(stamps, at, scale.low + pv * scale.span / 100.0)
    return pv_at, np.interp(stamps, at, scale.op_low + op * scale.op_span / 100.0)
