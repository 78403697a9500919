"""External cycles get settings that reject them better if the process is known.

If an undecided cycle rings through the loop, a first step reduces the travel.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.action import of_nights
from analyzer.loop.advice.advise import Advice
from analyzer.loop.advice.sluggish import rejecting_settings
from analyzer.loop.assess import Assessment
from analyzer.loop.decisions import Action, Cause
from analyzer.loop.record.judged_stretch import controller_of
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.night.chunk import assess_loop
from benchmarks.world.__main__ import export, spec_of
from benchmarks.world.draw import Drawn, drawn, run
from benchmarks.world.recorder import recorded
from benchmarks.world.settings import outcome

CONFIG = Config()


def made(d: Drawn, way: str, folder: Path) -> Prepared:
    """A day of a drawn loop, recorded in the given way."""
    spec = spec_of(d)
    return prepare(
        spec,
        open_export(export(folder, {d.name: recorded(run(d), way, d.seed)})).read(spec.tags),
        CONFIG.quality,
    )


def advised(d: Drawn, way: str, folder: Path) -> tuple[Assessment, Advice]:
    """Its assessment and advice."""
    return assess_loop(spec_of(d), made(d, way, folder), CONFIG)


def typed(d: Drawn, kp: float | None, ti: float | None) -> tuple[float, float]:
    """Error and travel on the true plant with new settings, divided by those with the old settings."""
    assert kp is not None
    assert ti is not None
    return outcome(d, replace(d.controller, kp=kp, ti_s=ti))[:2]


@pytest.mark.parametrize(
    ("seed", "at", "way"), [(631, 2, "plain"), (633, 6, "plain"), (637, 4, "every 10 s")]
)
def test_a_loop_that_can_reject_its_cycle_better_gets_settings(
    seed: int, at: int, way: str, tmp_path: Path
) -> None:
    """Two to eight set point moves identify a process that allows twice the gain.

    On the true plant the error falls by at least 30 %, as forecast, and the source stays the cause.
    """
    d = drawn(seed, at + 1, ("load",))[at]
    found, advice = advised(d, way, tmp_path)
    assert (found.verdict.cause, advice.action) == (Cause.LOAD, Action.RETUNE)
    error, travel = typed(d, advice.kp_new, advice.ti_new)
    spec, one = spec_of(d), made(d, way, tmp_path)
    found_settings = rejecting_settings(one.record, controller_of(spec, one), spec.type, CONFIG)
    assert found_settings is not None
    assert found_settings.change is not None
    assert found_settings.travel is not None
    assert error < 0.7
    assert 1.0 + found_settings.change == pytest.approx(error, abs=0.06)
    assert 1.0 + found_settings.travel == pytest.approx(travel, rel=0.06)
    assert "the source of the cycle remains" in advice.reason


@pytest.mark.parametrize(
    ("seed", "at", "way"), [(635, 5, "plain"), (632, 1, "every 10 s"), (631, 0, "plain")]
)
def test_an_external_cycle_gives_no_slower_settings(seed: int, at: int, way: str, tmp_path: Path) -> None:
    """A cycle that looks like the response of the process biases the model, so the loop gets no settings.

    Settings from this model would raise the error, or give a ratio of 0.95 where 0.4 is forecast.
    """
    found, advice = advised(drawn(seed, at + 1, ("load",))[at], way, tmp_path)
    assert (found.verdict.cause, advice.action) == (Cause.LOAD, Action.FIND_DISTURBANCE)


def test_without_moves_of_the_set_point_nothing_is_advised(tmp_path: Path) -> None:
    """An external cycle alone does not identify the process."""
    d = replace(drawn(631, 3, ("load",))[2], moves=0.0)
    assert advised(d, "plain", tmp_path)[1].action is Action.FIND_DISTURBANCE


@pytest.mark.parametrize(
    ("kind", "seed", "at", "way"),
    [("load", 631, 5, "plain"), ("worn-tight", 643, 4, "every 10 s"), ("backlash", 642, 2, "every 10 s")],
)
def test_an_undecided_cycle_that_the_loop_amplifies_is_reduced(
    kind: str, seed: int, at: int, way: str, tmp_path: Path
) -> None:
    """For cycles that cannot be distinguished from ringing, a first step lowers error and travel."""
    d = drawn(seed, at + 1, (kind,))[at]
    found, advice = advised(d, way, tmp_path)
    assert (found.verdict.cause, advice.action) == (Cause.UNDECIDED, Action.RETUNE)
    error, travel = typed(d, advice.kp_new, advice.ti_new)
    assert error < 0.95
    assert travel < 0.6
    assert "independently of the cause" in advice.reason


@pytest.mark.parametrize(("kind", "at"), [("stiction", 3), ("backlash", 3)])
def test_a_cycle_whose_waveform_is_not_recorded_is_left_alone(kind: str, at: int, tmp_path: Path) -> None:
    """With three to seven rows per cycle, a sticking valve looks like ringing, and the loop gets no settings.

    Slower settings would give 60 % more error.
    """
    found, advice = advised(drawn(661, at + 1, (kind,))[at], "every 30 s", tmp_path)
    assert (found.verdict.cause, advice.kp_new) == (Cause.UNDECIDED, None)


def test_nights_keep_the_step_of_an_undecided_cycle() -> None:
    """If the nights together name no cause, the step that they advised is kept; a step that one night advised is
    not.
    """
    own = Cause.UNDECIDED, Action.RETUNE, None
    assert of_nights(Cause.UNDECIDED, False, own, Action.RETUNE, Action.UNDECIDED) == (Action.RETUNE, None)
    assert of_nights(Cause.UNDECIDED, False, own, None, Action.UNDECIDED) == (Action.UNDECIDED, None)
