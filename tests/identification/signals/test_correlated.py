"""Number of correlated samples that count as one independent sample."""

from __future__ import annotations

import numpy as np
import pytest

from identification.signals.correlation import correlated


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.9])
def test_first_order_noise_has_the_closed_form(pole: float) -> None:
    """For first-order noise with pole a, (1 + a) / (1 - a) samples count as one independent sample."""
    e = np.random.default_rng(5).standard_normal(40_000)
    x = np.empty(e.size)
    x[0] = e[0]
    for k in range(1, e.size):
        x[k] = pole * x[k - 1] + e[k]
    assert correlated(x) == pytest.approx((1.0 + pole) / (1.0 - pole), rel=0.15)


def test_a_constant_is_one_sample() -> None:
    """A constant error counts as one sample at any length."""
    assert correlated(np.full(700, 3.0)) == 700.0
    assert correlated(np.zeros(700)) == 700.0
