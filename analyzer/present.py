"""Results in words: reasons, actions, tables. The only place that chooses words."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from analyzer.columns.table import BY_NAME
from analyzer.decisions import Action, Cause, Fault, Needs, counts
from analyzer.units import duration, gain_unit

if TYPE_CHECKING:
    from analyzer.advice import Advice
    from analyzer.plantwide.verdict import Follower

CAUSE_STYLES = {
    Cause.VALVE: "red",
    Cause.TUNING: "yellow",
    Cause.LOAD: "cyan",
    Cause.UNDECIDED: "magenta",
}
"""Colours of causes on the terminal."""


SHOWN = (
    *(
        "loop",
        "oscillation_significance",
        "oscillating_pct",
        "osc_valve_pct",
        "osc_tuning_pct",
        "osc_load_pct",
    ),
    *("average_absolute_error_pct", "valve_travel_pct_per_h", "period_s", "kp", "ti", "action", "reason"),
)
"""Columns for people, in their order; new settings stand in the cells of the old ones."""
WHOLE = frozenset({"oscillating_pct", "osc_valve_pct", "osc_tuning_pct", "osc_load_pct"})
"""Shares that are shown without decimals."""
WITH_UNITS = frozenset({"period_s", "kp", "ti"})
"""Numbers that are shown with their units, and so as texts."""


def brief(row: Mapping[str, Any]) -> dict[str, str]:
    """A row for people, by column: figures in few characters, settings as old and new in one cell."""
    gain = gain_unit(row.get("gain_unit"), row.get("pv_unit"))
    special = {
        "period_s": duration(row["period_s"]),
        "kp": _settings(row["kp"], row["kp_new"], gain),
        "ti": _settings(row["ti"], row["ti_new"], row.get("ti_unit") or ""),
    }
    return {name: special[name] if name in special else figure(row[name], name) for name in SHOWN}


WORTH_LEAST = (
    *("osc_load_pct", "osc_tuning_pct", "osc_valve_pct", "valve_travel_pct_per_h", "oscillating_pct"),
    *("average_absolute_error_pct", "ti", "kp", "period_s", "oscillation_significance"),
)
"""Columns that a narrow table leaves out, the first of them first; loop, action and reason stay."""
LEAST_REASON = 24
"""Characters of a line of the reason at least."""


def fitting(shown: Sequence[Mapping[str, str]], width: int) -> tuple[str, ...]:
    """The columns that fit into so many characters with all tags whole; none without rows."""
    kept = list(SHOWN) if shown else []
    size = {name: max(map(len, (BY_NAME[name].heading, *(row[name] for row in shown)))) + 1 for name in kept}
    size |= {"reason": LEAST_REASON + 1} if shown else {}
    for name in WORTH_LEAST:
        if sum(size[n] for n in kept) + 1 > width:
            kept.remove(name)
    return tuple(kept)


def _settings(now: float | None, new: float | None, unit: str) -> str:
    """A setting and what to make of it, with its unit; empty where it is not known."""
    if now is None:
        return ""
    return f"{figure(now)} {unit}" if new is None else f"{figure(now)} -> {figure(new)} {unit}"


def _strongest(row: Mapping[str, Any], cause: Cause) -> str:
    signs = [s for s in json.loads(row.get("signs") or "[]") if s["points_to"] == cause]
    return "; ".join(s["text"] for s in sorted(signs, key=lambda s: -s["strength"])[:2])


FAULT_NAMES = {Fault.BACKLASH: "backlash", Fault.STICTION: "stick-slip"}


def _valve(row: Mapping[str, Any]) -> str:
    """What is wrong with the valve, in figures where there are any."""
    fault = FAULT_NAMES.get(row["valve_fault"], "a valve fault")
    width = row["stickband_pct"] or row["backlash_pct"]
    if not width or row["valve_size"] is None:
        return f"{fault}: {_strongest(row, Cause.VALVE)}"
    share, gain = 100 * row["valve_size"], row["evidence"]
    return f"{fault} of {width:.2g} %, {share:.0f} % of OP's range (log likelihood +{gain:.0f})"


def reason_of(row: Mapping[str, Any], needs: Needs | None = None) -> str:
    """One sentence on what was found and why."""
    oscillates = counts(row["oscillating_pct"]) and row["period_s"]
    cycle = f"cycles with {duration(row['period_s'])}" if oscillates else "does not oscillate"
    cause = Cause(row["cause"])
    if cause is Cause.VALVE:
        return f"{cycle}; {_valve(row)}"
    if cause in (Cause.TUNING, Cause.LOAD):
        return f"{cycle}; {cause}: {_strongest(row, cause)}"
    if cause is Cause.UNDECIDED:
        return f"{cycle}; cause undecided: {needs or 'the signs do not agree'}"
    return cycle


MOST_NAMES = 5
"""Followers that are named in a row."""
SAID_AT_ONCE = (Action.CHECK_SETTINGS, Action.NEEDS_DATA)
"""Actions whose reason belongs into the list."""


def advised(row: dict[str, Any], needs: Needs | None, advice: Advice) -> dict[str, Any]:
    """The row with action, new settings, advice and reason; `needs` says what a cause lacks, if anything."""
    reason = reason_of(row, needs)
    if row["oscillating_pct"] is None:
        reason = f"not assessed: {advice.reason}"
    elif advice.action in SAID_AT_ONCE:
        reason = f"{reason}; {advice.reason}"
    return {
        **row,
        "action": advice.action,
        "lack": advice.lack or row["lack"],
        "kp_new": advice.kp_new,
        "ti_new": advice.ti_new,
        "advice": advice.reason,
        **_cycles(advice),
        "reason": reason,
    }


def _cycles(advice: Advice) -> dict[str, float]:
    """Limit cycles that simulation finds at the present (predicted) and at the new (expected) settings."""
    out: dict[str, float] = {}
    for name, cycle in (("predicted", advice.before), ("expected", advice.after)):
        if cycle is not None:
            out |= {f"{name}_period_s": cycle.period_s, f"{name}_pv_amplitude_pct": cycle.pv_amplitude}
    return out


def follower_row(row: Mapping[str, Any], found: Follower) -> dict[str, Any]:
    """The row of a loop that follows another one's oscillation."""
    source = found.source
    later = f", {duration(abs(source.lag_s))} later" if source.lag_s is not None and source.lag_s > 0 else ""
    sure = f"confidence {source.confidence_pct:.0f} %, coherence {source.coherence:.2f}"
    text = f"moves with {source.loop}{later}, where the oscillation seems to start ({sure})"
    sign = {"points_to": found.cause, "strength": found.strength, "text": text}
    return {
        **row,
        **{f"osc_{cause}_pct": value for cause, value in found.confidence.items()},
        "cause": found.cause,
        "valve_fault": found.fault,
        "source_loop": source.loop,
        "action": found.action,
        "kp_new": None,
        "ti_new": None,
        "advice": f"Look at {source.loop} first.",
        "signs": json.dumps([sign, *json.loads(row["signs"] or "[]")]),
        "reason": f"cycles with {duration(row['period_s'])}; {text}",
    }


def root_row(row: Mapping[str, Any], followers: Sequence[str]) -> dict[str, Any]:
    """The row of a loop that moves others: what is known of it, and whom it moves."""
    names = ", ".join(followers[:MOST_NAMES]) + (" ..." if len(followers) > MOST_NAMES else "")
    return {**row, "reason": f"{row['reason']}; also moves {names}: fix this one first"}


def figure(value: Any, column: str = "") -> str:
    """A cell for people: three digits, empty where not known."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if column in WHOLE:
        return f"{value:.0f}"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def markdown_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows for people as a Markdown table: figures in few characters, settings with their units."""
    from reports.markdown import escaped

    names = SHOWN if rows else SHOWN[:1]
    head = "| " + " | ".join(BY_NAME[name].heading for name in names) + " |"
    rule = "|" + "|".join("---" for _ in names) + "|"
    body = ["| " + " | ".join(map(escaped, brief(row).values())) + " |" for row in rows]
    return "\n".join([head, rule, *body])
