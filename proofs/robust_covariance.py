"""Is statsmodels' robust covariance enough for before/after? A comparison with blocks of days: false changes and
power.

python -m proofs.robust_covariance: hourly figures of two spans of seven days with a daily rhythm and days that drift.
They are unchanged or changed by a fifth. The table shows how often each method reports a change at 95 %. Prints the
table of robust_covariance.md.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import statsmodels.api as sm

from analyzer.comparison.block_bootstrap import Floats, Side, difference

DAYS, HOURS = 7, 24
DRIFTS = (0.0, 0.4, 0.8)
"""Correlation of one day with the next."""
MOVE = 0.2
"""A true change of the mean."""
SERIES = 400
LEVEL = 0.95


def hours(rng: np.random.Generator, drift: float) -> Floats:
    """Hourly figures of both spans, shape (2 DAYS HOURS,): mean 1; days scatter by 8 %, hours by 10 %."""
    days = np.zeros(2 * DAYS)
    level = rng.normal()
    for k in range(days.size):
        level = drift * level + np.sqrt(1 - drift**2) * rng.normal()
        days[k] = level
    rhythm = 0.1 * np.sin(2 * np.pi * np.arange(2 * DAYS * HOURS) / HOURS)
    hourly = np.zeros(2 * DAYS * HOURS)
    for k in range(1, hourly.size):
        hourly[k] = 0.5 * hourly[k - 1] + rng.normal(0, 0.1)
    return 1.0 + 0.08 * np.repeat(days, HOURS) + rhythm + hourly


def by_blocks(y: Floats) -> bool:
    """The method of this project: blocks of days, with an interval widened by Student's t and by the possible drift
    between days."""
    one = np.ones(DAYS * HOURS)
    found = difference(Side(y[: one.size], one), Side(y[one.size :], one), LEVEL)
    return not found.low <= 0.0 <= found.high


def by_hac(lags: int) -> Callable[[Floats], bool]:
    """Least squares of a step with the covariance of Newey and West, statsmodels."""

    def called(y: Floats) -> bool:
        step = np.repeat([0.0, 1.0], DAYS * HOURS)
        fit = sm.OLS(y, sm.add_constant(step)).fit(
            cov_type="HAC", cov_kwds={"maxlags": lags, "use_correction": True}, use_t=True
        )
        return bool(fit.pvalues[1] < 1 - LEVEL)

    return called


def by_daily_glsar(y: Floats) -> bool:
    """Daily means with a first-order autoregression between days, statsmodels."""
    daily = y.reshape(-1, HOURS).mean(axis=1)
    fit = sm.GLSAR(daily, sm.add_constant(np.repeat([0.0, 1.0], DAYS)), 1).iterative_fit(8)
    return bool(fit.pvalues[1] < 1 - LEVEL)


WAYS = {
    "blocks of days (here)": by_blocks,
    "HAC, 24 lags": by_hac(24),
    "HAC, 72 lags": by_hac(72),
    "GLSAR on daily means": by_daily_glsar,
}


def table() -> str:
    """Shares reported as changed, by method and drift, unchanged and changed."""
    lines = [
        "| way | " + " | ".join(f"unchanged, days {d:g}" for d in DRIFTS) + " | moved by a fifth, days 0 |",
        "|---|" + "---|" * (len(DRIFTS) + 1),
    ]
    for name, way in WAYS.items():
        cells = []
        for drift, move in [*((d, 0.0) for d in DRIFTS), (0.0, MOVE)]:
            rng = np.random.default_rng(7)
            moved = np.repeat([0.0, move], DAYS * HOURS)
            calls = [way(hours(rng, drift) + moved) for _ in range(SERIES)]
            cells.append(f"{100 * np.mean(calls):.1f} %")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    print(table())
