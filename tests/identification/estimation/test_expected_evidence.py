"""What a play would show in a recording, against what it shows where there is one."""

from __future__ import annotations

import numpy as np
import pytest

from identification.estimation.backlash_stiction import fit_linear, fit_play
from identification.estimation.evidence import expected_evidence
from identification.estimation.window import Window
from identification.models import Backlash, Fopdt
from tests.identification.responses import pv_of

N, PERIOD, WIDTH = 4000, 200.0, 3.0
OP = 50 + 5 * (2 * np.abs((np.arange(N) / (PERIOD / 2)) % 2 - 1) - 1)


def recorded(valve: Backlash | None, noise: float, n: int = N, seed: int = 7) -> Window:
    """PV behind a triangle of OP, with white noise."""
    pv = pv_of(Fopdt(1.5, 30.0, 5.0), valve, OP[:n], 1.0)
    rng = np.random.default_rng(seed)
    return Window(pv + noise * rng.standard_normal(n), OP[:n], np.ones(n, dtype=bool), 1.0)


def expected(noise: float, n: int = N) -> float:
    """Evidence foretold from the loop without a play."""
    sound = recorded(None, noise, n)
    return expected_evidence(fit_linear(sound, PERIOD), WIDTH, PERIOD)


def brought(noise: float, seed: int) -> float:
    """Evidence that the play of a worn valve brings."""
    worn = recorded(Backlash(WIDTH), noise, seed=seed)
    linear = fit_linear(worn, PERIOD)
    return fit_play(linear, PERIOD).log_likelihood - linear.log_likelihood


@pytest.mark.parametrize("noise", [0.5, 1.0, 2.0])
def test_evidence_foretold_is_of_the_order_that_a_play_brings(noise: float) -> None:
    """From a loop with a sound valve a third to the whole of what a play brings is foretold, at any noise."""
    mean = float(np.mean([brought(noise, seed) for seed in range(6)]))
    assert 0.33 * mean < expected(noise) < 1.2 * mean


def test_noise_and_a_short_record_hide_a_play() -> None:
    """Where it is small, evidence falls with the square of the noise, and with the length of the record."""
    assert expected(4.0) == pytest.approx(0.25 * expected(2.0), rel=0.3)
    assert expected(2.0, N // 2) == pytest.approx(0.5 * expected(2.0), rel=0.3)


def test_an_op_that_stands_foretells_nothing() -> None:
    """Behind an OP that does not move no play shows, and none is expected to."""
    still = Window(np.random.default_rng(1).standard_normal(N), np.full(N, 50.0), np.ones(N, dtype=bool), 1.0)
    assert expected_evidence(fit_linear(still, PERIOD), WIDTH, PERIOD) == 0.0
