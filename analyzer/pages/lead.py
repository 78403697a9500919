"""What a shift leader does first: at most three sentences from a night's rows, those that gain most first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.lanes.figures import lanes_in
from analyzer.loop.decisions import Action, Cause, Due, Fault, GroupRole, Lane
from analyzer.pages.cost import cost, cost_column
from analyzer.plantwide.view import GroupView
from analyzer.words.units import duration

Row = Mapping[str, Any]
MOST = 3
NAMED = 3
"""Loops that a sentence names; the rest is counted."""
CALM = "No loop needs a touch this morning."


def listed(names: Sequence[str]) -> str:
    """Names in a sentence, the first few of them."""
    shown, more = list(names[:NAMED]), len(names) - NAMED
    if more > 0:
        return ", ".join(shown) + f" and {more} more"
    return shown[0] if len(shown) == 1 else ", ".join(shown[:-1]) + " and " + shown[-1]


def first_things(rows: Sequence[Row], groups: Sequence[GroupView] = ()) -> tuple[str, ...]:
    """At most three sentences, the one that gains most first; one that says so where there is nothing to do."""
    by_loop, by = {r["loop"]: r for r in rows}, cost_column(rows)
    told: set[str] = set()
    found: list[tuple[float, str]] = []
    for group in groups:
        if group.source is None:
            continue
        source = by_loop.get(group.source["loop"])
        others = [r["loop"] for r in group.rows if r["role"] == GroupRole.FOLLOWER and r["loop"] in by_loop]
        if source is None or not others:
            continue
        members = [source["loop"], *others]
        told |= set(members)
        found.append((sum(cost(by_loop[m], by) for m in members), _of_group(source, others)))
    left = sorted((r for r in rows if r["loop"] not in told), key=lambda r: (-cost(r, by), r["loop"]))
    found += _by_work(left, by)
    found += _at_shutdown(left)
    ordered = sorted(found, key=lambda pair: -pair[0])
    return tuple(text for _, text in ordered[:MOST]) or (CALM,)


def _of_group(source: Row, others: Sequence[str]) -> str:
    name, moved = source["loop"], f"it also moves {listed(others)}"
    unasked = source["action"] is None and source["cause"] == Cause.VALVE  # of a night that got no advice
    if source["action"] == Action.REPAIR_VALVE or unasked:
        return f"Fix {name}'s valve: {moved}."
    if source["action"] == Action.RETUNE:
        return f"Type new settings into {name}: {moved}."
    if source["cause"] == Cause.LOAD:
        return f"Find what moves {name} every {duration(source['period_s'])} from outside: {moved}."
    return f"Look at {name} first: {moved}."


def _by_work(rows: Sequence[Row], by: str) -> list[tuple[float, str]]:
    """One sentence for each kind of work that several loops ask for, with what they cost by a column."""
    kinds = (
        (lambda r: r["action"] == Action.RETUNE and r["cause"] == Cause.VALVE, _retune_valve),
        (lambda r: r["action"] == Action.RETUNE and r["cause"] != Cause.VALVE, _retune_tight),
        (lambda r: r["action"] == Action.REPAIR_VALVE and r["due"] != Due.SHUTDOWN, _stroke),
        (lambda r: r["action"] == Action.CHECK_MEASUREMENT, _measurement),
        (lambda r: r["action"] == Action.CHECK_SETTINGS and _stated(r), _settings),
        (lambda r: r["action"] == Action.CHECK_SETTINGS and not _stated(r), _unstated),
        (lambda r: r["cause"] == Cause.TUNING and r["action"] == Action.NEEDS_DATA, _halve),
        (lambda r: Lane.AT_LIMIT in lanes_in(r) and r["cause"] != Cause.TUNING, _limit),
    )
    out = []
    for asks, say in kinds:
        mine = [r for r in rows if asks(r)]
        if mine:
            out.append((sum(cost(r, by) for r in mine), say(mine)))
    return out


def _at_shutdown(rows: Sequence[Row]) -> list[tuple[float, str]]:
    """One sentence, worth nothing tonight, on worn valves whose loops are calm."""
    worn = [r for r in rows if r["action"] == Action.REPAIR_VALVE and r["due"] == Due.SHUTDOWN]
    if not worn:
        return []
    its = "valve" if len(worn) == 1 else "valves"
    they = "worn, though its loop is calm" if len(worn) == 1 else "worn, though their loops are calm"
    return [(0.0, f"At the next shutdown look at the {its} of {_names(worn)}: {they}.")]


def _stated(row: Row) -> bool:
    return row["kp"] is not None and row["ti"] is not None


def _names(rows: Sequence[Row]) -> str:
    return listed([r["loop"] for r in rows])


def _retune_valve(rows: Sequence[Row]) -> str:
    it = "its valve has play" if len(rows) == 1 else "their valves have play"
    return f"Type new settings into {_names(rows)}: {it}, and new settings calm what a repair can wait for."


def _retune_tight(rows: Sequence[Row]) -> str:
    return f"Type new settings into {_names(rows)}: too tight for the process."


def _stroke(rows: Sequence[Row]) -> str:
    sticks = sum(r["valve_fault"] == Fault.STICTION for r in rows)
    kind = "sticks" if sticks == len(rows) else "has play" if sticks == 0 else "sticks or has play"
    if len(rows) == 1:
        return f"Stroke the valve of {_names(rows)}: it {kind}."
    return f"Stroke the valves of {_names(rows)}: each {kind}."


def _measurement(rows: Sequence[Row]) -> str:
    return f"Check the measurement of {_names(rows)}: frozen, or far from its set point with OP free."


def _settings(rows: Sequence[Row]) -> str:
    return f"Compare the settings of {_names(rows)} with loops.csv: the trends show others."


def _unstated(rows: Sequence[Row]) -> str:
    it = "its controller has" if len(rows) == 1 else "their controllers have"
    return f"State Kp and Ti of {_names(rows)} in loops.csv, as {it} them: new settings wait for that."


def _halve(rows: Sequence[Row]) -> str:
    it = (
        "it swings, too tight for its process"
        if len(rows) == 1
        else "they swing, too tight for their processes"
    )
    return f"Halve the gain of {_names(rows)} or go to manual: {it}; settings wait for other data."


def _limit(rows: Sequence[Row]) -> str:
    return f"See why OP of {_names(rows)} rests at its limit: valve size, or what feeds it."
