"""Results in words: reasons, actions, tables. The only place that chooses words."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from analyzer.columns import BY_NAME
from analyzer.loop.decisions import Action, Cause, Due, Lack, Needs
from analyzer.pages.cost import LOSS, cost_column, mark
from analyzer.words.clauses import joined
from analyzer.words.reason import reason_of, to_stroke, valve_text
from analyzer.words.units import duration, gain_unit
from reports.texts import visible

if TYPE_CHECKING:
    from analyzer.loop.advice import Advice
    from analyzer.plantwide.verdict import Follower

CAUSE_STYLES: Mapping[str, str] = {
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


def shown_of(rows: Sequence[Mapping[str, Any]], figure: str | None = None) -> tuple[str, ...]:
    """The columns for people: a lane's figure in the place of the significance, the loss where there is one."""
    lead = [] if figure is None or figure in SHOWN else [figure]
    lead += [LOSS] if cost_column(rows) == LOSS else []
    shares = ("osc_valve_pct", "osc_tuning_pct", "osc_load_pct")
    rest = [name for name in SHOWN[1:] if figure in (None, *SHOWN) or name not in shares]
    return (SHOWN[0], *lead, *rest)


def brief(row: Mapping[str, Any], columns: Sequence[str] = SHOWN) -> dict[str, str]:
    """A row for people, by column: figures in few characters, settings as old and new in one cell."""
    gain = gain_unit(row.get("gain_unit"), row.get("pv_unit"), row.get("op_unit"))
    special = {
        "period_s": duration(row["period_s"]),
        "kp": _settings(row["kp"], row["kp_new"], gain),
        "ti": _settings(row["ti"], row["ti_new"], row.get("ti_unit") or "s", "none"),
    }
    if row.get("note"):
        special["reason"] = f"{row['reason'] or ''} [note: {row['note']}]"
    return {
        name: visible(special.get(name, "") or figure(row[name], name) + mark(row, name)) for name in columns
    }


WORTH_LEAST = (
    *("osc_load_pct", "osc_tuning_pct", "osc_valve_pct", "valve_travel_pct_per_h", "oscillating_pct"),
    *("average_absolute_error_pct", "ti", "kp", "period_s", "loss", "oscillation_significance"),
)
"""Columns that a narrow table leaves out, the first of them first; loop, action and reason stay."""
LEAST_REASON = 44
"""Characters of a line of the reason at least."""


def fitting(shown: Sequence[Mapping[str, str]], width: int) -> tuple[str, ...]:
    """The columns that fit into so many characters with all tags whole; none without rows."""
    kept = list(shown[0]) if shown else []
    size = {name: max(map(len, (BY_NAME[name].heading, *(row[name] for row in shown)))) + 1 for name in kept}
    size |= {"reason": LEAST_REASON + 1} if shown else {}
    for name in WORTH_LEAST:
        if name in kept and sum(size[n] for n in kept) + 1 > width:
            kept.remove(name)
    return tuple(kept)


def _settings(now: float | None, new: float | None, unit: str, off: str = "0") -> str:
    """A setting and what to make of it, with its unit; empty where it is not known, `off` where it is 0."""
    if now is None:
        return ""
    present = figure(now) if now else off
    if new is not None:
        return f"{present} -> {figure(new)} {unit}"
    return f"{present} {unit}" if now else off


CALMED = (
    "The last change of settings took most of the cycle away; what is left is small beside what nights differ by, so "
    "no further settings are advised. The valve is still worn: at the next shutdown."
)
MOST_NAMES = 5
"""Followers that are named in a row."""
SAID_AT_ONCE = (Action.CHECK_SETTINGS, Action.NEEDS_DATA)
"""Actions whose reason belongs into the list."""


def advised(row: dict[str, Any], needs: Needs | None, advice: Advice) -> dict[str, Any]:
    """The row with action, new settings, advice and reason; `needs` says what a cause lacks, if anything."""
    reason = reason_of(row, needs)
    if row["oscillating_pct"] is None:
        reason = f"not assessed: {advice.reason}"
    elif (advice.action in SAID_AT_ONCE or advice.lack is Lack.OP_RANGE) and advice.reason not in (
        str(needs),
        "",
    ):
        reason = joined(reason, advice.reason)
    done = {
        **row,
        "action": advice.action,
        "lack": advice.lack or row["lack"],
        "due": advice.due if advice.action is Action.REPAIR_VALVE else None,
        "kp_new": advice.kp_new,
        "ti_new": advice.ti_new,
        "advice": advice.reason,
        **_cycles(advice),
    }
    return {**done, "reason": reason + to_stroke(done)}


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
    later = f" {duration(abs(source.lag_s))} later" if source.lag_s is not None and source.lag_s > 0 else ""
    text = f"moves with {source.loop}{later}, where the oscillation seems to start (coherence {source.coherence:.2f})"
    sure = f"fix that loop first (it starts there with {source.confidence_pct:.0f} %)"
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
        "reason": f"cycles every {duration(row['period_s'])}: follows {source.loop}{later}; {sure}",
    }


def calmed_row(row: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """The row of a loop whose worn valve makes far less of a cycle since its settings were changed; `before`, its row
    of the last night under other settings."""
    share = 100 * row["oscillation_significance"] / before["oscillation_significance"]
    slower = "slower and " if (row["period_s"] or 0.0) > (before["period_s"] or 0.0) else ""
    then = f"every {duration(before['period_s'])} until {before['night']}"
    cycle = f"{duration(row['period_s'])}, {slower}{share:.0f} % as much as before its settings were changed ({then})"
    done = {**row, "action": Action.REPAIR_VALVE, "due": Due.SHUTDOWN, "kp_new": None, "ti_new": None}
    done |= {"lack": None, "advice": CALMED}
    return {**done, "reason": f"cycles every {cycle}: {valve_text(row)}{to_stroke(done)}"}


def root_row(row: Mapping[str, Any], followers: Sequence[str]) -> dict[str, Any]:
    """The row of a loop that moves others: what is known of it, and whom it moves."""
    names = ", ".join(followers[:MOST_NAMES]) + (" ..." if len(followers) > MOST_NAMES else "")
    return {**row, "reason": joined(row["reason"], f"it also moves {names}: fix this one first")}


def figure(value: Any, column: str = "") -> str:
    """A cell for people: three digits, empty where not known."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if column in WHOLE:
        return f"{value:.0f}"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def markdown_table(rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = SHOWN) -> str:
    """Rows for people as a Markdown table: figures in few characters, settings with their units."""
    from reports.markdown import escaped

    names = columns if rows else columns[:1]
    head = "| " + " | ".join(BY_NAME[name].heading for name in names) + " |"
    rule = "|" + "|".join("---" for _ in names) + "|"
    body = ["| " + " | ".join(map(escaped, brief(row, names).values())) + " |" for row in rows]
    return "\n".join([head, rule, *body])
