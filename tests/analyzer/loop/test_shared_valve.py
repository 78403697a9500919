"""Who has a valve that two controllers share, and which half of a split range works: by hand-made trends."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from analyzer.config import AdviceLimits, Config, QualityLimits
from analyzer.explain.case import as_given
from analyzer.lanes.lanes import in_lanes
from analyzer.loop import conclusion
from analyzer.loop.decisions import CAUSES, Action, Cause, Finding, Lane, Remedy, Status
from analyzer.loop.oscillation.detection import counting, detect
from analyzer.loop.record.quality import Prepared, Scale
from analyzer.loop.record.shared_valve import half, selected
from analyzer.loops.spec import LoopSpec, Output
from analyzer.loops.tags import match
from identification.models import Estimate
from identification.record import LoopRecord

N = 21_600
T = np.arange(N)
LIMITS = QualityLimits()
GOOD = np.zeros(N, dtype=bool)


def record(pv: np.ndarray, op: np.ndarray, sp: float = 50.0) -> LoopRecord:
    """A record at 1 s."""
    return LoopRecord("FIC1", 0.0, 1.0, np.full(N, sp), pv, op, GOOD)


def pair(low: bool, follows: bool) -> tuple[LoopRecord, np.ndarray, np.ndarray]:
    """A loop that has the valve for two of every three quarters of an hour, the other's output, and when it has not.

    Without the valve its PV is 8 % off, and its own output rests at the far end or a little beyond the other's.
    """
    idle = T % 2700 >= 1800
    way = 1.0 if low else -1.0
    valve = 50.0 + 3.0 * np.sin(T / 300.0)
    pv = np.where(idle, 50.0 - 8.0 * way, 50.0 + 0.2 * np.sin(T / 40.0))
    away = valve + 5.0 * way if follows else np.full(N, 100.0 if low else 0.0)
    return record(pv, np.where(idle, away, valve)), np.where(idle, valve, valve + 6.0 * way), idle


@pytest.mark.parametrize("low", [True, False])
@pytest.mark.parametrize("follows", [True, False])
def test_the_one_that_holds_its_set_point_has_the_valve(low: bool, follows: bool) -> None:
    """Of a low and of a high select the samples without the valve are told, and whether OP winds up meanwhile."""
    loop, other, idle = pair(low, follows)
    found = selected(loop, other, GOOD, LIMITS)
    assert found is not None
    assert (found.idle == idle).all()
    assert found.valve_pct == pytest.approx(100.0 * np.mean(~idle))
    assert found.winds_up_pct == (0.0 if follows else 100.0)
    assert found.changeovers_per_h == pytest.approx(2.5, abs=0.01)


def test_the_wait_for_the_valve_is_from_the_error_s_turn() -> None:
    """An error that asks for the valve 60 s before it is had is told as that."""
    loop, other, idle = pair(True, False)
    asks = np.zeros(N, dtype=bool)
    for end in np.flatnonzero(idle[:-1] & ~idle[1:]) + 1:
        asks[end - 60 : end] = True
    found = selected(replace(loop, pv=np.where(asks, 52.0, loop.pv)), other, GOOD, LIMITS)
    assert found is not None
    assert found.takeover_s == 60.0


def test_outputs_of_loops_without_a_select_share_nothing() -> None:
    """Two outputs that wander on their own, and one beside itself, are no select."""
    rng = np.random.default_rng(3)
    pv, op, other = (50.0 + np.cumsum(rng.normal(0.0, 0.1, N)) for _ in range(3))
    assert selected(record(pv, op), op, GOOD, LIMITS) is None
    alone = record(50.0 + rng.normal(0.0, 1.0, N), op)
    assert selected(alone, other, GOOD, LIMITS) is None


@pytest.mark.parametrize(("at", "opens"), [(40.0, True), (62.0, False)])
def test_a_half_begins_where_the_output_s_range_is_split(at: float, opens: bool) -> None:
    """A half that opens above, or as the output falls below, the change-over is told with it and its slope."""
    whole = at + 25.0 * np.sin(T / 500.0)
    part = 100.0 * (whole - at) / (100.0 - at) if opens else 100.0 * (at - whole) / at
    found = half(record(np.full(N, 50.0), np.clip(part, 0.0, 100.0)), whole, GOOD, LIMITS)
    assert found is not None
    assert found.split_at_pct == pytest.approx(at, abs=0.1)
    assert found.split_slope == pytest.approx(100.0 / (100.0 - at) if opens else -100.0 / at, rel=0.01)
    assert found.valve_pct == pytest.approx(100.0 * np.mean((part > 2.0) & (part < 98.0)), abs=0.1)


def test_hand_overs_are_no_cycle() -> None:
    """A valve that is handed over every half hour makes a loop's error no oscillation."""
    loop, other, _ = pair(True, False)
    assert counting(detect(loop, Config().oscillation)) is not None
    found = selected(loop, other, GOOD, LIMITS)
    assert found is not None
    quiet = replace(
        loop, pv=np.where(found.idle, loop.pv, 50.0), masks=MappingProxyType({"idle": found.idle})
    )
    assert counting(detect(quiet, Config().oscillation)) is None


def test_what_moves_pv_is_explained_by_what_the_valve_was_given() -> None:
    """An explanation is asked with the output that had the valve; of half a split range only while it works."""
    loop, other, idle = pair(True, False)
    shared = selected(loop, other, GOOD, LIMITS)
    assert shared is not None
    whole = Prepared(loop, Scale(0.0, 100.0, 0.0, 100.0, False), 0.0, 0.0, (), shared=shared)
    given = as_given(whole).record
    assert (given.op == np.minimum(loop.op, other)).all()
    assert not given.bad.any()
    part = as_given(replace(whole, shared=replace(shared, valve=None))).record
    assert (part.bad == idle).all()
    assert (part.op == loop.op).all()


def test_a_loop_that_winds_up_is_to_be_set_right() -> None:
    """A loop whose output rests at its end without the valve stands in the lane and is to be looked at."""
    known = {"winds_up_pct": 96.0, "takeover_s": 75.0, "override_with": "PIC1"}
    found = Finding(
        "FIC1", "n", Status.OK, cause=Cause.NONE, confidence=dict.fromkeys(CAUSES, 0.0), known=known
    )
    told = in_lanes(replace(found, remedy=Remedy(Action.NONE)), Config().lanes)
    assert told.lanes == (Lane.WINDUP,)
    from analyzer.words.reason import reason

    assert told.remedy.action is Action.CHECK_LIMIT
    assert "winds up while PIC1 has the valve, takes it back 75 s late" in reason(told)


def test_partners_are_found_among_loops_and_tags() -> None:
    """The other's output comes with its range, what is fed forward is a loop's PV or a tag, and what is missing is
    said."""
    specs = [
        LoopSpec("FIC1", override_with="PIC1", feedforward="FIC9"),
        LoopSpec("PIC1", op_lo=4.0, op_hi=20.0, override_with="FIC1", feedforward="weather"),
        LoopSpec("TIC1", split_of="nobody"),
    ]
    tags = ["FIC1.PV", "FIC1.OP", "PIC1.PV", "PIC1.OP", "weather", "TIC1.PV", "TIC1.OP"]
    (flow, pressure, lone), notes = match(specs, tags)
    assert flow.beside == Output("PIC1.OP", 4.0, 20.0)
    assert (pressure.feed, flow.feed, lone.beside) == ("weather", None, None)
    assert set(flow.tags) == {"FIC1.PV", "FIC1.OP", "PIC1.OP"}
    assert "TIC1: no OP of nobody in the export, judged alone" in notes
    assert "FIC1: feedforward FIC9 is neither a loop nor a tag of the export" in notes


@pytest.mark.parametrize(
    ("low", "high", "told"),
    [
        (0.8, 1.2, True),
        (-1.2, -0.8, True),
        (0.1, 2.0, False),
        (-2.0, -0.1, False),
        (-0.1, 1.0, False),
        (0.0, 1.0, False),
    ],
)
def test_an_answer_to_a_half_is_told_where_it_is_known(
    low: float, high: float, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of either sign it is told within a narrow interval, and not in a wide one or one that reaches to nothing."""
    value = 0.5 * (low + high)
    monkeypatch.setattr(
        conclusion, "intervals", lambda *_: {"slope_pct_per_s": Estimate(value, low, high, "%/(% s)")}
    )
    seen = SimpleNamespace(excited=True, linear=None)
    verdict = SimpleNamespace(measured=seen, cause=Cause.NONE)
    assert bool(conclusion._of_half(verdict, AdviceLimits())) is told
