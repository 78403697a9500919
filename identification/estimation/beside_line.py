"""Valve backlash in a loop whose cycle has an external cause, identified from the signal outside the cycle's band.

A load with a spectral line drives PV and, through the controller, OP at one frequency. At that frequency OP follows
the load, so neither process nor valve can be identified from it. A narrow band about the frequency is removed from PV
and from the stem behind each valve; a process and a notch commute. A stem with backlash keeps its harmonics and its
other motion, which differ from those of an ideal valve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.evidence import Trials, agreement_of
from identification.estimation.noise import every_lag, fitted, generic_noise, judged, lag_means
from identification.estimation.search import Dynamics, Prepared, level_of, prepare, search, starts
from identification.estimation.window import Fit, Window, stem_of
from identification.limits import FIT
from identification.record import Floats
from identification.signals.filters import notch
from identification.signals.robust import clipped_gain
from identification.signals.turns import turns_of
from identification.simulation.lag import respond, unit_lag
from identification.simulation.valve import IDEAL, StemLaw, sticking

SHARES = np.geomspace(0.05, 0.95, 20)
"""Backlash widths of the first scan, as shares of the range of OP in a cycle."""
NEAR = (0.9, 1.0, 1.1)
"""Factors of the second scan about the best width."""
FOLLOWED, ROUNDS = 4, 3
"""Number of widths that are refined, and alternations of process and noise model for each."""


@dataclass(frozen=True, slots=True)
class BesideLine:
    """The backlash that best explains the signal outside the line: its fit, the gain in log likelihood over an ideal
    valve [nat] with outliers limited, and the agreement of the half-cycles."""

    play: Fit
    evidence: float
    trials: Trials | None


@dataclass(frozen=True, slots=True)
class _Explained:
    """A valve with process and noise model: innovations and the mask of those that count."""

    valve: StemLaw
    dynamics: Dynamics
    beta: Floats
    ar: Floats
    sigma2: float
    e: Floats
    counts: np.ndarray


def beside_line(linear: Fit, play: Fit, period_s: float) -> BesideLine:
    """Backlash outside a line of a period [s]. linear, play : fits of the whole record, used as starts."""
    window = linear.window
    begins = [(f.time_constant_s, max(f.dead_time_s, 0.0)) for f in (linear, play)]
    begins += starts(window, period_s)
    period = period_s / window.dt_s
    ideal = _begun(window, IDEAL, period, begins)
    worn = [_begun(window, sticking(float(s) * window.reach, 0.0), period, begins) for s in SHARES]
    worn = sorted(worn, key=lambda x: x.sigma2)[:FOLLOWED]
    sound = min(
        (_settled(window, replace(x, valve=IDEAL), period) for x in (ideal, worn[0])), key=lambda x: x.sigma2
    )
    wider = (replace(x, valve=sticking(f * x.valve.stickband, 0.0)) for x in worn for f in NEAR)
    best = min((_settled(window, x, period) for x in wider), key=lambda x: x.sigma2)
    gained = np.zeros(best.e.size)
    both = best.counts & sound.counts
    gained[both] = clipped_gain(best.e[both], sound.e[both])
    at = turns_of(window.op_blocks, period)
    agree = agreement_of(np.add.reduceat(gained, at)[:-1]) if at.size > 4 else None
    return BesideLine(_as_fit(best, window), float(gained.sum()), agree)


def _begun(window: Window, valve: StemLaw, period: float, begins: list[Dynamics]) -> _Explained:
    """The best process behind a valve under the generic noise model."""
    prepared = prepare(window, valve, generic_noise(), period)
    return _explained(prepared, valve, *search(prepared, begins, 3))


def _settled(window: Window, x: _Explained, period: float) -> _Explained:
    """Fit process and noise model alternately from a start."""
    stem = notch(stem_of(window.stems_in_blocks, x.valve), period, FIT.notch_width)
    y = notch(window.centred, period, FIT.notch_width)
    counts = judged(window.usable, FIT.ar_order)
    counts[: int(period) + FIT.ar_order] = False
    for _ in range(ROUNDS):
        left = y - _simulated(stem, x.dynamics, x.beta, window.dt_s)
        columns = lag_means(left, every_lag(FIT.ar_order))
        ar, _ = fitted(columns * counts, left * counts)
        prepared = prepare(window, x.valve, ar, period)
        x = _explained(prepared, x.valve, *search(prepared, [x.dynamics], 3))
    return x


def _simulated(stem: Floats, dynamics: Dynamics, beta: Floats, dt_s: float) -> Floats:
    """Simulated PV: response, mean, trend and decay, shape of the stem."""
    n = stem.size
    slow = beta[1] + beta[2] * (2.0 * np.arange(n) / n - 1.0)
    decay = beta[3] * np.exp(-dt_s / dynamics[0] * np.arange(n))
    return np.asarray(beta[0] * respond(stem, unit_lag(*dynamics, dt_s)) + slow + decay)


def _explained(
    p: Prepared, valve: StemLaw, dynamics: Dynamics, sigma2: float, _: int, beta: Floats
) -> _Explained:
    level = level_of(p.pv.ar)
    white = beta * np.array([1.0, level, level, 1.0])
    counts = p.pv.rows[1] > 0
    e = np.where(counts, p.pv.rows[0] - _simulated(p.stem, dynamics, white, p.pv.dt_s), 0.0)
    return _Explained(valve, dynamics, beta, p.pv.ar, sigma2, e, counts)


def _as_fit(x: _Explained, window: Window) -> Fit:
    base = np.concatenate((x.beta[1:], [0.0]))
    t, dead = x.dynamics
    return Fit(float(x.beta[0]), t, dead, x.valve, x.sigma2, int(x.counts.sum()), x.ar, base, window)
