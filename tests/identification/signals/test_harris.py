"""The Harris index against closed forms. An index of 1 is minimum variance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.signals.correlation import harris_index

N = 4000


def noise(seed: int) -> np.ndarray:
    """White noise of unit variance, shape (n,)."""
    return np.random.default_rng(seed).standard_normal(N)


def index(error: np.ndarray, dead_time_s: float) -> float:
    """The index of an error whose samples are all usable, one per second."""
    found = harris_index(error, np.ones(error.size, dtype=bool), 1.0, dead_time_s)
    assert found is not None
    return found


def test_white_error_is_minimum_variance():
    """An error that cannot be predicted has the index 1."""
    assert index(noise(1), 5.0) == pytest.approx(1.0, abs=0.02)


def test_error_that_dies_within_the_dead_time_is_minimum_variance():
    """A moving average no longer than the dead time has the index 1, because a minimum variance controller
    leaves it."""
    assert index(lfilter([1, 0.8, 0.6, 0.4], 1, noise(2)), 5.0) == pytest.approx(1.0, abs=0.02)


def test_slow_error_is_far_from_minimum_variance():
    """An error with a correlation far longer than the dead time has an index below 0.1."""
    assert index(lfilter([1], [1, -0.998], noise(3)), 5.0) < 0.1


@pytest.mark.parametrize("pole", [0.7, 0.9, 0.97])
def test_first_order_error_has_the_closed_form(pole):
    """For first-order noise, 1 - pole^(2 b) of the variance cannot be predicted b samples ahead."""
    ahead = 6  # five samples of dead time and one sample that sampling adds
    assert index(lfilter([1], [1, -pole], noise(4)), 5.0) == pytest.approx(1 - pole ** (2 * ahead), abs=0.06)


def test_size_of_the_error_does_not_matter():
    """The scale of the error does not change the index."""
    error = lfilter([1], [1, -0.9], noise(5))
    assert index(1000 * error, 5.0) == pytest.approx(index(error, 5.0))


def test_too_few_or_constant_samples_have_no_index():
    """Fewer than 200 samples, a constant, or no usable sample give no index."""
    every = np.ones(N, dtype=bool)
    assert harris_index(noise(6)[:150], every[:150], 1.0, 5.0) is None
    assert harris_index(np.full(N, 2.0), every, 1.0, 5.0) is None
    assert harris_index(noise(7), ~every, 1.0, 5.0) is None


def test_unusable_samples_do_not_count():
    """Wrong values at unusable samples do not lower the index."""
    error, usable = noise(8), np.ones(N, dtype=bool)
    error[1000:1500] += np.linspace(0, 300, 500)
    usable[1000:1500] = False
    found = harris_index(error, usable, 1.0, 5.0)
    assert found == pytest.approx(1.0, abs=0.03)
