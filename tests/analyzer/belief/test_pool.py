"""Pooled constants follow the random-effects model and include the spread between nights."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analyzer.belief.pool import Pool
from identification.estimation.descent import INTERVALS_WIDER

LEAST = 0.01


def pooled(values: np.ndarray, deviations: np.ndarray) -> Pool:
    """The pool of the values of some nights."""
    out = Pool()
    for value, deviation in zip(values, deviations, strict=True):
        out = out.plus(float(value), float(deviation), LEAST, 2.0)
    return out


def test_sums_give_the_moments_of_dersimonian_and_laird() -> None:
    """The spread between nights equals the method-of-moments estimate that is computed from all nights at once."""
    rng = np.random.default_rng(4)
    deviation = rng.uniform(0.02, 0.2, 30)
    x = math.log(3.0) + 0.3 * rng.standard_normal(30) + INTERVALS_WIDER * deviation * rng.standard_normal(30)
    w = 1.0 / (INTERVALS_WIDER * deviation) ** 2
    mean = (w * x).sum() / w.sum()
    q = (w * (x - mean) ** 2).sum()
    expected = (q - 29) / (w.sum() - (w**2).sum() / w.sum())
    found = pooled(np.exp(x), deviation).pooled
    assert found is not None
    assert found.spread == pytest.approx(math.sqrt(expected), rel=1e-9)


def test_intervals_contain_the_truth() -> None:
    """Of 200 draws of eight nights with a spread of 20 %, the 90 % interval contains the truth in 80 to 98 %."""
    rng, held = np.random.default_rng(5), 0
    for _ in range(200):
        deviation = rng.uniform(0.03, 0.1, 8)
        x = 0.2 * rng.standard_normal(8) + INTERVALS_WIDER * deviation * rng.standard_normal(8)
        found = pooled(np.exp(x), deviation).pooled
        assert found is not None
        held += found.low <= 1.0 <= found.high
    assert 160 <= held <= 196


def test_a_gain_keeps_its_sign_and_unknown_values_do_not_count() -> None:
    """A negative gain is pooled as a negative gain; zero, NaN and values known only to a factor of ten are left
    out.
    """
    found = pooled(
        np.array([-2.0, -2.2, 0.0, math.nan, -9.0]), np.array([0.05, 0.05, 0.05, 0.05, 2.5])
    ).pooled
    assert found is not None
    assert -2.3 < found.low <= found.value <= found.high < -1.9
    assert Pool().pooled is None
