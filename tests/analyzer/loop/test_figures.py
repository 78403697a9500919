"""Figures of a loop agree with simple sums over the samples."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from analyzer.loop.assess import assess, unassessable
from analyzer.loop.decisions import MissingData
from analyzer.loop.oscillation.detection import detect
from analyzer.loop.oscillation.figures import (
    HOUR_S,
    assess_span,
    crossings_of,
    hour_edges,
    hourly,
    noise_band,
    travel_of,
)
from analyzer.loop.record.quality import Prepared, Scale
from identification.record import LoopRecord
from proofs.plant import CONFIG, START_S, record

FIGURES = CONFIG.figures
N = 9000
T = np.arange(N)


def noise(seed: int) -> np.ndarray:
    """White noise of unit variance, shape (N,)."""
    return np.random.default_rng(seed).standard_normal(N)


def night(seed: int = 1, dt_s: float = 1.0) -> LoopRecord:
    """A loop with gaps, a stretch in manual, OP at a limit and a moving set point."""
    sp = 50 + 4.0 * (T > 4000)
    pv = sp + 3 * np.sin(T / 70) + noise(seed)
    op = np.clip(60 + 45 * np.sin(T / 500) + 0.05 * noise(seed + 1), 0, 100)
    rng = np.random.default_rng(seed + 2)
    gap = np.repeat(rng.random(N // 100) < 0.1, 100)
    manual = (T >= 6000) & (T < 6900)
    made = record(np.where(gap, pv[0], pv), sp, op, dt_s)
    return replace(made, bad=gap, masks={"gap": gap, "manual": manual, "saturated": (op <= 2) | (op >= 98)})


# Slow reference implementations: one sample after the other


def slow_figures(r: LoopRecord) -> dict[str, float]:
    """The figures that are sums over samples; each sample is weighted by its interval."""
    weight = error = square = total = limited = served = automatic = good = 0.0
    manual, limit = r.mask("manual"), r.mask("saturated")
    for k in range(len(r)):
        if r.bad[k]:
            continue
        good += r.dt_s
        if manual[k]:
            continue
        e = r.sp[k] - r.pv[k]
        weight += r.dt_s
        total += e * r.dt_s
        square += e * e * r.dt_s
        error += abs(e) * r.dt_s
        limited += r.dt_s * limit[k]
        served += r.dt_s * (not limit[k] and abs(e) < 5)
        automatic += r.dt_s
    return {
        "usable_h": weight / 3600,
        "average_absolute_error_pct": error / weight,
        "variability_pct": 2 * math.sqrt(square / weight - (total / weight) ** 2),
        "at_limits_pct": 100 * limited / weight,
        "normal_pct": 100 * automatic / good,
        "service_pct": 100 * served / good,
    }


def slow_travel(signal: list[float], deadband: float) -> tuple[float, int]:
    """Travel and reversals of a pointer that the signal pushes at the two edges of its deadband."""
    pointer, path, turns, way = signal[0], 0.0, 0, 0
    for x in signal:
        move = 0.0
        if x - pointer > deadband / 2:
            move = x - deadband / 2 - pointer
        elif pointer - x > deadband / 2:
            move = x + deadband / 2 - pointer
        if abs(move) > 1e-9:
            now = 1 if move > 0 else -1
            turns += way not in (0, now)
            way, pointer, path = now, pointer + move, path + abs(move)
    return path, turns


def slow_crossings(error: list[float], band: float) -> int:
    """The number of times that an error exceeds the band on the other side than last time."""
    last, count = 0, 0
    for e in error:
        if abs(e) > band:
            side = 1 if e > 0 else -1
            count += last not in (0, side)
            last = side
    return count


@pytest.mark.parametrize("seed", [1, 11, 21])
@pytest.mark.parametrize("dt_s", [1.0, 5.0])
def test_figures_agree_with_slow_reference(seed, dt_s):
    """Error, variability and shares of time equal those of a simple sum over the good samples in automatic."""
    r = night(seed, dt_s)
    found = assess_span(r, FIGURES).as_row()
    for name, expected in slow_figures(r).items():
        assert found[name] == pytest.approx(expected, rel=1e-9), name


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0, 100), min_size=2, max_size=80), st.floats(0.01, 5))
@example([1.0, 0.0, 0.11365059655144008], 0.11365059655144008)
def test_travel_agrees_with_slow_reference(signal, deadband):
    """Travel and reversals beyond a deadband equal those of a pointer that the signal pushes."""
    x = np.array(signal)
    path, turns = travel_of(x, np.ones(x.size, dtype=bool), 1, deadband)
    slow_path, slow_turns = slow_travel(signal, deadband)
    assert path == pytest.approx(slow_path, abs=1e-9)
    assert turns == slow_turns


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-5, 5), min_size=1, max_size=80), st.floats(0, 3))
def test_crossings_agree_with_slow_reference(error, band):
    """Crossings are changes of side beyond the band."""
    assert crossings_of(np.array(error), np.ones(len(error), dtype=bool), band) == slow_crossings(error, band)


def test_travel_of_a_night_is_on_its_grid():
    """Travel per hour equals the travel of each tenth second's OP beyond the deadband, divided by the hours."""
    r = record(50 + noise(3), op=50 + 5 * np.sin(T / 90) + 0.3 * noise(4))
    path, turns = slow_travel(list(r.op[:: int(FIGURES.travel_grid_s)]), FIGURES.travel_deadband_pct)
    found = assess_span(r, FIGURES)
    assert found.valve_travel_pct_per_h == pytest.approx(path / (N / 3600))
    assert found.reversals_per_h == pytest.approx(turns / (N / 3600))


# Closed forms


def test_figures_of_a_sine_have_closed_forms():
    """An error A sin has mean absolute value 2A/pi, variability sqrt(2) A and two crossings a period."""
    period, size = 90.0, 3.0
    found = assess_span(record(50 + size * np.sin(2 * np.pi * T / period)), FIGURES, noise=0.0)
    assert found.average_absolute_error_pct == pytest.approx(2 * size / np.pi, rel=1e-3)
    assert found.variability_pct == pytest.approx(math.sqrt(2) * size, rel=1e-6)
    assert found.crossings_per_h == pytest.approx(2 * 3600 / period, rel=0.01)


def test_travel_of_a_sine_has_a_closed_form():
    """OP of amplitude A travels 4A minus two deadbands a period, within the error of the grid."""
    period = 900.0
    found = assess_span(record(50 + noise(5), op=50 + 10 * np.sin(2 * np.pi * T / period)), FIGURES)
    expected = (40 - 2 * FIGURES.travel_deadband_pct) * 3600 / period
    assert found.valve_travel_pct_per_h == pytest.approx(expected, rel=0.01)
    assert found.reversals_per_h == pytest.approx(2 * 3600 / period, rel=0.06)


def test_noise_band_is_the_deviation_of_white_noise():
    """The noise band of white noise is its standard deviation, with any slow motion below it."""
    slow = 20 * np.sin(T / 900)
    assert noise_band(slow + 0.7 * noise(6)) == pytest.approx(0.7, rel=0.03)


def test_travel_of_the_position_where_it_is_recorded():
    """If the position of the stem is recorded, the travel is that of the stem and not of OP."""
    r = record(50 + noise(7), op=50 + 5 * np.sin(T / 90))
    assert assess_span(replace(r, position=np.full(N, 50.0)), FIGURES).valve_travel_pct_per_h == 0.0
    assert assess_span(r, FIGURES).valve_travel_pct_per_h > 50


def test_set_point_moves_count_at_any_minute():
    """A set point that moves by 2 % on each hour, or in the middle of each hour, has the same travel of 2 %/h."""
    t = np.arange(0, 6 * 3600, 10)
    for minute in (0, 30):
        sp = 50 + 2.0 * (((t + 60 * minute) // 3600) % 2)
        made = record(sp, sp, dt_s=10.0)
        found = hourly(made, detect(made, CONFIG.oscillation), FIGURES)
        assert [h.figures.sp_travel_pct for h in found][1:] == [2.0] * 5


# Gaps, constants and missing samples


def test_time_without_samples_has_no_weight():
    """The value that is held over a gap changes no mean, no share and no spread."""
    pv = 50 + 2 * np.sin(T / 70) + noise(8)
    bad = (T >= 3000) & (T < 5000)
    rows = [
        assess_span(replace(record(np.where(bad, held, pv)), bad=bad), FIGURES).as_row()
        for held in (50.0, 99.0, -1e6)
    ]
    assert rows[0] == rows[1] == rows[2]
    assert rows[0]["usable_h"] == pytest.approx((N - 2000) / 3600)


def test_a_constant_loop_has_figures_and_no_nan():
    """A loop that is constant away from its set point has its error, zero for all figures of movement, and no NaN."""
    found = assess_span(record(np.full(N, 47.0)), FIGURES).as_row()
    assert found["average_absolute_error_pct"] == pytest.approx(3.0)
    names = (
        "valve_travel_pct_per_h",
        "reversals_per_h",
        "variability_pct",
        "crossings_per_h",
        "noise_band_pct",
    )
    assert [found[name] for name in names] == [0.0] * 5
    assert all(value is None or math.isfinite(value) for value in found.values())


@pytest.mark.parametrize("good", [0, 1, 5])
def test_almost_no_samples_give_none_and_no_good_score(good):
    """With at most five usable samples each figure is None, not zero."""
    bad = np.ones(N, dtype=bool)
    bad[:good] = False
    found = assess_span(replace(record(50 + noise(9)), bad=bad), FIGURES).as_row()
    assert all(value is None for name, value in found.items() if name != "usable_h")


def test_relative_variability_is_not_reported_around_zero():
    """Two sigma of PV over its mean is not reported if the mean lies within the spread."""
    assert assess_span(record(noise(10), 0.0), FIGURES).pv_variability_pct is None
    assert assess_span(record(50 + noise(10)), FIGURES).pv_variability_pct == pytest.approx(4.0, rel=0.05)


def test_hours_add_up():
    """The usable hours of the clock hours, and their weighted error, add up to those of the night."""
    r = replace(night(31), start_s=START_S + 1500.0)
    hours = hourly(r, detect(r, CONFIG.oscillation), FIGURES)
    whole = assess_span(r, FIGURES)
    assert [h.start_s for h in hours] == [START_S, START_S + HOUR_S, START_S + 2 * HOUR_S]
    assert sum(h.figures.usable_h for h in hours) == pytest.approx(whole.usable_h)
    weighted = sum(h.figures.average_absolute_error_pct * h.figures.usable_h for h in hours)
    assert weighted / whole.usable_h == pytest.approx(whole.average_absolute_error_pct)


@settings(max_examples=40, deadline=None)
@given(st.floats(0, 7200), st.sampled_from([0.5, 1.0, 7.0, 60.0]), st.integers(1, 3000))
def test_every_sample_lies_in_one_hour(begin_s, dt_s, n):
    """The edges of the hours assign each sample to the clock hour of its stamp."""
    r = replace(record(np.zeros(n), 0.0, dt_s=dt_s), start_s=START_S + begin_s)
    edges = hour_edges(r)
    assert [k for a, b, _ in edges for k in range(a, b)] == list(range(n))
    for a, b, start in edges:
        stamps = r.start_s + np.array([a, b - 1]) * dt_s
        assert (stamps >= start - 1e-3).all()
        assert (stamps < start + HOUR_S + 1e-3).all()


def test_usable_is_good_and_automatic():
    """A sample is usable if it is neither bad nor in manual."""
    r = night(41)
    assert np.array_equal(r.usable, [not b and not m for b, m in zip(r.bad, r.mask("manual"), strict=True)])


def test_a_record_without_assessment_states_what_it_needs_and_has():
    """A record that is mostly in manual is refused with the share that is needed and the share that is present."""
    r = replace(record(50 + noise(12)), masks={"manual": T < 0.8 * N})
    found = unassessable(r, CONFIG)
    assert found is not None
    assert found.lack is MissingData.AUTOMATIC
    assert str(found).startswith("needs 30 % good samples in automatic, has 20 % (manual 80 %")


def test_a_constant_loop_is_assessed_without_cause():
    """A constant loop is assessed without oscillation and without cause, and each hour has significance zero."""
    r = record(np.full(N, 47.0), op=50 + 0.1 * np.sin(T / 900))
    found = assess(Prepared(r, Scale(0, 100, 0, 100, False), 0, 0, ()), None, CONFIG)
    assert found.verdict.cause == "none"
    assert found.oscillations.first is None
    assert all(h.oscillation_significance == 0.0 for h in found.hours)
