"""Coupled loops: the slave is repaired first, and no master gets a valve fault, because it has no valve."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from analyzer.config import Config
from analyzer.loop.decisions import (
    CAUSES,
    Action,
    Cause,
    Due,
    Fault,
    Finding,
    GroupRole,
    OscillationFigures,
    Remedy,
    SignKind,
    SourceLoop,
    Status,
)
from analyzer.plantwide.cascade import linked, reassign_sources
from analyzer.plantwide.night import following
from analyzer.plantwide.structure import Link, Tie
from analyzer.words.reason import reason

LIMITS = Config().plant
LINKS = {"FIC1": Link("TIC1", Tie.MASTER, 0.98)}


def found(
    loop: str, cause: Cause, period_s: float | None, action: Action = Action.NONE, **known: Any
) -> Finding:
    """A loop with a cause; it oscillates if it has a period."""
    swing = OscillationFigures() if period_s is None else OscillationFigures(20.0, 90.0, period_s, 2.0)
    pct = {c: 90.0 if c is cause else 5.0 for c in CAUSES}
    fault = Fault.STICTION if cause is Cause.VALVE else Fault.NONE
    remedy = Remedy(action, kp_new=1.0, ti_new=10.0) if action is Action.RETUNE else Remedy(action)
    return Finding(
        loop, "2026-03-02", Status.OK, swing=swing, cause=cause, fault=fault, confidence=pct, remedy=remedy,
        known=known,
    )  # fmt: skip


def night(master: Finding, slave: Finding, links: dict[str, Link] = LINKS) -> tuple[Finding, Finding]:
    """Both loops after the pass over links."""
    done = linked({master.loop: master, slave.loop: slave}, links, LIMITS)
    return done[master.loop], done[slave.loop]


def test_a_master_that_a_sticking_slave_moves_follows_it() -> None:
    """The valve fault is reported at the slave, and the master follows the slave without settings of its own."""
    slave = found("FIC1", Cause.VALVE, 400.0, Action.REPAIR_VALVE)
    master, below = night(found("TIC1", Cause.TUNING, 360.0, Action.RETUNE), slave)
    assert master.follows is not None
    assert master.follows.loop == "FIC1"
    assert (master.cause, master.remedy.action, master.remedy.kp_new) == (
        Cause.LOAD,
        Action.SEE_SOURCE_LOOP,
        None,
    )
    assert (below.cause, below.moves) == (Cause.VALVE, ("TIC1",))
    assert "follows FIC1" in reason(master)


def test_no_master_gets_a_valve_fault() -> None:
    """A valve fault of a master is attributed to its slave, also if the slave shows nothing."""
    master, below = night(found("TIC1", Cause.VALVE, 360.0), found("FIC1", Cause.NONE, None))
    assert (master.cause, master.fault, master.remedy.action) == (
        Cause.LOAD,
        Fault.NONE,
        Action.SEE_SOURCE_LOOP,
    )
    assert below.cause is Cause.NONE


def test_a_slave_that_its_tight_master_moves_follows_it() -> None:
    """A slave whose error oscillates at a third of its master's period follows the master; with another period it
    does not.
    """
    tight = found("TIC1", Cause.TUNING, 240.0, Action.RETUNE)
    master, below = night(tight, found("FIC1", Cause.UNDECIDED, 80.0, Action.UNDECIDED))
    assert (below.cause, below.remedy.action) == (Cause.LOAD, Action.SEE_SOURCE_LOOP)
    assert (master.cause, master.remedy.action, master.moves) == (Cause.TUNING, Action.RETUNE, ("FIC1",))
    _, apart = night(tight, found("FIC1", Cause.UNDECIDED, 17.0, Action.UNDECIDED))
    assert apart.follows is None


def test_a_repair_of_a_slave_does_not_wait_while_its_master_oscillates() -> None:
    """A slave whose own error is no cycle gets its repair now if its master oscillates because of the valve."""
    waits = replace(
        found("FIC1", Cause.VALVE, None, Action.REPAIR_VALVE),
        remedy=Remedy(Action.REPAIR_VALVE, "its repair can wait", due=Due.SHUTDOWN),
    )
    master, slave = night(found("TIC1", Cause.VALVE, 240.0, Action.RETUNE), waits)
    assert master.remedy.action is Action.SEE_SOURCE_LOOP
    assert (slave.remedy.action, slave.remedy.due, slave.moves) == (Action.REPAIR_VALVE, Due.NOW, ("TIC1",))
    assert reason(slave).startswith("moves with TIC1")


def test_a_master_gets_no_settings_while_its_slave_has_a_fault() -> None:
    """Oscillations of different periods belong to each loop, but the master gets no settings before the slave is
    repaired.
    """
    slave = found("FIC1", Cause.VALVE, 60.0, Action.REPAIR_VALVE)
    master, _ = night(found("TIC1", Cause.TUNING, 1000.0, Action.RETUNE), slave)
    assert (master.follows, master.cause, master.remedy.action) == (None, Cause.TUNING, Action.NEEDS_DATA)
    assert "FIC1" in master.remedy.text


def test_what_loops_csv_states_is_kept() -> None:
    """A stated master is kept, and a master that the trends show is reported if none is stated."""
    master, stated = night(found("TIC1", Cause.NONE, None), found("FIC1", Cause.NONE, None, master="X"))
    assert (stated.text("master"), stated.text("ratio_of")) == ("X", "")
    _, shown = night(master, found("FIC1", Cause.NONE, None))
    assert (shown.text("master"), shown.number("link_agreement")) == ("TIC1", 0.98)


def test_a_loop_that_follows_a_third_one_is_left_as_it_is() -> None:
    """A link that the plant-wide pass has found stays unchanged in a second pass."""
    loops = {"TIC1": found("TIC1", Cause.TUNING, 300.0), "FIC1": found("FIC1", Cause.NONE, 300.0)}
    once = linked(loops, LINKS, LIMITS)
    assert linked(once, LINKS, LIMITS) == once


def test_followers_of_a_master_follow_its_slave_if_the_slave_is_the_root() -> None:
    """A group has one root: loops that followed the master follow its slave, also in the rows of the group."""
    root = SourceLoop("TIC1", 0.9, 30.0, 80.0)
    third = following(
        found("PIC7", Cause.LOAD, 360.0),
        root,
        OscillationFigures(),
        (SignKind.FOLLOWS, ()),
        LIMITS,
    )
    master = replace(found("TIC1", Cause.TUNING, 360.0, Action.RETUNE), moves=("PIC7",))
    slave = found("FIC1", Cause.VALVE, 360.0, Action.REPAIR_VALVE)
    done = linked({f.loop: f for f in (master, slave, third)}, LINKS, LIMITS)
    assert [done[k].follows and done[k].follows.loop for k in ("TIC1", "PIC7")] == ["FIC1", "FIC1"]
    assert (done["FIC1"].moves, done["TIC1"].moves) == (("PIC7", "TIC1"), ())
    roles = {"TIC1": GroupRole.SOURCE, "FIC1": GroupRole.CANDIDATE, "PIC7": GroupRole.FOLLOWER}
    rows = [{"loop": k, "group": "1", "role": r, "source_pct": 9.0 * (k == "TIC1")} for k, r in roles.items()]
    roles_found = {r["loop"]: (r["role"], r["source_pct"]) for r in reassign_sources(rows, done)}
    assert roles_found["FIC1"] == (GroupRole.SOURCE, 9.0)
    assert (roles_found["TIC1"][0], roles_found["PIC7"][0]) == (GroupRole.FOLLOWER, GroupRole.FOLLOWER)


def test_a_source_of_one_group_that_follows_in_another_stays_a_source() -> None:
    """Only a master loses its role as source, and only to its own slave."""
    root = SourceLoop("PIC9", 0.9, None, 80.0)
    leads = following(
        found("FIC2", Cause.LOAD, 360.0),
        root,
        OscillationFigures(),
        (SignKind.FOLLOWS, ()),
        LIMITS,
    )
    rows = [{"loop": "FIC2", "group": "1", "role": GroupRole.SOURCE, "source_pct": 90.0}]
    assert reassign_sources(rows, {"FIC2": leads, "PIC9": found("PIC9", Cause.VALVE, 360.0)}) == rows
