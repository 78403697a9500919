"""The noise model against statsmodels: an autoregression with an input, and the whiteness of its innovations."""

from __future__ import annotations

import numpy as np
import pytest
from statsmodels.stats.diagnostic import acorr_ljungbox
from statsmodels.tsa.ar_model import AutoReg

from identification.estimation.noise import arx_noise, fitted, lag_means, whitened

N, ORDER = 4000, 4
POLES = np.array([1.2, -0.5, 0.1, 0.05])


def coloured(seed: int) -> np.ndarray:
    """An autoregression of fourth order, shape (4000,)."""
    rng = np.random.default_rng(seed)
    x = np.zeros(N)
    for k in range(ORDER, N):
        x[k] = POLES @ x[k - ORDER : k][::-1] + rng.standard_normal()
    return x


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_free_model_is_that_of_statsmodels(seed: int) -> None:
    """The coefficients of PV agree with AutoReg with the input's lags within 0.002."""
    u = np.random.default_rng(seed + 10).standard_normal(N)
    y = coloured(seed) + np.convolve(u, [0.0, 0.5, 0.3])[:N]
    past = np.column_stack([np.roll(u, i + 1) for i in range(ORDER)])
    theirs = AutoReg(y[ORDER:], ORDER, exog=past[ORDER:]).fit().params[1 : ORDER + 1]
    ours = arx_noise(y[ORDER:], u[ORDER:], np.ones(N - ORDER, dtype=bool), ORDER, ORDER)
    assert ours == pytest.approx(theirs, abs=2e-3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_single_lags_are_an_autoregression_with_white_innovations(seed: int) -> None:
    """The noise model of single lags equals AutoReg without a constant. Its innovations pass the test of Ljung
    and Box, which the coloured series fails."""
    x, edges = coloured(seed), np.arange(ORDER + 1)
    columns = lag_means(x, edges)
    ar, _ = fitted(columns[:, ORDER:], x[ORDER:])
    assert ar == pytest.approx(AutoReg(x, ORDER, trend="n").fit().params, abs=1e-6)
    white = whitened(x, ar, edges)[ORDER:]
    assert float(acorr_ljungbox(white, [20], model_df=ORDER)["lb_pvalue"].iloc[0]) > 0.01
    assert float(acorr_ljungbox(x, [20])["lb_pvalue"].iloc[0]) < 1e-6
