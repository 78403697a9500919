"""What to do about a loop in three lines, and the hand-over sheet for maintenance with the valves and their tests."""

from __future__ import annotations

from collections.abc import Mapping

from analyzer.lanes.lanes import lanes_in
from analyzer.loop.decisions import Action, Cause, Fault, Lane, Status
from analyzer.pages.reading import Night, linked
from analyzer.pages.words import Row, cell, counted, duration, heading, headings, plain_cell
from analyzer.words.reason import STEPS
from analyzer.words.units import changed_settings
from reports.pages import Cell, Column, Page, Section, Table

NEXT_NIGHT = "Look at this loop again the night after."
BY_HAND = {
    Fault.STICTION: "PV, or the stem, stands for two or three steps and then jumps by about {width:.2g} %",
    Fault.BACKLASH: "PV, or the stem, answers the turn down only after about {width:.2g} %",
}
"""What a stroke test shows of a valve at fault."""
DEAD, OUTSIDE, AT_LIMIT = "dead", "outside", "at limit"
"""Cases of an action that have an order of their own."""
ORDERS: Mapping[str, tuple[str, str, str]] = {
    Action.RETUNE: (
        "type in {settings} ({form} form), bumpless, while the loop is calm",
        "{expected}",
        "After a week, triage report STORE --loop {loop} --changed TIME --out report shows whether it helped.",
    ),
    Action.REPAIR_VALVE: (
        "in manual, with the process calm, move OP in steps of {step} %, four times up and four times down, "
        "and wait each time",
        "{answer}; then look at positioner feedback, linkage, packing and actuator",
        "Until it is repaired the loop goes on cycling; what was tried is told below.",
    ),
    DEAD: (
        "in manual, with the process calm, move OP by 5 % up and down",
        "PV, or the stem, does not answer: air supply, positioner, linkage, a closed hand valve",
        NEXT_NIGHT,
    ),
    Action.SEE_SOURCE_LOOP: (
        "leave this loop's valve and settings alone; work on {source} first",
        "both trends beneath each other: {source} leads, or both turn together",
        NEXT_NIGHT,
    ),
    Action.CHECK_SETTINGS: (
        "compare the controller's settings with loops.csv and correct what is wrong",
        "{advice}",
        "New settings, if any, come with the next night.",
    ),
    Action.CHECK_MEASUREMENT: (
        "compare PV in the historian with display and transmitter, and its range with that in loops.csv",
        "{reason}",
        "What else is said of this loop rests on its PV.",
    ),
    Action.NEEDS_DATA: (
        "give it what it lacks{lack}",
        "{advice}",
        "It is assessed as soon as a night has it.",
    ),
    OUTSIDE: (
        "nothing at this loop: what moves it comes from outside, and no loop of the night moves first",
        "what else has a period of {period}: a batch, a pump, a loop not exported",
        "Other settings would follow the load better or worse, not stop it.",
    ),
    Action.NONE: ("nothing tonight", "{advice}", ""),
    AT_LIMIT: (
        "see why OP rests at its limit: no settings bring PV to SP while it does",
        "the valve's size, a closed hand valve or bypass, pressure and temperature of what feeds it",
        NEXT_NIGHT,
    ),
    Action.UNDECIDED: (
        "put the controller in manual for some periods while the process is calm",
        "a swing that stops is the loop's own (valve or tuning); one that goes on comes from outside",
        'Note what was seen: triage note STORE {loop} "..."',
    ),
}
"""What to do, what to look for, and what comes after."""
ELSE = {
    Action.CHECK_SETTINGS: "a gain or an integral time that is not as stated",
    Action.CHECK_MEASUREMENT: "a frozen or shifted signal",
    Action.NEEDS_DATA: "{reason}",
}
"""What to look for where the night says nothing of it."""
NAME = "maintenance"
TRAVELLED = 20
"""Valves that are listed for their travel alone."""
FAULTY = (
    *headings("loop", "description", "area", "valve_fault"),
    Column("width", "Width %", True, "Play or stickband, % of OP"),
    heading("valve_travel_pct_per_h"),
    Column("test", "Test", wide=True),
    Column("found", "Found, by whom", wide=True),
)
WORN = headings("loop", "description", "area", "valve_travel_pct_per_h", "cause", "action")


def _width(row: Row) -> float | None:
    """Stickband or play [% of OP]; None where there is none."""
    return row["stickband_pct"] or row["backlash_pct"] or None


def _answer(row: Row) -> str:
    """What a valve at fault does in a stroke test; '' where it does not answer."""
    width, kind = _width(row), BY_HAND.get(row["valve_fault"], "")
    return kind.format(width=width) if width else ""


def valve_test(row: Row) -> str:
    """The stroke test of a valve at fault in a few words; its order says how it is done."""
    answer = _answer(row)
    return (
        f"steps of {_step(row)} %: {answer}" if answer else "steps of 5 %: PV, or the stem, does not answer"
    )


def _step(row: Row) -> str:
    return f"{(_width(row) or 0.0) / STEPS:.2g}"


def _case(row: Row) -> str:
    """The order that a row asks for."""
    action = Action(row["action"])
    if action is Action.REPAIR_VALVE and not _answer(row):
        return DEAD
    if action is Action.NONE and row["cause"] == Cause.LOAD:
        return OUTSIDE
    if action is Action.UNDECIDED and row["cause"] == Cause.NONE and Lane.AT_LIMIT in lanes_in(row):
        return AT_LIMIT
    return action


def _expected(row: Row) -> str:
    """What new settings make of the cycle."""
    if None not in (row["expected_period_s"], row["expected_pv_amplitude_pct"]):
        swing = f"{row['expected_pv_amplitude_pct']:.2g} % of span"
        return f"a cycle of {duration(row['expected_period_s'])} and {swing}: the valve stays as it is"
    if row["cause"] == Cause.VALVE:
        return "the cycle comes to rest, by simulation, though the valve stays as it is"
    return "the swing dies away within a few periods"


def work_order(row: Row) -> tuple[tuple[str, str], ...]:
    """Lead and text of three lines, '' where there is nothing to say; none for a night that advised nothing."""
    if not row["action"]:
        return ()
    said = {name: row.get(name) or "" for name in ("loop", "advice", "reason")}
    said |= {
        "form": row.get("form") or "ideal",
        "source": row.get("source_loop") or "the loop that it follows",
    }
    said |= {"lack": f": {row['lack']}" if row.get("lack") else "", "period": duration(row.get("period_s"))}
    if row["action"] == Action.REPAIR_VALVE:
        said |= {"answer": _answer(row), "step": _step(row)}
    if row["action"] == Action.RETUNE:
        said |= {"settings": changed_settings(row), "expected": _expected(row)}
    do, look, after = (text.format(**said) for text in ORDERS[_case(row)])
    return ("Do", do), ("Look for", look or ELSE.get(row["action"], "").format(**said)), ("Then", after)


def _cells(night: Night, row: Row) -> tuple[Cell, ...]:
    return (
        linked(night, row["loop"]),
        *(cell(row, name) for name in ("description", "area")),
        Cell("" if row["valve_fault"] in (None, Fault.NONE) else row["valve_fault"], kind="valve"),
        plain_cell(row["stickband_pct"] or row["backlash_pct"]),
        cell(row, "valve_travel_pct_per_h"),
        Cell(valve_test(row)),
        Cell(""),
    )


def faulty(night: Night) -> Table:
    """Valves at fault, those to be repaired first, then by width."""
    rows = [r for r in night.rows if r["status"] == Status.OK and r["cause"] == Cause.VALVE]
    rows.sort(key=lambda r: (r["action"] != Action.REPAIR_VALVE, -(_width(r) or 0.0)))
    note = (
        "Test: in manual, with the process calm, move OP in steps, four up and four down, and wait each time; "
        "then look at positioner feedback, linkage, packing and actuator. "
        "With new settings a loop can wait for the shutdown."
    )
    return Table("valves", "", FAULTY, tuple(_cells(night, r) for r in rows), note, cards=True)


def worn(night: Night) -> Table:
    """The valves that travel most."""
    rows = [r for r in night.rows if r["valve_travel_pct_per_h"] is not None]
    rows.sort(key=lambda r: -r["valve_travel_pct_per_h"])
    shown = rows[:TRAVELLED]
    cells = tuple((linked(night, r["loop"]), *(cell(r, c.key) for c in WORN[1:])) for r in shown)
    note = "Travel of OP, or of the stem where it is recorded; where the loop is tight, its settings wear the valve."
    return Table("travel", "", WORN, cells, note, cards=True)


def page(night: Night) -> Page:
    """The sheet of a night."""
    first, second = faulty(night), worn(night)
    sections = (
        Section(f"Valves at fault ({len(first.rows)})", (first,)),
        Section("Valves that travel most", (second,)),
    )
    subtitle = (
        f"{counted(len(first.rows), 'valve')} at fault in the night of {night.name}, for the valve shop."
    )
    return Page(NAME, "Hand-over to maintenance", subtitle, sections, (("All loops", "index.html"),))
