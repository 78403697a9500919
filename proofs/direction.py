"""Which of two loops moves first, by lag and by Granger causality: python -m proofs.direction [--plants 30]

The pairs are a source and a follower that shows the oscillation, of coupled plants (proofs/coupled). Granger's test
(statsmodels) measures whether the past of one error improves the prediction of the other. The errors have twelve
samples a period, and the test has lags of one period; the direction with the larger F is the answer. The lag is that
of the plant-wide pass. Writes proofs/direction.md.
"""

from __future__ import annotations

import contextlib
import io
import warnings

import numpy as np
from statsmodels.tsa.stattools import grangercausalitytests

from identification.signals.cross_spectrum import Delay, band, lag, tapered
from identification.signals.spectrum import spectrum
from proofs.common import command, command_line, publish, table
from proofs.coupled.draw import draw

A_PERIOD = 12
"""Samples a period for Granger's test."""
SHOWS = 1.25


def granger(cause: np.ndarray, effect: np.ndarray) -> float:
    """F of Granger's test: whether the past of one error predicts the other."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = grangercausalitytests(np.column_stack((effect, cause)), [A_PERIOD])
    return float(found[A_PERIOD][0]["ssr_ftest"][0])


def thinned(x: np.ndarray, samples: float) -> np.ndarray:
    """Means of `samples` samples."""
    edges = np.arange(0, x.size, max(samples, 1.0)).astype(int)
    return np.add.reduceat(x, edges) / np.diff(np.append(edges, x.size))


def lead(one: np.ndarray, other: np.ndarray, dt_s: float, period_s: float) -> Delay:
    """Lag of the second error after the first."""
    x, y = spectrum(one, dt_s), spectrum(other, dt_s)
    low, high, _ = band(x.duration_s / period_s)
    cut = slice(low - 1, high - 1)
    return lag(tapered(x.lines)[cut], tapered(y.lines)[cut], x.duration_s, max(4 * period_s, 900.0))


def main() -> None:
    """Draw the plants, apply both methods, count."""
    options = command_line(__doc__, plants=30, seed=3000)
    by_granger, by_lag, sure = [], [], []
    for seed in range(options.seed, options.seed + options.plants):
        drawn = draw(seed, 30, hours=8.0)
        error = {x.name: x.sp - x.pv for x in drawn.loops}
        for name, t in drawn.truth.items():
            if t["role"] != "follower" or t["swell"] < SHOWS or name == t["root"]:
                continue
            period = float(drawn.truth[t["root"]]["period_s"])
            a, b = error[t["root"]], error[name]
            few = period / A_PERIOD / drawn.step_s
            x, y = thinned(a, few), thinned(b, few)
            if period <= 0 or x.size < 20 * A_PERIOD:
                continue
            by_granger.append(granger(x, y) > granger(y, x))
            found = lead(a, b, drawn.step_s, period)
            by_lag.append(found.lag_s > 0)
            sure.append(abs(found.lag_s) > 2 * found.deviation_s)
    significant = np.array(sure)
    right = {
        f"Granger's F, {A_PERIOD} samples a period": by_granger,
        "sign of the lag": by_lag,
        f"… of the {significant.sum()} that exceed two deviations": np.array(by_lag)[significant],
    }
    rows = ((way, f"{100 * np.mean(found):.0f} %") for way, found in right.items())
    shown = f"{command(__file__, plants=options.plants, seed=options.seed)}: {significant.size} pairs."
    publish(__file__, "Who moves first", shown, table("who is first, by | right", rows, numbers=True))


if __name__ == "__main__":
    main()
