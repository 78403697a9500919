"""Indices from the literature against theory, on signals of known shape, coupling or width."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.signals.field_indices import (
    PUBLISHED,
    apparent_stiction,
    concluded,
    cross_correlation,
    curve_fit,
    idle_index,
    load_disturbances,
    nonlinearity,
    qualitative_shape,
    standing_share,
)

N, PERIOD = 3000, 31.7
PHASE = 2 * np.pi * np.arange(N) / PERIOD
SINE = np.sin(PHASE)
TRIANGLE = 2 / np.pi * np.arcsin(SINE)
OF_TWO = (cross_correlation, qualitative_shape, standing_share)


def white(seed: int, n: int = N) -> np.ndarray:
    """White noise of unit variance, shape (n,)."""
    return np.random.default_rng(seed).standard_normal(n)


def behind_backlash(op: np.ndarray, width: float) -> np.ndarray:
    """The stem position with backlash, from its definition, shape (n,)."""
    out, stem = np.empty_like(op), op[0]
    for k, x in enumerate(op):
        stem = min(max(stem, x - width / 2), x + width / 2)
        out[k] = stem
    return out


@pytest.mark.parametrize("index", OF_TWO)
@pytest.mark.parametrize("pv", [np.full(N, 50.0), np.zeros(N)])
def test_a_constant_has_no_index(index, pv):
    """A constant PV or a constant OP has no index of both signals."""
    assert index(SINE, pv, PERIOD) is None
    assert index(pv, SINE, PERIOD) is None
    assert apparent_stiction(SINE, pv, PERIOD) is None
    assert curve_fit(pv, PERIOD) is None
    assert nonlinearity(pv) is None


@pytest.mark.parametrize("index", OF_TWO)
def test_under_three_periods_there_is_no_index(index):
    """A record with fewer periods than an index needs gives no index."""
    few = slice(0, int(2.5 * PERIOD))
    assert index(SINE[few], -SINE[few], PERIOD) is None
    assert curve_fit(SINE[few], PERIOD) is None
    assert apparent_stiction(SINE[few], -SINE[few], PERIOD) is None
    assert nonlinearity(SINE[few]) is None


def test_a_missing_index_gives_no_verdict():
    """Every index that is missing, or contains a NaN, gives no verdict."""
    for name, lines in PUBLISHED.items():
        assert concluded(name, None) is None
        assert concluded(name, [math.nan] * len(lines.above)) is None


def test_between_two_limits_an_index_is_undecided():
    """He's index is undecided from 0.4 to 0.6, and Horch's if lags and heights disagree. Yamashita's is never
    undecided."""
    assert [concluded("he", [x]) for x in (0.39, 0.5, 0.61)] == [False, None, True]
    assert [concluded("horch", x) for x in ((0.3, 0.05), (0.9, 0.05), (0.7, 0.4))] == [False, None, True]
    assert [concluded("yamashita", x) for x in ((0.4, 0.2), (0.4, 0.3))] == [False, True]


@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0, 90.0])
def test_horch_of_two_sines_is_that_of_their_phase(degrees):
    """Sines with a phase difference p have the correlation cos(t + p): by lags p over 90 degrees, by heights (1
    - cos p)/(1 + cos p)."""
    phase = math.radians(degrees)
    found = cross_correlation(50.0 - np.sin(PHASE + phase), 40.0 + SINE, PERIOD)
    expected = degrees / 90.0, (1 - math.cos(phase)) / (1 + math.cos(phase))
    assert found == pytest.approx(expected, abs=0.03)


def test_horch_is_odd_for_a_sticking_valve_and_even_for_a_load():
    """The correlation is odd for a loop of a sticking valve, a fast lag and an integral controller, in plain
    Python. It is even for a PV under a load against which OP acts, with drift in both."""
    stem, op, pv, ops, pvs = 0.5, 0.5, 0.5, [], []
    for _ in range(N):
        pv += 0.5 * (stem - pv)
        op -= 0.05 * pv
        if abs(op - stem) > 1.0:  # it slips to OP
            stem = op
        ops.append(op)
        pvs.append(pv)
    u, y = np.array(ops), np.array(pvs)
    period = 2.0 * N / np.count_nonzero(np.diff(np.sign(y)))
    assert concluded("horch", cross_correlation(u, y, period)) is True
    drift = np.linspace(0.0, 20.0, N)
    assert concluded("horch", cross_correlation(drift - SINE, SINE - drift, PERIOD)) is False


def test_he_distinguishes_a_triangle_from_a_sine():
    """He's index is 0 for a sine and 1 for a triangle, also with an offset and drift."""
    drift, long = 50.0 + np.linspace(0.0, 1.0, N), 200.0
    fine = np.sin(2 * np.pi * np.arange(N) / long)
    assert curve_fit(fine + drift, long)[0] < 0.01
    assert curve_fit(np.arcsin(fine) + drift, long)[0] > 0.99
    assert concluded("he", curve_fit(SINE + 0.05 * white(1), PERIOD)) is False
    assert concluded("he", curve_fit(TRIANGLE + 0.05 * white(1), PERIOD)) is True


def test_he_has_no_index_for_noise_without_half_periods():
    """White noise has no half periods of the period's length, and no index."""
    assert curve_fit(white(2), PERIOD) is None


def test_yamashita_of_unrelated_signals_is_a_quarter():
    """For independent signals, 2 of 8 pairs with a move have OP moving and PV at rest: 1/4. At most 2 of 5
    following pairs are those of a slip."""
    rho_1, rho_3 = qualitative_shape(white(3, 40_000), white(4, 40_000), PERIOD)
    assert rho_1 == pytest.approx(0.25, abs=0.01)
    assert rho_3 < 0.1
    assert concluded("yamashita", qualitative_shape(-SINE, SINE, PERIOD)) is False


def test_yamashita_and_kano_find_a_wide_backlash_and_no_narrow_one():
    """For a triangle with a backlash of 40 % of its range the stem rests 40 % of the time; for a backlash of 1
    %, 1 %."""
    op = 5.0 * TRIANGLE
    wide, narrow = behind_backlash(op, 4.0), behind_backlash(op, 0.1)
    assert qualitative_shape(op, wide, PERIOD)[0] == pytest.approx(0.4, abs=0.05)
    assert standing_share(op, wide, PERIOD)[0] == pytest.approx(0.4, abs=0.06)
    for name, index in (("yamashita", qualitative_shape), ("kano", standing_share)):
        assert concluded(name, index(op, wide, PERIOD)) is True
        assert concluded(name, index(op, narrow, PERIOD)) is False


@pytest.mark.parametrize("poles", [[1.0, -0.9], [1.0, -1.8, 0.81], [1.0, -1.9, 0.94]])
def test_gaussian_noise_through_a_linear_loop_is_gaussian_and_linear(poles):
    """Gaussian noise of any colour, also with a resonance, passes the test with the stated probability. At most
    12 of 100 records are above 0 (a binomial of 0.05 exceeds 12 once in 700), and at most 4 above the limit."""
    found = [nonlinearity(lfilter([1], poles, white(seed, 4096))) for seed in range(100)]
    assert sum(ngi > 0.0 for ngi, _ in found) <= 12
    assert sum(bool(concluded("choudhury", x)) for x in found) <= 4


def test_a_sine_is_linear_and_a_saw_tooth_is_not():
    """Phase-coupled harmonics cause a bicoherence. A sine in noise, and a step in noise, have none."""
    time, noise = np.arange(4096), 0.05 * white(5, 4096)
    assert concluded("choudhury", nonlinearity(np.sin(2 * np.pi * time / PERIOD) + noise)) is False
    assert concluded("choudhury", nonlinearity(20.0 * (time > 2000) + noise)) is False
    assert concluded("choudhury", nonlinearity(time % PERIOD / PERIOD + noise)) is True


@pytest.mark.parametrize(("amplitude", "width"), [(20.0, 1.0), (5.0, 2.0), (2.0, 2.0)])
def test_the_ellipse_of_backlash_is_that_of_its_describing_function(amplitude, width):
    """The response of backlash to a sine is, at the same frequency, N times the sine. The chord is twice the
    amplitude times the sine of N's phase, which is 4/pi of the width for a large amplitude."""
    op = amplitude * np.sin(2 * np.pi * np.arange(20_000) / 200.0)
    x = 1.0 - width / amplitude
    real = 0.5 + (math.asin(x) + x * math.sqrt(1 - x * x)) / math.pi
    describing = complex(real, -(1 - x * x) / math.pi)
    expected = 2.0 * amplitude * abs(describing.imag) / abs(describing)
    assert apparent_stiction(op, behind_backlash(op, width), 200.0) == pytest.approx(expected, rel=0.03)
    assert apparent_stiction(op, 3.0 * op + 40.0, 200.0) == pytest.approx(0.0, abs=1e-3 * amplitude)


def test_hagglund_counts_the_half_periods_that_are_large_enough():
    """A sine with the period of the integral time counts if its amplitude is above 1 % of span, and not below.
    For half periods of Ti/2, the weighted count tends to fifty Ti over half a Ti, which is 100. Noise and a
    constant count none."""
    time, ti = np.arange(40_000.0), 200.0
    sine = np.sin(2 * np.pi * time / ti)
    assert load_disturbances(1.05 * sine, 1.0, ti)[0] == pytest.approx(100.0, rel=0.05)
    for small in (0.95 * sine, white(6, time.size), np.zeros(time.size)):
        assert load_disturbances(small, 1.0, ti) == (0.0,)
    for short, own in ((sine[:5000], ti), (sine, math.inf), (sine, 2.0), (sine, -5.0)):
        assert load_disturbances(short, 1.0, own) is None


def test_the_idle_index_is_one_where_both_move_in_one_direction():
    """Signals that move in the same direction have the index 1, in opposite directions -1, and independent ones
    about 0. The sign of the process changes the sign of the index. Without a set point at rest there is no
    index."""
    op, rest = np.cumsum(white(7, 500)), np.zeros(500)
    assert idle_index(op, 2.0 * op + 3.0, rest, 1.0) == (1.0,)
    assert idle_index(op, -op, rest, 1.0) == (-1.0,)
    assert idle_index(op, -op, rest, -1.0) == (1.0,)
    assert abs(idle_index(op, np.cumsum(white(8, 500)), rest, 1.0)[0]) < 0.2
    assert idle_index(op, op, white(9, 500), 1.0) is None
    assert idle_index(op, np.full(500, 50.0), rest, 1.0) is None


@pytest.mark.parametrize(("gain", "ti", "sluggish"), [(0.2, 20.0, True), (4.0, 10.0, False)])
def test_a_loop_that_recovers_slower_than_its_integral_time_is_sluggish(gain, ti, sluggish):
    """A loop with gain 0.2 and Ti 20 is sluggish, and one with gain 4 and Ti 10 is not. OP moves by -gain (dPV
    + PV dt/Ti). If PV returns more slowly than Ti, the integral term dominates and both signals move in one
    direction. For a lag of 20 under load steps, the closed loops have time constants of 100 and 8."""
    pv, integral, ops, pvs = 0.0, 0.0, [], []
    for load in np.repeat(np.sign(white(10, 12)), 500):
        integral -= gain * pv / ti
        op = integral - gain * pv
        pv += (op + load - pv) / 20.0
        ops.append(op)
        pvs.append(pv)
    u, y = (np.array(x).reshape(-1, 4).mean(axis=1) for x in (ops, pvs))
    assert concluded("idle", idle_index(u, y, 0.0 * y, 1.0)) is sluggish
