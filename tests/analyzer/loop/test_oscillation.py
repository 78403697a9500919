"""Signals that are an oscillation of the loop, and signals that are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter, square

from analyzer.loop.oscillation.detection import Oscillation, Oscillations, counting, detect
from analyzer.loop.oscillation.figures import hourly
from identification.record import LoopRecord
from proofs.plant import CONFIG, START_S, record
from proofs.untidy.draw import draw

N = 7200
T = np.arange(N)


def noise(seed: int, n: int = N) -> np.ndarray:
    """White noise of unit variance, shape (n,)."""
    return np.random.default_rng(seed).standard_normal(n)


def coloured(seed: int, n: int = N) -> np.ndarray:
    """First-order noise of unit variance, shape (n,)."""
    x = lfilter([1], [1, -0.95], noise(seed, n))
    return x / x.std()


def found_in(found: LoopRecord) -> Oscillations:
    """Oscillations that are found with the limits of the batch."""
    return detect(found, CONFIG.oscillation)


def first_of(found: LoopRecord) -> Oscillation:
    """The first oscillation, which must exist."""
    first = found_in(found).first
    assert first is not None
    return first


# Signals without oscillation


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("make", [noise, coloured], ids=["white", "coloured"])
def test_noise_does_not_oscillate(make, seed):
    """Noise has no oscillation, and the significance of each of its hours is zero."""
    night = record(50 + make(seed), dt_s=2.0)
    found = found_in(night)
    assert found.first is None
    assert all(
        h.oscillation_significance == 0.0 and h.oscillating_pct == 0.0
        for h in hourly(night, found, CONFIG.figures)
    )


@pytest.mark.parametrize(
    "pv",
    [
        np.full(N, 50.0),
        np.linspace(30, 70, N),
        np.linspace(30, 70, N) + 0.3 * noise(1),
        50 + 5 * (T > 3000) + 0.3 * noise(2),
        50 + 0.05 * np.cumsum(noise(3)),
        50 + np.exp(-T / 900) * 10 + 0.1 * noise(4),
    ],
    ids=["constant", "ramp", "noisy ramp", "load step", "random walk", "decay"],
)
def test_a_signal_without_repetition_does_not_oscillate(pv):
    """A constant, a ramp, a step, a random walk and a decay are no oscillation."""
    assert found_in(record(pv)).first is None


def follower(sp: np.ndarray, lag_s: float = 20.0) -> np.ndarray:
    """PV that follows its set point with a lag, under a little noise [%], shape (n,)."""
    keep = np.exp(-1 / lag_s)
    return sp[0] + lfilter([1 - keep], [1, -keep], sp - sp[0]) + 0.1 * noise(5)


@pytest.mark.parametrize(
    "sp",
    [
        50 + 2 * square(2 * np.pi * T / 600),
        50 + 2 * np.sin(2 * np.pi * T / 400),
        50 + 2 * np.sin(2 * np.pi * T / 400) * (np.sin(2 * np.pi * T / 3600) > 0),
        50 + 4 * (T > 2000) - 6 * (T > 4500),
        50 + np.cumsum(2.0 * (np.random.default_rng(6).random(N) < 1 / 500) - 1 / 250),
    ],
    ids=["square wave", "cascade", "cascade now and then", "steps", "random steps"],
)
def test_following_the_set_point_is_not_oscillation(sp):
    """A loop that follows a periodic, square or stepping set point does not oscillate itself."""
    assert found_in(record(follower(sp), sp)).first is None


def test_a_loop_that_oscillates_at_another_period_than_its_set_point_is_found():
    """An oscillation of the loop itself is found although the set point moves with another period."""
    sp = 50 + 2 * np.sin(2 * np.pi * T / 700)
    pv = follower(sp) + np.sin(2 * np.pi * T / 90)
    assert first_of(record(pv, sp)).period_s == pytest.approx(90, rel=0.01)


def test_a_set_point_that_steps_by_little_hides_no_cycle():
    """A cycle of 1 % is the loop's own although the set point steps by hundredths of a percent in each period."""
    sp = 50 + 0.02 * np.random.default_rng(4).random(N // 60)[T // 60]
    pv = sp + np.sin(2 * np.pi * T / 90) + 0.05 * noise(5)
    assert first_of(record(pv, sp)).period_s == pytest.approx(90, rel=0.01)


def test_too_few_periods_are_not_called_oscillation():
    """Two and a half periods of a sine in noise are too few to distinguish it from drift."""
    assert found_in(record(50 + 3 * np.sin(2 * np.pi * T / (N / 2.5)) + 0.3 * noise(7))).first is None


# Signals with oscillation


@pytest.mark.parametrize("period_s", [23.0, 97.0, 310.0, 900.0])
@pytest.mark.parametrize("ratio", [1.5, 4.0])
def test_a_sine_in_noise_is_found(period_s, ratio):
    """For a sine of 1.5 times the noise deviation or more, the period is within 1 % and the amplitude within 10 %,
    all the time.
    """
    for seed in range(3):
        found = first_of(record(50 + 2 * np.sin(2 * np.pi * T / period_s + seed) + 2 / ratio * noise(seed)))
        assert found.period_s == pytest.approx(period_s, rel=0.01)
        assert found.amplitude_pct == pytest.approx(2.0, rel=0.10)
        assert found.oscillating_pct > 95
        assert found.significance == pytest.approx(2.0 * found.rhythm.first * N / 3600, rel=0.1)


def test_share_of_time():
    """A loop that oscillates in one stretch of 40 % of the time is reported with 40 ± 3 % of the time."""
    n = 40_000
    t = np.arange(n)
    on = (t >= 9000) & (t < 9000 + 0.4 * n)
    found = first_of(record(50 + 2 * np.sin(2 * np.pi * t / 120) * on + 0.2 * noise(8, n)))
    assert found.oscillating_pct == pytest.approx(40, abs=3)
    assert found.amplitude_pct == pytest.approx(2.0, rel=0.1)


def test_two_periods_at_once_are_both_reported():
    """Two cycles that are no harmonics of each other are reported, the larger one first."""
    pv = 50 + 2 * np.sin(2 * np.pi * T / 410) + np.sin(2 * np.pi * T / 57) + 0.3 * noise(9)
    found = found_in(record(pv)).found
    assert [o.period_s for o in found] == pytest.approx([410, 57], rel=0.01)
    assert [o.amplitude_pct for o in found] == pytest.approx([2, 1], rel=0.1)


def test_amplitude_includes_the_noise_of_its_band():
    """The amplitude is that of the band from f/1.6 to 1.6 f, and includes the power of white noise in that band."""
    period, sigma = 23.0, 2.0
    width = (1.6 - 1 / 1.6) / period  # in cycles a sample, of 0.5
    expected = np.sqrt(2.0**2 + 2 * sigma**2 * width / 0.5)
    found = [
        first_of(record(50 + 2 * np.sin(2 * np.pi * T / period) + sigma * noise(s))).amplitude_pct
        for s in range(8)
    ]
    assert np.mean(found) == pytest.approx(expected, rel=0.02)


def test_a_harmonic_is_not_another_oscillation():
    """The odd harmonics of a square oscillation are not reported as separate oscillations."""
    assert len(found_in(record(50 + 2 * square(2 * np.pi * T / 300) + 0.1 * noise(10))).found) == 1


@settings(max_examples=20, deadline=None)
@given(st.floats(0.01, 15.0), st.floats(-1e8, 1e8), st.floats(-20, 20))
def test_scaling_pv_scales_amplitude_and_significance_alone(factor, shift_s, level):
    """A deviation `factor` times as large has `factor` times the amplitude and significance; all else is equal at any
    time and level.
    """
    deviation = np.sin(2 * np.pi * T / 130) + 0.5 * noise(11)
    one = first_of(record(50 + deviation))
    moved = replace(record(50 + level + factor * deviation, 50.0 + level), start_s=START_S + shift_s)
    other = first_of(moved)
    assert other.amplitude_pct == pytest.approx(factor * one.amplitude_pct, rel=1e-6)
    assert other.significance == pytest.approx(factor * one.significance, rel=1e-6)
    for name in ("period_s", "oscillating_pct", "prominence", "cycles"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-6)
    assert other.rhythm.regularity == pytest.approx(one.rhythm.regularity, rel=1e-4)


def test_sampling_interval_is_a_unit_of_time():
    """The same samples at another interval have the same results with another period."""
    pv = 50 + np.sin(2 * np.pi * T / 130) + 0.5 * noise(12)
    one, ten = first_of(record(pv)), first_of(record(pv, dt_s=10.0))
    assert ten.period_s == pytest.approx(10 * one.period_s)
    assert ten.significance == pytest.approx(10 * one.significance)
    assert ten.oscillating_pct == pytest.approx(one.oscillating_pct)


@pytest.mark.parametrize("begin_s", [0.0, 1234.0, 3599.0])
@pytest.mark.parametrize("n", [28_800, 29_989])
def test_significance_adds_up_over_the_hours(begin_s, n):
    """The significance of a night is the sum over its clock hours within 0.5 %, for any start time."""
    t = np.arange(n)
    on = (t // 5000) % 2 == 0
    night = record(50 + 2 * np.sin(2 * np.pi * t / 150) * on + 0.3 * noise(13, n))
    night = replace(night, start_s=START_S + begin_s)
    found = found_in(night)
    assert found.first is not None
    hours = hourly(night, found, CONFIG.figures)
    assert sum(h.oscillation_significance for h in hours) == pytest.approx(
        found.first.significance, rel=0.005
    )
    assert all(h.start_s % 3600 == 0 for h in hours)


def test_significance_grows_with_regularity():
    """A cycle with a drifting phase has less significance than one of the same amplitude with a constant phase."""
    phase = 2 * np.pi * T / 100
    wandering = phase + np.cumsum(0.12 * noise(14))
    steady, loose = (first_of(record(50 + 2 * np.sin(p) + 0.2 * noise(15))) for p in (phase, wandering))
    assert loose.significance < 0.9 * steady.significance


def test_a_gap_does_not_move_the_period():
    """A tenth of the record missing in one piece, with its last value held, leaves period, amplitude and share
    unchanged.
    """
    pv = 50 + 2 * np.sin(2 * np.pi * T / 97) + 0.4 * noise(16)
    bad = (T >= 3000) & (T < 3720)
    held = np.where(bad, pv[2999], pv)
    found = first_of(replace(record(held), bad=bad))
    assert found.period_s == pytest.approx(97, rel=0.005)
    assert found.amplitude_pct == pytest.approx(2.0, rel=0.05)
    assert found.oscillating_pct > 90


def test_bad_samples_do_not_count():
    """The values at bad samples do not change the oscillation that is found."""
    pv = 50 + 2 * np.sin(2 * np.pi * T / 97) + 0.4 * noise(17)
    bad = np.random.default_rng(18).random(N) < 0.02
    wild = np.where(bad, 1e4 * noise(19), pv)
    zero = np.where(bad, 0.0, pv)
    one, other = (first_of(replace(record(x), bad=bad)) for x in (wild, zero))
    assert one.period_s == pytest.approx(97, rel=0.01)
    assert one.amplitude_pct == pytest.approx(other.amplitude_pct, rel=1e-6)


# Oscillations that are regular only in shape


def slips(seed: int, halves: int, per_half: int) -> np.ndarray:
    """A square signal whose half periods last from half to twice their median and whose size changes at each slip
    [%].
    """
    rng = np.random.default_rng(seed)
    lengths = np.maximum((per_half * 2 ** rng.uniform(-1, 1, halves)).astype(int), 1)
    sizes = rng.uniform(0.6, 1.4, halves) * np.where(np.arange(halves) % 2, 1.0, -1.0)
    return np.repeat(sizes, lengths)


@pytest.mark.parametrize("seed", range(8))
def test_a_cycle_whose_halves_last_from_half_to_twice_is_found(seed):
    """Sixty slips with half periods of half to twice the median, with half as much noise, are an oscillation."""
    x = slips(seed, 60, 25)
    found = first_of(record(50 + x + 0.5 * noise(seed, x.size)))
    assert found.period_s == pytest.approx(2 * x.size / 60, rel=0.5)
    assert found.oscillating_pct > 50


def test_three_samples_a_cycle_are_enough_for_a_clear_cycle():
    """A sine with 3.6 samples per cycle and 1.4 times the noise deviation is found, and white noise is not."""
    t = np.arange(600)
    assert first_of(record(50 + 2 * np.sin(2 * np.pi * t / 3.6) + noise(21, 600))).period_s == pytest.approx(
        3.6, rel=0.03
    )
    assert all(found_in(record(50 + noise(s, 600))).first is None for s in range(22, 40))


def test_irregular_loops_without_fault_do_not_oscillate():
    """Of 60 loops without fault under steps, ramps, masters and coloured noise, at most one is called oscillating."""
    drawn = (draw(seed, "healthy") for seed in range(60))
    claimed = [counting(found_in(record(d.pv, d.sp, dt_s=d.step_s))) is not None for d in drawn]
    assert sum(claimed) <= 1


# Effects of sampling


def cycling_after_a_start(dt_s: float, n: int, seed: int = 7) -> LoopRecord:
    """A cycle of 600 s around the set point, after a start from far below it, as a recorder stores it at an interval.

    The noise of the process is the same for all intervals; the noise of the recorder is new at each sample.
    """
    fine = np.arange(36_000) * 1.0
    slow = lfilter([0.02], [1, -0.98], np.random.default_rng(seed).standard_normal(fine.size))
    pv = 50 - 40 * np.exp(-fine / 700) + np.sin(2 * np.pi * fine / 600) * (fine > 2500) + 3 * slow
    at = np.interp(np.arange(n) * dt_s, fine, pv)
    return record(at + 0.02 * np.random.default_rng(seed + 1).standard_normal(n), dt_s=dt_s)


@pytest.mark.parametrize("dt_s", [2.0, 2.7, 7.0, 13.0, 23.0, 61.0, 73.0])
def test_sampling_changes_no_answer(dt_s):
    """From 8 to 300 samples per cycle, period, share of time and significance agree with those at 5 s."""
    usual = first_of(cycling_after_a_start(5.0, 7200))
    found = first_of(cycling_after_a_start(dt_s, int(36_000 / dt_s)))
    assert found.period_s == pytest.approx(usual.period_s, rel=0.01)
    assert found.oscillating_pct == pytest.approx(usual.oscillating_pct, abs=2.0)
    assert found.significance == pytest.approx(usual.significance, rel=0.05)


@pytest.mark.parametrize("dt_s", [2.0, 5.0, 7.0, 23.0, 61.0])
def test_noise_after_a_start_is_no_cycle_at_any_sampling(dt_s):
    """Noise after a start from far below the set point is no cycle."""
    fine = np.arange(36_000) * 1.0
    slow = lfilter([0.02], [1, -0.98], np.random.default_rng(3).standard_normal(fine.size))
    at = np.interp(np.arange(int(36_000 / dt_s)) * dt_s, fine, 50 - 40 * np.exp(-fine / 700) + 3 * slow)
    assert found_in(record(at, dt_s=dt_s)).first is None
