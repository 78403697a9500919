"""Texts on beliefs: the columns of a loop based on all nights, its reason, and its changes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from analyzer.history.plant_clock import local
from analyzer.loop.decisions import CAUSES, Action, Cause, Fault, counts
from analyzer.words import sentences
from analyzer.words.reason import joined
from analyzer.words.units import Row, duration, number

if TYPE_CHECKING:
    from analyzer.belief.belief import Belief, NightFigures
    from analyzer.belief.wear import Growth, PhaseKnown

REPAIRED = re.compile(
    r"\b(repaired|replaced|overhauled|exchanged|renewed|repacked|new (valve|actuator|positioner|packing|stem))\b",
    re.I,
)
"""Words of a note on a repaired or replaced valve."""
NOT_YET = re.compile(
    r"\b(to be|not|will be|should be|must be|must|needs? to be|order(ed)?|plan(ned)?|next)\b", re.I
)
"""Words for work that is not yet done."""
IS = {Fault.BACKLASH: "backlash", Fault.STICTION: "stiction"}


def reports_repair(text: str) -> bool:
    """Whether a note reports a repaired valve."""
    return bool(REPAIRED.search(text)) and not NOT_YET.search(text)


def width_text(now: Belief) -> str:
    """The fault of a worn valve, with the pooled width and its interval."""
    pool = now.constants.get("width")
    width = None if pool is None else pool.pooled
    fault = now.told.fault if now.told.fault in IS else now.valve.fault(None)
    kind = IS.get(fault)
    if kind is None:
        return "the valve is worn"
    if width is None:
        return f"valve {kind} about {now.valve.width:.2g} % of OP"
    return f"valve {kind} {width.value:.2g} % of OP ({width.low:.3g} to {width.high:.3g})"


def wear_text(row: Row) -> str:
    """Rate of a valve's wear, its start, and the date at which it reaches the next size."""
    ends = f"{row['wear_low_pct']:.2g} to {row['wear_high_pct']:.2g}"
    text = f"{row['wear_pct_per_month']:.2g} % of OP in 30 days ({ends}) since {row['wear_since']}"
    size, first, last = row["reaches_pct"], row["reaches_from"], row["reaches_by"]
    if first is None:
        return text
    when = f"between {first} and {last}" if last else f"after {first}"
    return f"{text}; reaches {size:.2g} % {when}"


def reported_columns(now: Belief, row: Row) -> dict[str, Any]:
    """The columns of a loop's row based on all nights."""
    t = now.told
    pair = t.pair if t.action is Action.RETUNE else None
    out: dict[str, Any] = {f"osc_{c}_pct": t.confidence.get(c) for c in CAUSES}
    out |= {
        "cause": t.cause,
        "valve_fault": t.fault,
        "source_loop": t.source,
        "action": t.action,
        "due": t.due,
    }
    out |= {"kp_new": pair and pair.kp, "ti_new": pair and pair.ti}
    out |= {"advice": _advice(now, row), "reason": belief_reason(now, row)}
    if pair is not None:
        out |= {"expected_period_s": pair.period_s, "expected_pv_amplitude_pct": pair.amplitude_pct}
    return out | _valve_columns(now, row)


def _advice(now: Belief, row: Row) -> str | None:
    """The full advice: that of the night that gave the pair, with other advice of nights; otherwise the night's own
    if it is reported."""
    t, pairs = now.told, now.remedy.pairs
    if t.calmed:
        return sentences("settings")["calmed"]
    if t.action is not Action.RETUNE or t.pair is None:
        return row["advice"] if row["action"] == t.action else ""
    spread = ""
    if len(pairs) > 1:
        kp, ti = (
            f"{number(min(x))} to {number(max(x))}" for x in ([p.kp for p in pairs], [p.ti for p in pairs])
        )
        unit, held = row["ti_unit"] or "s", t.pair.night
        spread = f"{len(pairs)} nights advise Kp {kp} and Ti {ti} {unit}; that of {held} is kept."
    return " ".join(filter(None, (t.pair.advice, spread)))


def _valve_columns(now: Belief, row: Row) -> dict[str, Any]:
    """Backlash or stickband: the night's own, the pooled one if it has none of the reported fault."""
    names = ("backlash_pct", "stickband_pct", "slip_jump_pct")
    found = {k: p.pooled for k, p in now.constants.items()}
    width, jump = found.get("width"), found.get("slip_jump")
    out: dict[str, Any] = dict.fromkeys(names)
    if now.told.fault is Fault.BACKLASH:
        out["backlash_pct"] = row["backlash_pct"] or (width and width.value)
    elif now.told.fault is Fault.STICTION:
        out["stickband_pct"] = row["stickband_pct"] or (width and width.value)
        out["slip_jump_pct"] = row["slip_jump_pct"] or (jump and jump.value)
    return out


def belief_reason(now: Belief, row: Row) -> str:
    """The reason of a loop: the night's own if the nights agree, otherwise the joint one; with the valve's width over
    the nights if it is worn."""
    t, nights = now.told, now.valve.nights
    worn = nights > 1 and t.fault in IS and now.valve.certain
    sure = f"confirmed by {nights} nights" if worn else None
    over = f"{nights} nights: {width_text(now)}, confirmed since {now.valve.certain}" if worn else None
    differs = not (t.own or t.calmed) and row["cause"] != t.cause
    alone = f"cause by this night alone: {sentences('alone')[row['cause']]}" if differs else None
    text = _calmed(now) if t.calmed else row["reason"] if t.own else _together(now, row)
    first, *others = (text or "").split("; ")
    return joined(first, sure, *others, over, alone)


def _calmed(now: Belief) -> str:
    """Remaining part of a cycle since its settings were changed."""
    last, then = now.last, now.before
    assert last is not None
    assert then is not None
    return (
        f"cycles every {duration(last.period_s)} with {_sizes(last)} since its settings were changed; "
        f"at the next shutdown stroke it; {width_text(now)}; it cycled every {duration(then.period_s)} with "
        f"{_sizes(then)} until {then.night}"
    )


def _sizes(seen: NightFigures | None) -> str:
    """Size of a cycle and of the error."""
    if seen is None:
        return "an amplitude that is not known"
    error = f", average absolute error {number(seen.error_pct)} %" if seen.error_pct is not None else ""
    return f"±{number(seen.amplitude_pct or 0.0)} % of span{error}"


def _together(now: Belief, row: Row) -> str:
    """Joint result of the nights on the cycle, and on the valve."""
    t, cycles = now.told, counts(row["oscillating_pct"])
    cycle = f"cycles every {duration(row['period_s'])}" if cycles else "does not oscillate"
    nights = f"{now.cycle.nights} nights since {now.cycle.since}"
    if t.source is not None:
        return f"{cycle}: follows {t.source} in most of {nights}; fix that loop first"
    also_worn = "; the valve is also worn" if t.fault in IS else ""
    texts = {
        Cause.VALVE: f": caused by the valve (from {nights})" if cycles else "",
        Cause.TUNING: f": tuned too tight (from {nights})",
        Cause.LOAD: f": external disturbance (from {nights}){also_worn}",
        Cause.UNDECIDED: f"; cause undecided: {nights} do not agree",
    }
    return cycle + texts.get(t.cause, "")


def news(before: Belief | None, now: Belief, row: Row) -> tuple[str, str]:
    """Change of a loop since the previous night, and its colour; '' if there is none."""
    if before is None or now.recorder == now.night:  # another recorder shows different sizes of the same
        return "", ""
    return _swing_news(before, now, row) or _fault_news(before, now) or ("", "")


def growing(phase: PhaseKnown, found: Growth, row: Row) -> str:
    """Text on the growing overshoot of a phase, with the repetition at which it began."""
    low, span = row["pv_lo"] or 0.0, (row["pv_hi"] or 100.0) - (row["pv_lo"] or 0.0)
    begin, end = (low + span * x / 100.0 for x in (phase.begin, phase.end))
    when = local(found.start_s, row["timezone"]).strftime("%Y-%m-%d %H:%M")
    return (
        f"overshoot of {begin:.4g} → {end:.4g} {row['pv_unit'] or ''} grows since batch {found.number} ({when}): "
        f"{found.before:.0f} → {found.now:.0f} % of the move"
    ).replace("  ", " ")


def _swing_news(before: Belief, now: Belief, row: Row) -> tuple[str, str] | None:
    """Text if a loop started or stopped to oscillate, or oscillates more or less than usual; none for a slave, whose
    error behind a moving set point may or may not be a cycle: its master reports it."""
    if row["master"]:
        return None
    changed = now.cycle.since != before.cycle.since and now.cycle.nights == 1
    after = f" since {row['settings_changed'] or 'its settings were changed'}" if changed else ""
    if now.cycle.loud and not before.cycle.loud:
        return f"began to oscillate{after}", "worse"
    if before.cycle.loud and not now.cycle.loud:
        cycles = counts(row["oscillating_pct"])
        what = f"oscillates less: {_sizes(now.last)}; it was {_sizes(before.last)}"
        return (what if cycles else "stopped oscillating") + after, "better"
    if now.cycle.shift > 0.0:
        more, tone = ("more", "worse") if now.cycle.shift > 1.0 else ("less", "better")
        return f"oscillates {more} than before: {_sizes(now.last)}", tone
    return None


def _fault_news(before: Belief, now: Belief) -> tuple[str, str] | None:
    """Text if a valve is now known to be worn, or fault-free again; if the reported cause of a cycle changed, or
    other settings are advised."""
    if now.valve.certain and not before.valve.certain:
        return f"{width_text(now)}: confirmed by {now.valve.nights} nights", "worse"
    if before.valve.certain and not now.valve.certain:
        return "no valve fault is found any more", "better"
    then, cause = before.told.cause, now.told.cause
    if then in CAUSES and cause in CAUSES and then is not cause:
        return f"the reported cause is now {cause} (was {then})", "unclear"
    pairs = before.told.pair, now.told.pair
    settled = before.remedy.settled and now.cycle.since == before.cycle.since
    if settled and None not in pairs and pairs[0] != pairs[1]:
        return "other settings are advised", "unclear"
    return None
