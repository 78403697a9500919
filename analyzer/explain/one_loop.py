"""From an export's loop to its explanation and back: records in, the answer as plain data and as words out."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.config import Config
from analyzer.explain.user_model import Brought, judged
from analyzer.explain.views import Views, views
from analyzer.history.series import Series
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import controller
from analyzer.quality import Prepared, Scale, onto_clock, prepare
from identification.controller.check import StatedSettings
from identification.errors import InputError, NotAssessedError
from identification.mismatch import diagnosis as mismatch
from identification.mismatch.answer import Answer, answer
from identification.mismatch.model_file import carried, carried_closed, constants, to_data
from identification.mismatch.recording import Recording
from identification.mismatch.words import sentence, unexplained_reason
from identification.record import Floats
from identification.simulation.parameters import Slot, neutral

SPAN_DIFFERS = 0.01
"""Relative difference of two PV spans from which a model's percent are not the record's; ours."""


@dataclass(frozen=True, slots=True)
class Case:
    """One loop of an export, ready to be explained: its record, the subject made of it, and what was left aside."""

    spec: LoopSpec
    prepared: Prepared
    subject: Recording
    shortened: str = ""


def loop_of(specs: tuple[LoopSpec, ...], tag: str) -> LoopSpec:
    """The row of one loop.

    Raises
    ------
    InputError
        There is none of that name.
    """
    for spec in specs:
        if spec.loop == tag:
            return spec
    known = ", ".join(s.loop for s in specs[:6])
    raise InputError(f"no loop {tag}", f"one of {known}", "check --loop and --loops")


def stated_law(spec: LoopSpec, prepared: Prepared) -> StatedSettings | None:
    """The controller as stated, integral time in samples; None where it is not known or is no PI."""
    pid = controller(spec, prepared.scale.span)
    if pid is None or pid.td_s > 0 or not math.isfinite(pid.ti_s):
        return None
    dt_s = prepared.record.dt_s
    return StatedSettings(pid.kp, pid.ti_s / dt_s, dt_s / (spec.scan_s or dt_s))


def neighbours(
    spec: LoopSpec, specs: tuple[LoopSpec, ...], series: Mapping[str, Series], p: Prepared
) -> tuple[Floats, ...]:
    """OPs of the export's other loops on this loop's clock."""
    r = p.record
    clock = r.start_s + r.time_s
    out = []
    for other in specs:
        if other.loop != spec.loop and other.op and other.op in series:
            op, gap = onto_clock(series[other.op], clock, r.dt_s, Config().quality)
            if not gap.all() and float(np.ptp(op)) > 0:
                out.append(op)
    return tuple(out)


def snapped(series: dict[str, Series], pv: str) -> dict[str, Series]:
    """The same samples with stamps that scatter by less than half a sample put onto PV's uniform clock.

    Holding values on a clock would repeat or lose a sample wherever a stamp is a little late.
    """
    stamp = series[pv].stamp_s
    if stamp.size < 3:
        return series
    spacing = float(np.median(np.diff(stamp)))
    index = np.concatenate(([0.0], np.cumsum(np.maximum(np.round(np.diff(stamp) / spacing), 1.0))))
    dt, start = (float(v) for v in np.polyfit(index, stamp - stamp[0], 1))
    out = {}
    for tag, x in series.items():
        at = np.round((x.stamp_s - stamp[0] - start) / dt)
        near = bool(np.max(np.abs(x.stamp_s - stamp[0] - start - at * dt), initial=0.0) < 0.49 * dt)
        if not near or (x.stamp_s.size > 1 and float(np.diff(at).min()) < 1.0):
            return series
        out[tag] = Series(stamp[0] + at * dt, x.value, x.bad, x.text)
    return out


MOST_SAMPLES, STRETCH_SAMPLES = 40_000, 15_000
"""Samples up to which a recording is explained whole, and length of the most telling stretch of a longer one; ours:
20 s of processor time either way, for a long recording holds more that asks for an effect."""


def telling_stretch(prepared: Prepared, most: int | None) -> tuple[Prepared, str]:
    """The stretch in which OP travels most of a recording of more than so many samples, and a sentence on it."""
    r = prepared.record
    if most is None or len(r) <= most:
        return prepared, ""
    most = min(most, STRETCH_SAMPLES)
    travel = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(r.op)))))
    first = int(np.argmax(travel[most - 1 :] - travel[: len(r) - most + 1]))
    days = f"{most * r.dt_s / 86400:.1f} of {len(r) * r.dt_s / 86400:.1f} days"
    said = f"Judged on {most} of {len(r)} samples, the {days} in which OP moves most."
    return replace(prepared, record=r.span(first, first + most)), said


def case(
    spec: LoopSpec,
    specs: tuple[LoopSpec, ...],
    series: dict[str, Series],
    config: Config,
    most: int | None = MOST_SAMPLES,
) -> Case:
    """Prepare one loop; of a recording of more than `most` samples the most telling stretch, None for all.

    Raises
    ------
    NotAssessedError
        Where PV or OP is missing or never moves.
    """
    raw = series[spec.pv or ""]
    series = snapped(series, spec.pv or "")
    prepared, shortened = telling_stretch(prepare(spec, series, config.quality), most)
    r = prepared.record
    if not prepared.op_known:
        raise NotAssessedError(f"{spec.loop}: needs OP, has none")
    if float(np.ptp(r.op)) == 0 or float(np.ptp(r.pv)) == 0:
        raise NotAssessedError(f"{spec.loop}: needs OP and PV that move, one of them stands still")
    stamps = raw.stamp_s[~raw.bad]
    subject = Recording(
        None if r.sp_estimated else r.sp,
        r.pv,
        r.op,
        ~(r.bad | r.mask("gap")),
        r.dt_s,
        stamps[(stamps >= r.start_s - r.dt_s) & (stamps <= r.start_s + r.duration_s)],
        stated_law(spec, prepared),
        not prepared.scale.recorded,
        neighbours(spec, specs, series, prepared),
        spec.type.strip().lower(),
    )
    return Case(spec, prepared, subject, shortened)


@dataclass(frozen=True, slots=True)
class Explained:
    """One loop explained: what was asked, what was found, the answer in numbers and as data, what a page draws of it,
    and the user's own model."""

    case: Case
    found: mismatch.Explanation
    said: Answer
    data: dict[str, Any]
    views: Views
    brought: Brought | None = None

    def model(self) -> dict[str, Any]:
        """The model found, the plain loop where nothing was, as data to be written."""
        return saved_model(self.case, self.found, self.said)


def explained(c: Case, tell: Callable[[str], None], brought: Mapping[str, Any] | None = None) -> Explained:
    """Explain one loop; `brought` is the user's own model, which is judged and is one more start of the search."""
    start = None if brought is None else plain_start(brought)
    with np.errstate(all="ignore"):  # a candidate that runs away loses; its overflow is nobody's business
        found = mismatch.explain(c.subject, tell, start)
        said = answer(found, c.subject)
        own = None if brought is None else judged(brought, found, c.subject, span_note(c, brought))
        drawn = views(found, c.subject, said, own)
    return Explained(c, found, said, as_data(c, said, own), drawn, own)


def plain_start(brought: Mapping[str, Any]) -> Floats:
    """Constants of the plain loop in a model, shape (SIZE,): the rest of it is judged, not believed."""
    own, out = constants(dict(brought)), neutral()
    for slot in (Slot.T, Slot.L, Slot.K):
        out[slot] = own[slot]
    return out


def span_note(c: Case, brought: Mapping[str, Any]) -> str:
    """What to say where a model was made with another PV span than the record now has; empty where not."""
    scale = brought.get("scale")
    then = scale.get("pv_span") if isinstance(scale, dict) else None
    if not isinstance(then, int | float) or abs(then / c.prepared.scale.span - 1.0) < SPAN_DIFFERS:
        return ""
    now = c.prepared.scale.span
    return (
        f"it was made with a PV span of {then:.4g}, this record has {now:.4g}: its gain is off by their ratio"
    )


def as_data(c: Case, said: Answer, brought: Brought | None = None) -> dict[str, Any]:
    """The answer as data that JSON can hold."""
    effects = [
        {
            "name": e.name,
            "block": e.block,
            "parameters": {
                k: {"value": v.value, "low": v.low, "high": v.high, "unit": v.unit}
                for k, v in e.parameters.items()
            },
            "held_out_share": e.held_out_share,
            "alternatives": list(e.alternatives),
        }
        for e in said.effects
    ]
    fit = said.fit if brought is None else said.fit | {"brought": brought.as_data()}
    data = {
        "loop": c.spec.loop,
        "verdict": said.verdict,
        "block": said.block,
        "effects": effects,
        "where": said.where,
        "fit": fit,
        "moved": said.moved,
        "remaining": said.remaining,
        "reason": f"{reason_of(said)} {c.shortened}".strip(),
    }
    return json_ready(data)


def reason_of(said: Answer) -> str:
    """The verdict in words, with what the recording lacks."""
    if said.verdict == "unexplained":
        return unexplained_reason(said)
    caution = f" The figures are rough: it {said.caution}." if said.caution else ""
    return sentence(said) + caution


def json_ready(x: Any) -> Any:
    """The same with numbers that JSON knows: no NaN, no infinity, no numpy types."""
    if isinstance(x, dict):
        return {str(k): json_ready(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [json_ready(v) for v in x]
    if isinstance(x, np.generic):
        x = x.item()
    if isinstance(x, float):
        return float(f"{x:.6g}") if math.isfinite(x) else None
    return x


def abstained(loop: str, reason: str) -> dict[str, Any]:
    """The answer where the question cannot be answered from the record."""
    return {
        "loop": loop,
        "verdict": "unexplained",
        "block": "none",
        "effects": [],
        "where": {},
        "fit": {},
        "moved": {},
        "remaining": None,
        "reason": reason,
    }


def saved_model(c: Case, found: mismatch.Explanation, said: Answer) -> dict[str, Any]:
    """The model found, the plain loop where nothing was, as data to be written."""
    s = c.prepared.scale
    scale = {"pv_low": s.low, "pv_span": s.span, "op_low": s.op_low, "op_span": s.op_span}
    model = found.best.model
    data = to_data(
        c.spec.loop, found.p.inputs, model.c, tuple(e.name for e in said.effects), found.late_s, scale
    )
    end = mismatch.transmitter_end(found.recorder, c.subject.pv)
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
