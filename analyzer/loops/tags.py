"""The loops of an export: their tags, and their controllers in the project's units and in the plant's."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from analyzer.loops.names import loops_of
from analyzer.loops.spec import ROLES, LoopSpec, Output, read_loops
from identification.errors import InputError
from identification.models import Form, Pid

UNNAMED = re.compile(r"column \d+")
"""Name of a column of a table without a header."""
__all__ = ["LoopSpec", "as_stated", "controller", "find_loops", "match", "no_loops", "read_loops"]


def find_loops(tags: Iterable[str]) -> tuple[LoopSpec, ...]:
    """Loops with at least a PV, found by the names of the tags."""
    return tuple(LoopSpec(loop, **tags_of) for loop, tags_of in loops_of(tags).items())  # type: ignore[arg-type]


def no_loops(tags: Sequence[str]) -> InputError:
    """Error for an export whose tags name no loop."""
    seen = f"no loops in the export, whose tags are {', '.join(tags[:8])}{', ...' if len(tags) > 8 else ''}"
    remedy = "let 'triage loops' look for them in the data, or state them with --loops loops.csv"
    return InputError(seen, "tags such as LOOP.PV", remedy)


def match(specs: Sequence[LoopSpec], tags: Iterable[str]) -> tuple[tuple[LoopSpec, ...], tuple[str, ...]]:
    """Give each loop its tags in the export.

    A tag that is not stated in the row is found by its ending, LOOP.SP and so on by default.

    Returns
    -------
    tuple of LoopSpec
        All of `specs`; `pv` is None if it is missing in the export.
    tuple of str
        A sentence for every missing loop and tag, and one for loops only in the export.
    """
    known = dict.fromkeys(tags)
    specs, by_place = in_order(specs, tuple(known))
    by_ending = loops_of(known)
    alone = tuple(_matched(spec, known, by_ending.get(spec.loop, {})) for spec in specs)
    by_loop = {spec.loop: spec for spec in alone}
    matched = tuple(_with_partner_tags(spec, by_loop, known) for spec in alone)
    notes = list(by_place)
    alike = {spelling(tag): tag for tag in known}
    pairs = zip(specs, matched, strict=True)
    notes += [note for before, after in pairs for note in _missing(before, after, alike)]
    taken = {tag for spec in matched for tag in spec.tags}
    others = [loop for loop, roles in by_ending.items() if roles["pv"] not in taken]
    if others:
        few = ", ".join(others[:5]) + (" ..." if len(others) > 5 else "")
        notes.append(f"{len(others)} loops of the export are not in loops.csv, not assessed: {few}")
    return matched, tuple(notes)


def in_order(specs: Sequence[LoopSpec], tags: Sequence[str]) -> tuple[Sequence[LoopSpec], tuple[str, ...]]:
    """Loops with the columns of a table without a header as tags, in the order of loops.csv, and a sentence on it;
    unchanged loops if the columns have names or a different number."""
    roles = ([role for role in ROLES if getattr(spec, role)] or ROLES[:3] for spec in specs)
    stated = [(k, role) for k, own in enumerate(roles) for role in own]
    if not tags or not all(UNNAMED.fullmatch(tag) for tag in tags) or len(stated) != len(tags):
        return specs, ()
    taken: list[dict[str, str]] = [{} for _ in specs]
    for (k, role), tag in zip(stated, tags, strict=True):
        taken[k][role] = tag
    first = [f"{tag} is {specs[0].loop}'s {role.upper()}" for role, tag in taken[0].items()]
    more = " ..." if len(specs) > 1 else ""
    note = f"no header: columns are taken in the order of loops.csv: {', '.join(first)}{more}"
    return tuple(replace(s, **own) for s, own in zip(specs, taken, strict=True)), (note,)  # type: ignore[arg-type]


def _matched(spec: LoopSpec, known: Mapping[str, None], found: Mapping[str, str]) -> LoopSpec:
    wanted = {role: getattr(spec, role) or found.get(role, f"{spec.loop}.{role.upper()}") for role in ROLES}
    present: dict[str, Any] = {role: tag if tag in known else None for role, tag in wanted.items()}
    return replace(spec, **present, wanted_pv=wanted["pv"])


def _with_partner_tags(
    spec: LoopSpec, by_loop: Mapping[str, LoopSpec], known: Mapping[str, None]
) -> LoopSpec:
    """A loop with the tags of the loops with which it is judged or by which it is loaded, if the export has them."""
    partner = spec.override_with or spec.split_of
    other = by_loop.get(partner) if partner != spec.loop else None
    feed, load = (_tag_of(name, by_loop, known) for name in (spec.feedforward, spec.upstream))
    output = Output(other.op, other.op_lo, other.op_hi) if other is not None and other.op else None
    return replace(spec, partner_output=output, feed=feed, load=load) if output or feed or load else spec


def _tag_of(name: str, by_loop: Mapping[str, LoopSpec], known: Mapping[str, None]) -> str | None:
    """The PV of a loop, or a tag, of this name; None if the export has neither."""
    return by_loop[name].pv if name in by_loop else name if name in known else None


def spelling(tag: str) -> str:
    """A tag without the differences between spellings: capitals, blanks and marks."""
    return re.sub(r"[\W_]+", "", tag).casefold()


def _missing(before: LoopSpec, after: LoopSpec, alike: Mapping[str, str]) -> list[str]:
    def meant(tag: str | None) -> str:
        found = alike.get(spelling(tag or ""))
        return "" if found is None else f"; did you mean {found}?"

    wanted = after.wanted_pv
    notes = (
        [] if after.pv else [f"{after.loop}: not assessed, no PV tag {wanted} in the export{meant(wanted)}"]
    )
    stated = [(role, getattr(before, role)) for role in ROLES if role != "pv" and getattr(before, role)]
    lost = [(role, tag) for role, tag in stated if getattr(after, role) is None]
    partner, feed = after.override_with or after.split_of, after.feedforward
    if partner and after.partner_output is None:
        notes.append(f"{after.loop}: no OP of {partner} in the export, judged alone")
    if feed and after.feed is None:
        notes.append(f"{after.loop}: feedforward {feed} is neither a loop nor a tag of the export")
    if after.upstream and after.load is None:
        notes.append(f"{after.loop}: upstream {after.upstream} is neither a loop nor a tag of the export")
    return notes + [
        f"{after.loop}: {role.upper()} tag {tag} is not in the export{meant(tag)}" for role, tag in lost
    ]


def controller(spec: LoopSpec, pv_span: float | None, gain_share: float = 1.0) -> Pid | None:
    """The stated controller in percent, seconds and ideal form; None without gain or integral time.

    Laws, with Kp, Ti, Td as in loops.csv and e = SP - PV:
    ideal     Kp (e + 1/Ti int e dt + Td de/dt)
    series    Kp (1 + 1/(Ti s)) (1 + Td s) e
    parallel  Kp e + 1/Ti int e dt + Td de/dt, the latter two with the sign of Kp and in the units of Kp
    A band is 100/Kp in percent. An integral time of 0 means no integral action. Derivative time
    is in the unit of the integral time, in minutes if that is repeats/min. A kp of 0 with an integral time is the
    law 1/Ti int e dt, negative if OP rises with PV.

    Parameters
    ----------
    spec : LoopSpec
    pv_span : float or None
        Span of the PV in its own unit; needed if the gain is stated in engineering units.
    gain_share : float
        Factor of Kp by the schedule of the gain [-].

    Raises
    ------
    InputError
        The gain is in engineering units and there is no span.
    """
    if spec.kp is None or spec.ti is None or (spec.kp == 0 and not spec.ti):
        return None
    kp = gain_share * (100 / spec.kp if spec.gain_unit == "band" and spec.kp else spec.kp)
    repeats = spec.ti_unit == "repeats/min"
    ti_s = math.inf if spec.ti == 0 else 60 / spec.ti if repeats else spec.ti * _unit_s(spec)
    td_s = (spec.td or 0.0) * _unit_s(spec)
    if kp == 0.0:
        alone = Pid(0.0, ti_s / (gain_share * unit_ratio(spec, pv_span)), gain_share=gain_share)
        return _with_extras(alone, spec, pv_span)
    if spec.form is Form.PARALLEL:
        ti_s, td_s = abs(kp / gain_share) * ti_s, td_s / abs(kp / gain_share)
    elif spec.form is Form.SERIES and td_s != 0 and math.isfinite(ti_s):
        kp, ti_s, td_s = kp * (1 + td_s / ti_s), ti_s + td_s, ti_s * td_s / (ti_s + td_s)
    pid = Pid(kp * unit_ratio(spec, pv_span), ti_s, td_s, gain_share=gain_share)
    return _with_extras(pid, spec, pv_span)


def _with_extras(pid: Pid, spec: LoopSpec, pv_span: float | None) -> Pid:
    """The controller with the other settings of its row, in percent and seconds."""
    op_span = spec.op_hi - spec.op_lo
    limits = ((spec.op_lo_limit, pid.op_lo), (spec.op_hi_limit, pid.op_hi))
    low, high = (other if own is None else 100.0 * (own - spec.op_lo) / op_span for own, other in limits)
    return replace(
        pid,
        scan_s=pid.scan_s if spec.scan_s is None else spec.scan_s,
        op_lo=low,
        op_hi=high,
        td_filter=pid.td_filter if spec.td_filter is None else spec.td_filter,
        pv_filter_s=spec.pv_filter_s,
        gap=100.0 * spec.gap / (pv_span or 100.0),
        gap_gain=spec.gap_gain,
        error_form=spec.error_form,
        op_rate=math.inf if spec.op_rate is None else 100.0 * spec.op_rate / op_span,
        sp_weight=spec.sp_weight,
    )


def as_stated(pid: Pid, spec: LoopSpec, pv_span: float | None) -> tuple[float, float]:
    """Gain and integral time of `pid` in the units and the form of `spec`, for entry in the controller.

    The inverse of `controller`. No integral action is stated as 0. The series form does not allow Ti < 4 Td; then the
    nearest settings, with both times equal, are used.
    """
    if pid.kp == 0.0:
        alone_s = pid.ti_s * pid.gain_share * unit_ratio(spec, pv_span)
        return 0.0, 60 / alone_s if spec.ti_unit == "repeats/min" else alone_s / _unit_s(spec)
    gain = pid.kp / (pid.gain_share * unit_ratio(spec, pv_span))
    share = _series_share(pid, spec)
    ti_s = pid.ti_s / abs(gain) if spec.form is Form.PARALLEL else pid.ti_s * share
    kp = 100 / (gain * share) if spec.gain_unit == "band" else gain * share
    if math.isinf(ti_s):
        return kp, 0.0
    return kp, 60 / ti_s if spec.ti_unit == "repeats/min" else ti_s / _unit_s(spec)


def derivative_as_stated(pid: Pid, spec: LoopSpec, pv_span: float | None) -> float:
    """Derivative time of `pid` in the unit of time and the form of `spec`; 0 for none."""
    ratio = abs(pid.kp / (pid.gain_share * unit_ratio(spec, pv_span))) if spec.form is Form.PARALLEL else 1.0
    return pid.td_s * ratio / _series_share(pid, spec) / _unit_s(spec)


def unit_ratio(spec: LoopSpec, pv_span: float | None) -> float:
    """Percent of OP per percent of PV, for one unit of the stated gain."""
    if spec.gain_unit != "engineering":
        return 1.0
    if not pv_span:
        seen = f"{spec.loop}: gain in engineering units and no PV range"
        raise InputError(seen, "pv_lo and pv_hi", "state them in loops.csv")
    return pv_span / (spec.op_hi - spec.op_lo)


def _unit_s(spec: LoopSpec) -> float:
    """The unit of the stated times [s]; only of the derivative time if the integral time is in repeats/min."""
    return 1.0 if spec.ti_unit == "s" else 60.0


def _series_share(pid: Pid, spec: LoopSpec) -> float:
    """Gain and integral time of the series form over those of the ideal form; 1 for any other form."""
    if spec.form is not Form.SERIES or pid.td_s == 0 or math.isinf(pid.ti_s):
        return 1.0
    return (1 + math.sqrt(max(0.0, 1 - 4 * pid.td_s / pid.ti_s))) / 2
