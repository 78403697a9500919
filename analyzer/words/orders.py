"""Actions: the order of a loop in three lines from its row, the same on every page and in every command, and the
sentence for several loops with one kind of work. The texts are in orders.toml."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from analyzer.columns import Row
from analyzer.lanes.lanes import lanes_in
from analyzer.loop.decisions import Action, Cause, Due, Fault, Lane
from analyzer.words import toml_of
from analyzer.words.reason import STROKE_STEPS
from analyzer.words.units import changed_settings, duration

Cases = Mapping[Action, Callable[[Row], str]]


def texts(part: str) -> dict[str, Any]:
    """A part of orders.toml."""
    found: dict[str, Any] = toml_of("analyzer.words", "orders.toml")[part]
    return found


def fault_width(row: Row) -> float | None:
    """Stickband or backlash [% of OP]; None where there is none."""
    return row["stickband_pct"] or row["backlash_pct"] or None


def stroke(row: Row) -> tuple[str, str]:
    """Steps of the stroke test of a faulty valve [%], and its response to them; '' if it does not respond."""
    width, kind = fault_width(row), texts("by_hand").get(row["valve_fault"], "")
    if width is None:
        return "5", kind.format(width="some steps")
    return f"{width / STROKE_STEPS:.2g}", kind.format(width=f"about {width:.2g} %")


def _of_valve(row: Row) -> str:
    if not stroke(row)[1]:
        return "dead valve"
    return "next shutdown" if row.get("due") == Due.SHUTDOWN else Action.REPAIR_VALVE


def _of_limit(row: Row) -> str:
    lanes = lanes_in(row)
    return "winds up" if Lane.WINDUP in lanes and Lane.AT_LIMIT not in lanes else Action.CHECK_LIMIT


def _of_lack(row: Row) -> str:
    lanes = lanes_in(row)
    if Lane.MANUAL in lanes:
        return "manual"
    if row["cause"] == Cause.TUNING:
        return "too tight"
    return "sluggish" if Lane.SLUGGISH in lanes else Action.NEEDS_DATA


CASES: Cases = {
    Action.REPAIR_VALVE: _of_valve,
    Action.CHECK_LIMIT: _of_limit,
    Action.CHECK_MEASUREMENT: lambda row: (
        "frozen" if Lane.FROZEN in lanes_in(row) else Action.CHECK_MEASUREMENT
    ),
    Action.CHECK_SETTINGS: lambda row: (
        "unstated" if None in (row["kp"], row["ti"]) else Action.CHECK_SETTINGS
    ),
    Action.NEEDS_DATA: _of_lack,
}
"""The case of an action from a row, if an action has several."""
RETUNED = {
    Cause.VALVE: "retune worn",
    Cause.NONE: "retune sluggish",
    Cause.TUNING: "retune",
    Cause.LOAD: "retune against a load",
    Cause.UNDECIDED: "retune undecided",
}
"""Kinds of work for new settings, by the cause; for others an experiment identifies the process."""


EXPECTED = {
    Cause.VALVE: "the cycle stops, as in simulation; the valve stays as it is",
    Cause.NONE: "PV returns to its set point several times faster, and OP moves more",
    Cause.LOAD: "the cycle has the same period and is smaller; its source remains",
    Cause.UNDECIDED: "the cycle is smaller, and the next night shows its cause better",
    Cause.TUNING: "the oscillation is smaller and decays sooner after a disturbance",
}
"""Effect of new settings on a loop without a predicted cycle, by the cause."""


def case_of(row: Row) -> str:
    """The case of a row's action; for some actions it depends on the row."""
    action = Action(row["action"])
    return CASES[action](row) if action in CASES else action


def _expected(row: Row) -> str:
    """The expected effect of new settings on the cycle."""
    if None not in (row.get("expected_period_s"), row.get("expected_pv_amplitude_pct")):
        swing = f"{row['expected_pv_amplitude_pct']:.2g} % of span"
        return f"a cycle of {duration(row['expected_period_s'])} and {swing}: the valve stays as it is"
    return EXPECTED.get(row["cause"], "PV responds to the set point like the model of the experiment")


def order(row: Row) -> tuple[tuple[str, str], ...]:
    """Lead and text of three lines, '' for an empty one; none for a night without advice."""
    if not row["action"]:
        return ()
    values = {name: row.get(name) or "" for name in ("loop", "advice", "reason")}
    values |= {"form": row.get("form") or "ideal", "period": duration(row.get("period_s"))}
    values |= {"source": row.get("source_loop") or "the loop that it follows"}
    values |= {"lack": texts("lacks")[row.get("lack") or ""].format(**values)}
    if row["action"] == Action.REPAIR_VALVE:
        values |= dict(zip(("step", "answer"), stroke(row), strict=True))
    if row["action"] == Action.RETUNE:
        values |= {"settings": changed_settings(row), "expected": _expected(row)}
    parts = {part: text.format(**values) for part, text in texts("orders")[case_of(row)].items()}
    return ("Do", parts["do"]), ("Look for", parts["look"] or parts.get("else", "")), ("Then", parts["after"])


def kind_of_work(row: Row) -> str:
    """The kind of work required by a row, which one sentence gives for all loops; '' for none."""
    if not row["action"]:
        return ""
    kind = (
        RETUNED.get(row["cause"], "retune by experiment") if row["action"] == Action.RETUNE else case_of(row)
    )
    return kind if kind in texts("work") else ""


def work_sentence(work: str, rows: Sequence[Row], names: str) -> str:
    """The sentence on a kind of work for some loops, listed in `names`."""
    sticks = sum(r["valve_fault"] == Fault.STICTION for r in rows)
    kinds = {len(rows): "has stiction", 0: "has backlash"}
    variants, period = texts("work")[work], duration(rows[0]["period_s"])
    text = variants["one"] if len(rows) == 1 else variants.get("several", variants["one"])
    return str(text.format(names=names, fault=kinds.get(sticks, "has stiction or backlash"), period=period))
