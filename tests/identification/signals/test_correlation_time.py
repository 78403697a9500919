"""The correlation time of an error, on loops of known gain."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.signals.correlation import correlation_time
from tests.identification.signals import hand_loop

SEEDS = (0, 1, 2)


def load(kind: str, lag_s: float, n: int, rng: np.random.Generator) -> np.ndarray:
    """A load at the process input: 14 steps a day, or one that varies four times as slowly as the process."""
    if kind == "steps":
        steps = np.zeros(n)
        steps[rng.integers(0, n, 14)] = 3 * rng.normal(size=14)
        return np.cumsum(steps)
    return np.asarray(lfilter([1], [1, -np.exp(-0.25 / lag_s)], rng.normal(size=n))) * 3 / np.sqrt(2 * lag_s)


def relative_correlation_time(kp_gain: float, kind: str, lag_s: float, dead_s: int, seed: int) -> float:
    """Correlation time divided by Ti of a PI loop with Ti = T, from a separate simulation."""
    rng = np.random.default_rng(seed)
    n = 43200
    error = hand_loop.error(
        kp_gain, lag_s, lag_s, dead_s, load(kind, lag_s, n, rng), 0.1 * rng.normal(size=n)
    )
    found = correlation_time(error, np.ones(n, bool), 1.0, lag_s)
    assert found is not None
    return found / lag_s


@pytest.mark.parametrize("kind", ["steps", "wanders"])
@pytest.mark.parametrize("lag_s", [60.0, 200.0])
def test_small_gain_makes_errors_last(kind: str, lag_s: float) -> None:
    """With Kp K = 2 the correlation time is below 2 Ti, with 0.3 above 2 Ti, for load steps and a slowly
    varying load."""
    fast = [relative_correlation_time(2.0, kind, lag_s, int(lag_s / 6), s) for s in SEEDS]
    slow = [relative_correlation_time(0.3, kind, lag_s, int(lag_s / 6), s) for s in SEEDS]
    assert max(fast) < 2.0 < min(slow)


def test_noise_has_a_short_correlation_time() -> None:
    """White noise has a correlation time of a tenth of the scale."""
    noise = np.random.default_rng(0).normal(size=20000)
    assert correlation_time(noise, np.ones(20000, bool), 1.0, 100.0) == 10.0


def test_first_order_noise_has_its_time_constant() -> None:
    """A first-order random process of time constant tau has a correlation time of tau within 15 %."""
    rng = np.random.default_rng(1)
    x = np.asarray(lfilter([1], [1, -np.exp(-1 / 300)], rng.normal(size=400000)))
    found = correlation_time(x, np.ones(x.size, bool), 1.0, 100.0)
    assert found == pytest.approx(300.0, rel=0.15)


def test_gaps_change_little() -> None:
    """With a third of the samples masked in blocks and set to wrong values, the correlation time changes by at
    most 20 %."""
    rng = np.random.default_rng(2)
    x = np.asarray(lfilter([1], [1, -np.exp(-1 / 300)], rng.normal(size=200000)))
    good = np.repeat(rng.random(200) > 0.33, 1000)
    whole = correlation_time(x, np.ones(x.size, bool), 1.0, 100.0)
    holed = correlation_time(np.where(good, x, 1e6), good, 1.0, 100.0)
    assert whole is not None
    assert holed == pytest.approx(whole, rel=0.2)


@pytest.mark.parametrize("scale", [np.inf, 3000.0])
def test_too_short_a_record_has_no_correlation_time(scale: float) -> None:
    """Fewer than ten integral times, no integral action, or a constant give no correlation time."""
    assert (
        correlation_time(np.random.default_rng(0).normal(size=20000), np.ones(20000, bool), 1.0, scale)
        is None
    )
    assert correlation_time(np.zeros(20000), np.ones(20000, bool), 1.0, 100.0) is None
