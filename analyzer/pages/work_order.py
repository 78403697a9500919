"""What to do about a loop in three lines: the work, what to look for, and what comes after."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from analyzer.lanes.figures import lanes_in
from analyzer.loop.decisions import Action, Cause, Fault, Lane
from analyzer.words.reason import STEPS
from analyzer.words.units import changed_settings, duration

Row = Mapping[str, Any]
Lines = tuple[tuple[str, str], ...]
PROVE = (
    "After a week, triage report {store} --loop {loop} --changed TIME --out report shows whether it helped."
)
NEXT_NIGHT = "Look at this loop again the night after."
STROKE = (
    "in manual, with the process calm, move OP in steps of {step:.2g} %, four times up and four times down, and wait "
    "each time"
)
BY_HAND = {
    Fault.STICTION: "PV, or the stem, stands for two or three steps and then jumps by about {width:.2g} %",
    Fault.BACKLASH: "PV, or the stem, answers the turn down only after about {width:.2g} %",
}
WEAR = "; then look at positioner feedback, linkage, packing and actuator"


def _order(do: str, look: str, after: str) -> Lines:
    return (("Do", do), ("Look for", look), ("Then", after))


def _expected(row: Row) -> str:
    if None not in (row["expected_period_s"], row["expected_pv_amplitude_pct"]):
        swing = f"{row['expected_pv_amplitude_pct']:.2g} % of span"
        return f"a cycle of {duration(row['expected_period_s'])} and {swing}: the valve stays as it is"
    if row["cause"] == Cause.VALVE:
        return "the cycle comes to rest, by simulation, though the valve stays as it is"
    return "the swing dies away within a few periods"


def _retune(row: Row) -> Lines:
    form = row["form"] or "ideal"
    do = f"type in {changed_settings(row)} ({form} form), bumpless, while the loop is calm"
    return _order(do, _expected(row), PROVE.format(store="STORE", loop=row["loop"]))


def _valve(row: Row) -> Lines:
    width = row["stickband_pct"] or row["backlash_pct"]
    kind = BY_HAND.get(row["valve_fault"])
    if not width or kind is None:
        do = "in manual, with the process calm, move OP by 5 % up and down"
        look = "PV, or the stem, does not answer: air supply, positioner, linkage, a closed hand valve"
        return _order(do, look, NEXT_NIGHT)
    after = "Until it is repaired the loop goes on cycling; what was tried is told below."
    return _order(STROKE.format(step=width / STEPS), kind.format(width=width) + WEAR, after)


def valve_test(row: Row) -> str:
    """The stroke test of a valve at fault in a few words; STROKE says how it is done."""
    width, kind = row["stickband_pct"] or row["backlash_pct"], BY_HAND.get(row["valve_fault"])
    if not width or kind is None:
        return "steps of 5 %: PV, or the stem, does not answer"
    return f"steps of {width / STEPS:.2g} %: {kind.format(width=width)}"


def _source(row: Row) -> Lines:
    source = row["source_loop"] or "the loop that it follows"
    do = f"leave this loop's valve and settings alone; work on {source} first"
    return _order(do, f"both trends beneath each other: {source} leads, or both turn together", NEXT_NIGHT)


def _settings(row: Row) -> Lines:
    do = "compare the controller's settings with loops.csv and correct what is wrong"
    look = row["advice"] or "a gain or an integral time that is not as stated"
    return _order(do, look, "New settings, if any, come with the next night.")


def _measurement(row: Row) -> Lines:
    do = "compare PV in the historian with display and transmitter, and its range with that in loops.csv"
    look = row["reason"] or "a frozen or shifted signal"
    return _order(do, look, "What else is said of this loop rests on its PV.")


def _data(row: Row) -> Lines:
    do = "give it what it lacks" + (f": {row['lack']}" if row["lack"] else "")
    return _order(do, row["advice"] or row["reason"] or "", "It is assessed as soon as a night has it.")


def _none(row: Row) -> Lines:
    if row["cause"] == Cause.LOAD:
        do = "nothing at this loop: what moves it comes from outside, and no loop of the night moves first"
        look = f"what else has a period of {duration(row['period_s'])}: a batch, a pump, a loop not exported"
        return _order(do, look, "Other settings would follow the load better or worse, not stop it.")
    return (("Do", "nothing tonight"), ("Look for", row["advice"] or ""))


def _undecided(row: Row) -> Lines:
    if row["cause"] == Cause.NONE and Lane.AT_LIMIT in lanes_in(row):
        do = "see why OP rests at its limit: no settings bring PV to SP while it does"
        look = "the valve's size, a closed hand valve or bypass, pressure and temperature of what feeds it"
        return _order(do, look, NEXT_NIGHT)
    do = "put the controller in manual for some periods while the process is calm"
    look = "a swing that stops is the loop's own (valve or tuning); one that goes on comes from outside"
    return _order(do, look, f'Note what was seen: triage note STORE {row["loop"]} "..."')


BY_ACTION: Mapping[Action, Callable[[Row], Lines]] = {
    Action.RETUNE: _retune,
    Action.REPAIR_VALVE: _valve,
    Action.SEE_SOURCE_LOOP: _source,
    Action.CHECK_SETTINGS: _settings,
    Action.CHECK_MEASUREMENT: _measurement,
    Action.NEEDS_DATA: _data,
    Action.NONE: _none,
    Action.UNDECIDED: _undecided,
}


def work_order(row: Row) -> Lines:
    """Lead and text of up to three lines; none for a night on which nothing was advised."""
    return BY_ACTION[Action(row["action"])](row) if row["action"] else ()
