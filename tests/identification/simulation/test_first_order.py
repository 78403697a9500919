"""A first-order filter against scipy's, and its step response."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.simulation.lag import first_order


def test_it_is_the_filter_of_scipy_at_rest_at_the_first_value():
    """The recursion equals lfilter after the first value is subtracted and added again."""
    x = 40 + np.cumsum(np.random.default_rng(1).normal(size=500))
    pole = np.exp(-1 / 7.5)
    expected = lfilter([1 - pole], [1.0, -pole], x - x[0]) + x[0]
    assert first_order(x, 7.5) == pytest.approx(expected, abs=1e-9)


def test_no_time_constant_is_no_filter_and_a_step_is_an_exponential():
    """A time constant of zero returns the signal itself. A step is at 63.2 % after one time constant."""
    x = np.repeat([0.0, 1.0], [10, 100])
    assert first_order(x, 0.0) is x
    assert first_order(x, 20.0)[10 + 19] == pytest.approx(1 - np.exp(-1))
