"""A load of constant frequency keeps its phase; a limit cycle with shifts at its reversals does not."""

from __future__ import annotations

import numpy as np
import pytest

from identification.record import Floats
from identification.signals.phase import PERIODS, kept_phase

N, PERIOD = 40_000, 100.0


def oscillation(jitter: float, seed: int = 1) -> Floats:
    """An oscillation of amplitude 1 in noise, shape (N,). Its phase is a random walk with this standard
    deviation per period [rad]."""
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.standard_normal(N)) * jitter / np.sqrt(PERIOD)
    return np.sin(2 * np.pi * np.arange(N) / PERIOD + walk) + 0.3 * rng.standard_normal(N)


GOOD = np.ones(N, dtype=bool)


def test_a_sine_keeps_its_phase() -> None:
    """A sine in noise keeps one phase with more than 97 % of its amplitude. This holds also with a period that
    is 0.8 % wrong, with missing samples and with a set-point move."""
    sine, gaps = oscillation(0.0), GOOD.copy()
    gaps[N // 5 : N // 2 : 2] = False
    moved = sine + 20.0 * (np.abs(np.arange(N) - N // 3) < 200)
    for x, usable, period in (
        (sine, GOOD, 100.0),
        (sine, GOOD, 100.8),
        (sine, gaps, 100.0),
        (moved, GOOD, 100.0),
    ):
        found = kept_phase(x, usable, period)
        assert found.periods == PERIODS * (N // round(PERIODS * period))
        assert found.share > 0.97


@pytest.mark.parametrize("seed", range(5))
def test_a_random_walk_of_the_phase_is_detected(seed: int) -> None:
    """A phase that moves by a thirtieth of a period in each period is kept with less than 0.95 of the amplitude
    over 400 periods."""
    assert kept_phase(oscillation(0.2, seed), GOOD, PERIOD).share < 0.95
    assert kept_phase(oscillation(0.5, seed), GOOD, PERIOD).share < 0.6


def test_noise_and_constants_keep_no_phase() -> None:
    """White noise has a share below 0.6, a constant and a record of one block a share of 0."""
    noise = np.random.default_rng(2).standard_normal(N)
    assert kept_phase(noise, GOOD, PERIOD).share < 0.6
    assert kept_phase(np.zeros(N), GOOD, PERIOD).share == 0.0
    assert kept_phase(noise[:900], GOOD[:900], PERIOD).share == 0.0
