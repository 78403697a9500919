"""Granger tests of all pairs at once, against statsmodels' test of one pair and on signals of known direction."""

from __future__ import annotations

import contextlib
import io
import warnings

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import f as f_law
from statsmodels.tsa.stattools import grangercausalitytests

from identification.signals.cross_spectrum import granger_f


def coupled(seed: int, n: int = 1500) -> np.ndarray:
    """A resonant signal, one that it drives two samples later, and an independent one, shape (3, n)."""
    rng = np.random.default_rng(seed)
    one = lfilter([1.0], [1.0, -1.6, 0.9], rng.standard_normal(n))
    other = lfilter([0.0, 0.0, 0.5], [1.0, -0.7], one) + lfilter([1.0], [1.0, -0.5], rng.standard_normal(n))
    return np.array([one, other, lfilter([1.0], [1.0, -1.6, 0.9], rng.standard_normal(n))])


@pytest.mark.parametrize("lags", [1, 4, 12])
def test_every_pair_is_statsmodels_test(lags):
    """Each F is that of statsmodels' sum-of-squares test of the pair, within 1 in 10,000."""
    signals = coupled(1)
    found = granger_f(signals, lags)
    for i in range(3):
        for j in (k for k in range(3) if k != i):
            with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                one = grangercausalitytests(np.column_stack((signals[j], signals[i])), [lags])
            assert found[i, j] == pytest.approx(one[lags][0]["ssr_ftest"][0], rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("first", [1, 2])
def test_pairs_of_the_first_signals_are_those_of_all_pairs(first):
    """Pairs of the first signals with the others have the same F as among all signals, and no other pair has an
    F."""
    whole, found = granger_f(coupled(4), 12), granger_f(coupled(4), 12, first)
    wanted = np.zeros((3, 3), dtype=bool)
    wanted[:first, first:] = wanted[first:, :first] = True
    assert found[wanted] == pytest.approx(whole[wanted], rel=1e-9)
    assert not found[~wanted].any()


def test_the_driving_signal_predicts_the_driven_one():
    """The driving signal predicts the driven one significantly, and the reverse prediction is not better than
    chance."""
    found = granger_f(coupled(2), 12)
    assert found[0, 1] > 50
    assert found[1, 0] < 3
    assert max(found[2, :2].max(), found[:2, 2].max()) < 3


def test_independent_pairs_follow_the_f_distribution():
    """Of independent pairs, 3 to 7 % exceed the F of 5 %."""
    over = []
    for seed in range(150):
        found = granger_f(np.random.default_rng(seed).standard_normal((3, 400)), 4)
        over += (found[~np.eye(3, dtype=bool)] > f_law.isf(0.05, 4, 400 - 4 - 9)).tolist()
    assert 0.03 < np.mean(over) < 0.07


@pytest.mark.parametrize("flat", [np.zeros(500), np.arange(500.0)])
def test_flat_signals_and_short_ones_predict_nothing(flat):
    """Constants, ramps and records that are too short for this number of constants give a finite F and no
    error."""
    noise = np.random.default_rng(3).standard_normal(500)
    assert np.isfinite(granger_f(np.array([flat, noise]), 12)).all()
    assert granger_f(np.array([noise[:60], noise[100:160]]), 12).max() == 0.0
