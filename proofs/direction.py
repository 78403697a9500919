"""Which of two loops moves first, by lag and by Granger causality: python -m proofs.direction [--plants 30]

Pairs of a source and a follower that shows, of coupled plants (proofs/coupled). Granger's test (statsmodels) asks
whether the past of one error helps to foresee the other, both at twelve samples a period and with lags of one period;
it is read by which way has the larger F. The lag is that of the plant-wide pass. Writes proofs/direction.md.
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
"""Samples a period that Granger's test is given."""
SHOWS = 1.25


def granger(cause: np.ndarray, effect: np.ndarray) -> float:
    """F of one error's past in foreseeing another."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = grangercausalitytests(np.column_stack((effect, cause)), [A_PERIOD])
    return float(found[A_PERIOD][0]["ssr_ftest"][0])


def thinned(x: np.ndarray, samples: float) -> np.ndarray:
    """Means of so many samples."""
    edges = np.arange(0, x.size, max(samples, 1.0)).astype(int)
    return np.add.reduceat(x, edges) / np.diff(np.append(edges, x.size))


def lead(one: np.ndarray, other: np.ndarray, dt_s: float, period_s: float) -> Delay:
    """Lag of a second error behind a first one."""
    x, y = spectrum(one, dt_s), spectrum(other, dt_s)
    low, high, _ = band(x.duration_s / period_s)
    cut = slice(low - 1, high - 1)
    return lag(tapered(x.lines)[cut], tapered(y.lines)[cut], x.duration_s, max(4 * period_s, 900.0))


def main() -> None:
    """Draw, ask both, count."""
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
    told = np.array(sure)
    right = {
        f"Granger's F, {A_PERIOD} samples a period": by_granger,
        "sign of the lag": by_lag,
        f"… of the {told.sum()} that are over two deviations": np.array(by_lag)[told],
    }
    rows = ((way, f"{100 * np.mean(found):.0f} %") for way, found in right.items())
    shown = f"{command(__file__, plants=options.plants, seed=options.seed)}: {told.size} pairs."
    publish(__file__, "Who moves first", shown, table("who is first, by | right", rows, numbers=True))


if __name__ == "__main__":
    main()
