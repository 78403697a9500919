"""The noise model and the weights of outliers, against filters and closed forms from other sources."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.estimation.noise import (
    arx_noise,
    edges_for,
    every_lag,
    fitted,
    judged,
    lag_means,
    whitened,
)
from identification.signals.robust import OUTLIER, clipped_gain, robust_weights


def test_single_lags_whiten_as_a_filter_does():
    """Innovations with single lags equal those of the FIR filter 1 - ar1 q^-1 - ..., within 1e-12."""
    rng = np.random.default_rng(1)
    x, ar = rng.normal(size=300).cumsum(), np.array([1.2, -0.5, 0.1])
    expected = lfilter(np.concatenate(([1.0], -ar)), [1.0], x)
    np.testing.assert_allclose(whitened(x, ar, every_lag(3))[3:], expected[3:], rtol=0, atol=1e-12)


def test_widening_lags_whiten_as_their_single_lags_do():
    """A group of lags equals its single lags with evenly divided coefficients."""
    rng = np.random.default_rng(2)
    x = rng.normal(size=4000).cumsum()
    edges = edges_for(np.ones(x.size, dtype=bool))
    ar = rng.normal(size=edges.size - 1) * 0.1
    each = np.repeat(ar / np.diff(edges), np.diff(edges))
    reach = int(edges[-1])
    grouped, single = whitened(x, ar, edges), whitened(x, each, every_lag(reach))
    np.testing.assert_allclose(grouped[reach:], single[reach:], rtol=0, atol=1e-8)


def test_the_lag_means_give_the_same_innovations():
    """A residual minus its noise model over the lag means is its innovation, at all samples that have all lags."""
    rng = np.random.default_rng(3)
    x = lfilter([1.0], [1.0, -0.9], rng.normal(size=5000))
    usable = np.ones(x.size, dtype=bool)
    usable[1000] = False
    edges = edges_for(usable)
    counts, columns = judged(usable, int(edges[-1])), lag_means(x, edges)
    ar, _ = fitted(columns * counts, x * counts)
    np.testing.assert_allclose((x - ar @ columns)[counts], whitened(x, ar, edges)[counts], atol=1e-9)
    assert not counts[: edges[-1]].any()
    assert not counts[1000 : 1000 + edges[-1] + 1].any()
    assert float(np.var((x - ar @ columns)[counts])) == pytest.approx(1.0, rel=0.06)


def test_a_first_noise_model_separates_noise_and_process():
    """For PV = known noise + response to OP, the first noise model returns the constants of the noise."""
    rng = np.random.default_rng(4)
    u = rng.normal(size=20_000)
    past = np.concatenate(([0.0], u[:-1]))
    y = lfilter([1.0], [1.0, -1.1, 0.3], 0.7 * past + 0.1 * rng.normal(size=u.size))
    found = arx_noise(y, u, np.ones(u.size, dtype=bool), 4, 5)
    np.testing.assert_allclose(found, [1.1, -0.3, 0.0, 0.0], atol=0.02)


def test_one_spike_has_a_bounded_weight():
    """A single very large innovation changes the gain in likelihood and a weighted mean by no more than its
    bound."""
    rng = np.random.default_rng(5)
    mine = rng.normal(size=5000)
    other = mine.copy()
    other[7] = 1e6
    assert 0 < clipped_gain(mine, other).sum() < 0.5 * OUTLIER**2 * 1.1
    weights = robust_weights(other, np.ones(other.size, dtype=bool))
    assert weights[7] * 1e6 == pytest.approx(OUTLIER, rel=0.05)
    assert np.all(weights[np.abs(other) < 3] == 1.0)


def test_gaussian_innovations_count_in_full():
    """For Gaussian innovations, clipping changes the gain in likelihood of one scale over another by about 1 %."""
    rng = np.random.default_rng(6)
    mine = rng.normal(size=100_000)
    exact = (1.2**2 - 1.0) * float(np.sum(mine**2)) / 2
    assert clipped_gain(mine, 1.2 * mine).sum() == pytest.approx(exact, rel=0.012)
