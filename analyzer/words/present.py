"""Rows for people: columns, cells and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.columns import BY_NAME
from analyzer.loop.cost import LOSS, cost_column, mark
from analyzer.loop.decisions import Cause
from analyzer.words.reason import in_short
from analyzer.words.units import duration, gain_unit
from reports.texts import visible

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
    special["reason"] = in_short(row["reason"] or "")[0]
    if row.get("note"):
        special["reason"] += f" [note: {row['note']}]"
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
