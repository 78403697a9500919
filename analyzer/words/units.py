"""Times and controller settings in words, with their units; settings are never shown without them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from analyzer.columns import Row

if TYPE_CHECKING:
    from analyzer.loop.record.quality import Scale
    from analyzer.loops.spec import LoopSpec
    from identification.controller.free_law import FreeLaw
    from identification.controller.gain_pieces import ScheduledGain
    from identification.models import Pid


def number(value: float | None) -> str:
    """Three digits, all before the point for larger numbers; empty if unknown."""
    if value is None:
        return ""
    if value == 0:
        return "0"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def duration(seconds: float | None) -> str:
    """A length of time in the most readable unit."""
    if seconds is None:
        return ""
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 7200 else f"{seconds / 3600:.3g} h"


def gain_unit(kind: str | None, pv_unit: str | None, op_unit: str | None = "%") -> str:
    """The unit of a controller gain as in loops.csv; op_unit: % or, if OP has its own range, OP."""
    if kind == "band":
        return "% band"
    return f"{op_unit or '%'}/{pv_unit or 'PV unit'}" if kind == "engineering" else "%/%"


def settings(kp: float | None, ti: float | None, gain: str, time: str) -> str:
    """Kp and Ti with their units; '' if neither is known, 'no integral action' for a Ti of 0."""
    parts = [f"Kp {number(kp)} {gain}" if kp else "integral action only"] if kp is not None else []
    if ti is not None:
        parts.append(f"Ti {number(ti)} {time}" if ti else "no integral action")
    return ", ".join(parts)


def row_settings(row: Row, kp: str = "kp", ti: str = "ti") -> str:
    """The settings in two columns of a row of the night, with the row's units."""
    gain = gain_unit(row["gain_unit"], row["pv_unit"], row.get("op_unit"))
    return settings(row[kp], row[ti], gain, row["ti_unit"] or "s")


SECONDS = {"s": 1.0, "min": 60.0}
"""Seconds of a unit of integral time; repeats per minute are the reciprocal."""


def seconds_of(ti: float, unit: str) -> float | None:
    """An integral time in seconds; None without integral action."""
    if ti == 0:
        return None
    return 60.0 / ti if unit == "repeats/min" else ti * SECONDS[unit or "s"]


def changed_settings(row: Row) -> str:
    """Old and new settings of a row with their units; a band also as gain and other times also in seconds. If the old
    ones are not stated, the new ones alone."""
    if row["kp"] is None and row["ti"] is None:
        return row_settings(row, "kp_new", "ti_new")
    gain, time = gain_unit(row["gain_unit"], row["pv_unit"], row.get("op_unit")), row["ti_unit"] or "s"
    old, new = (row["kp"], row["ti"]), (row["kp_new"], row["ti_new"])
    kp = "integral action only" if new[0] == 0 else f"Kp {arrow(old[0], new[0])} {gain}"
    if row["gain_unit"] == "band" and old[0] and new[0]:
        more = "more" if new[0] < old[0] else "less"
        kp += f" ({more} gain: {arrow(100 / old[0], 100 / new[0])} %/%)"
    if old[1] == 0 and new[1] == 0:
        return f"{kp}, Ti off"
    ti = f"Ti {arrow(old[1] or None, new[1] or None)} {time}"
    if time != "s" and new[1]:
        ti += f" ({arrow(*(None if t is None else seconds_of(t, time) for t in (old[1], new[1])))} s)"
    return f"{kp}, {ti}"


def arrow(old: float | None, new: float | None) -> str:
    """An old and a new number, 'none' for an unknown one."""
    return f"{number(old) or 'none'} \u2192 {number(new) or 'none'}"


def of_controller(pid: Pid, spec: LoopSpec, pv_span: float) -> str:
    """A controller's settings in the units of entry."""
    from analyzer.loops.tags import as_stated, derivative_as_stated

    kp, ti = as_stated(pid, spec, pv_span)
    known = settings(kp, ti, gain_unit(spec.gain_unit, spec.pv_unit, spec.op_unit), spec.ti_unit)
    td = derivative_as_stated(pid, spec, pv_span)
    return f"{known}, Td {number(td)} {'s' if spec.ti_unit == 's' else 'min'}" if td else known


def intervals_of(pid: Pid, law: FreeLaw | None, spec: LoopSpec, pv_span: float) -> str:
    """The 90 % intervals of a law's gain and integral time in the units of entry; '' without a law, or if they do not
    hold the reported settings."""
    from analyzer.loops.tags import as_stated

    if law is None or not all(of.low <= x <= of.high for x, of in ((pid.kp, law.kp), (pid.ti_s, law.ti_s))):
        return ""
    kps = [replace(law.found, kp=x) for x in (law.kp.low, law.kp.high)]
    tis = [replace(law.found, ti_s=x) for x in (law.ti_s.low, law.ti_s.high)]
    intervals = []
    for at, (name, pids) in enumerate((("Kp", kps), ("Ti", tis))):
        low, high = sorted(as_stated(pid, spec, pv_span)[at] for pid in pids)
        intervals += [f"{name} {number(low)} to {number(high)}"] if low < high else []
    return f" (90 % intervals: {', '.join(intervals)})" if intervals else ""


def corrected_columns(stated: Pid, shown: Pid, spec: LoopSpec, pv_span: float) -> str:
    """The columns of loops.csv, and their new values, with which a stated controller equals the one in the record."""
    pv, op = pv_span / 100.0, (spec.op_hi - spec.op_lo) / 100.0
    columns = (
        ("gap", stated.gap, shown.gap, shown.gap * pv),
        ("gap_gain", stated.gap_gain, shown.gap_gain, shown.gap_gain),
        ("pv_filter_s", stated.pv_filter_s, shown.pv_filter_s, shown.pv_filter_s),
        ("op_rate", stated.op_rate, shown.op_rate, shown.op_rate * op),
        ("op_lo_limit", stated.op_lo, shown.op_lo, spec.op_lo + shown.op_lo * op),
        ("op_hi_limit", stated.op_hi, shown.op_hi, spec.op_lo + shown.op_hi * op),
        ("sp_weight", stated.sp_weight, shown.sp_weight, shown.sp_weight),
    )
    form = [] if shown.error_form is stated.error_form else [f"error_form {shown.error_form}"]
    return ", ".join([*form, *(f"{name} {number(x)}" for name, was, now, x in columns if was != now)])


def schedule_shown(seen: ScheduledGain, stated: Pid, spec: LoopSpec, scale: Scale) -> str:
    """The columns of loops.csv that state a schedule with an edge, as the record shows it."""
    from analyzer.loops.tags import as_stated

    assert seen.edge is not None
    low, span = (scale.op_low, scale.op_span) if seen.over == "op" else (scale.low, scale.span)
    columns = f"gain_schedule {seen.over} {number(low + seen.edge * span / 100.0)}:{number(seen.above / seen.below)}"
    if abs(seen.below - 1.0) <= abs(seen.above - 1.0):
        return columns
    kp, _ = as_stated(replace(stated, kp=seen.below * stated.kp), spec, scale.span)
    return f"kp {number(kp)}, {columns}"


def settings_changed(old: LoopSpec, new: LoopSpec, clock: str) -> str:
    """Settings changed within the night, and the time of day."""
    gain = gain_unit(new.gain_unit, new.pv_unit, new.op_unit)
    parts = [
        f"{name} {arrow(a, b)} {unit}"
        for name, a, b, unit in (("Kp", old.kp, new.kp, gain), ("Ti", old.ti, new.ti, new.ti_unit))
        if a != b
    ]
    what = ", ".join(parts) or "settings changed"
    return f"{what} at {clock}"
