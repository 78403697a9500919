"""Which of two controllers has a shared valve, and which half of a split range is active, with trends made by
hand.
"""

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
    """A loop that has the valve for two thirds of the time, the output of the other loop, and the mask without the
    valve.

    Without the valve its PV is 8 % off, and its output is at the far limit or slightly beyond the other output.
    """
    idle = T % 2700 >= 1800
    way = 1.0 if low else -1.0
    valve = 50.0 + 3.0 * np.sin(T / 300.0)
    pv = np.where(idle, 50.0 - 8.0 * way, 50.0 + 0.2 * np.sin(T / 40.0))
    away = valve + 5.0 * way if follows else np.full(N, 100.0 if low else 0.0)
    return record(pv, np.where(idle, away, valve)), np.where(idle, valve, valve + 6.0 * way), idle


@pytest.mark.parametrize("low", [True, False])
@pytest.mark.parametrize("follows", [True, False])
def test_the_loop_at_its_set_point_has_the_valve(low: bool, follows: bool) -> None:
    """For a low and a high select, the samples without the valve are found, and whether OP winds up during them."""
    loop, other, idle = pair(low, follows)
    found = selected(loop, other, GOOD, LIMITS)
    assert found is not None
    assert (found.idle == idle).all()
    assert found.valve_pct == pytest.approx(100.0 * np.mean(~idle))
    assert found.winds_up_pct == (0.0 if follows else 100.0)
    assert found.changeovers_per_h == pytest.approx(2.5, abs=0.01)


def test_the_wait_for_the_valve_begins_with_the_change_of_the_error() -> None:
    """If the error needs the valve 60 s before the loop gets it, this time is reported."""
    loop, other, idle = pair(True, False)
    needs_valve = np.zeros(N, dtype=bool)
    for end in np.flatnonzero(idle[:-1] & ~idle[1:]) + 1:
        needs_valve[end - 60 : end] = True
    found = selected(replace(loop, pv=np.where(needs_valve, 52.0, loop.pv)), other, GOOD, LIMITS)
    assert found is not None
    assert found.takeover_s == 60.0


def test_outputs_of_loops_without_a_select_share_no_valve() -> None:
    """Two outputs that drift independently are no select, and neither is an output with itself."""
    rng = np.random.default_rng(3)
    pv, op, other = (50.0 + np.cumsum(rng.normal(0.0, 0.1, N)) for _ in range(3))
    assert selected(record(pv, op), op, GOOD, LIMITS) is None
    alone = record(50.0 + rng.normal(0.0, 1.0, N), op)
    assert selected(alone, other, GOOD, LIMITS) is None


@pytest.mark.parametrize(("at", "opens"), [(40.0, True), (62.0, False)])
def test_a_half_begins_where_the_output_s_range_is_split(at: float, opens: bool) -> None:
    """For a half that opens above the split, or as the output falls below it, the split point and the slope are
    found.
    """
    whole = at + 25.0 * np.sin(T / 500.0)
    part = 100.0 * (whole - at) / (100.0 - at) if opens else 100.0 * (at - whole) / at
    found = half(record(np.full(N, 50.0), np.clip(part, 0.0, 100.0)), whole, GOOD, LIMITS)
    assert found is not None
    assert found.split_at_pct == pytest.approx(at, abs=0.1)
    assert found.split_slope == pytest.approx(100.0 / (100.0 - at) if opens else -100.0 / at, rel=0.01)
    assert found.valve_pct == pytest.approx(100.0 * np.mean((part > 2.0) & (part < 98.0)), abs=0.1)


def test_change_overs_are_no_cycle() -> None:
    """Without the change-overs of a shared valve every 45 minutes, the error of the loop is no oscillation."""
    loop, other, _ = pair(True, False)
    assert counting(detect(loop, Config().oscillation)) is not None
    found = selected(loop, other, GOOD, LIMITS)
    assert found is not None
    quiet = replace(
        loop, pv=np.where(found.idle, loop.pv, 50.0), masks=MappingProxyType({"idle": found.idle})
    )
    assert counting(detect(quiet, Config().oscillation)) is None


def test_an_explanation_uses_the_output_that_had_the_valve() -> None:
    """An explanation uses the output that had the valve; for half of a split range it uses only its active time."""
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


def test_a_loop_that_winds_up_is_to_be_checked() -> None:
    """A loop whose output winds up at its limit without the valve is in the lane and is to be checked."""
    known = {"winds_up_pct": 96.0, "takeover_s": 75.0, "override_with": "PIC1"}
    found = Finding(
        "FIC1", "n", Status.OK, cause=Cause.NONE, confidence=dict.fromkeys(CAUSES, 0.0), known=known
    )
    reported = in_lanes(replace(found, remedy=Remedy(Action.NONE)), Config().lanes)
    assert reported.lanes == (Lane.WINDUP,)
    from analyzer.words.reason import reason

    assert reported.remedy.action is Action.CHECK_LIMIT
    assert "winds up while PIC1 has the valve, takes it back 75 s late" in reason(reported)


def test_partners_are_found_among_loops_and_tags() -> None:
    """The output of the partner loop has its range, a feedforward is a loop's PV or a tag, and missing ones are
    reported.
    """
    specs = [
        LoopSpec("FIC1", override_with="PIC1", feedforward="FIC9"),
        LoopSpec("PIC1", op_lo=4.0, op_hi=20.0, override_with="FIC1", feedforward="weather"),
        LoopSpec("TIC1", split_of="nobody"),
    ]
    tags = ["FIC1.PV", "FIC1.OP", "PIC1.PV", "PIC1.OP", "weather", "TIC1.PV", "TIC1.OP"]
    (flow, pressure, lone), notes = match(specs, tags)
    assert flow.partner_output == Output("PIC1.OP", 4.0, 20.0)
    assert (pressure.feed, flow.feed, lone.partner_output) == ("weather", None, None)
    assert set(flow.tags) == {"FIC1.PV", "FIC1.OP", "PIC1.OP"}
    assert "TIC1: no OP of nobody in the export, judged alone" in notes
    assert "FIC1: feedforward FIC9 is neither a loop nor a tag of the export" in notes


@pytest.mark.parametrize(
    ("low", "high", "reported"),
    [
        (0.8, 1.2, True),
        (-1.2, -0.8, True),
        (0.1, 2.0, False),
        (-2.0, -0.1, False),
        (-0.1, 1.0, False),
        (0.0, 1.0, False),
    ],
)
def test_a_response_to_a_half_is_reported_if_it_is_known(
    low: float, high: float, reported: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With either sign, the response to a half is reported if its interval is narrow, and not if it is wide or
    includes zero.
    """
    value = 0.5 * (low + high)
    monkeypatch.setattr(
        conclusion, "intervals", lambda *_: {"slope_pct_per_s": Estimate(value, low, high, "%/(% s)")}
    )
    seen = SimpleNamespace(excited=True, linear=None)
    verdict = SimpleNamespace(measured=seen, cause=Cause.NONE)
    assert bool(conclusion._of_half(verdict, AdviceLimits())) is reported
