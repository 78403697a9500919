"""How well a valve fault followed by a lag explains PV from OP, judged by its innovations.

The model is y = c0 + c1 t + c2 decay + K x + noise with A(q) noise = innovation: the stem is a valve operator on
the recorded OP, x the response of a unit-gain lag with dead time, A(q) = 1 - ar1 q^-1 - ... an autoregression
that makes the residual white. An integrator is the lag whose time constant outlasts the window; then only gain over
time constant is known. Gain and the c are solved linearly, time constant and dead time are searched, the valve is
scanned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from identification.estimation.window import Stems, Window
from identification.models import Backlash, Fopdt, Stiction, Valve
from identification.record import Floats
from identification.simulation.lag import respond, unit_lag
from identification.simulation.valve import RESTS, first_slip, motion_of, stem_step


@dataclass(frozen=True, slots=True)
class ValveTrial:
    """Valve constants in the form the kernels use.

    breakaway, sliding [% OP]: (S + J)/2 and (S - J)/2; tolerance [% OP]: OP's turning that a sliding stem
    ignores, or HALTS or RESTS (valve.py).
    """

    breakaway: float = 0.0
    sliding: float = 0.0
    tolerance: float = RESTS

    @property
    def stickband(self) -> float:
        """S [% OP]; the width of the play where slip_jump is 0."""
        return self.breakaway + self.sliding

    @property
    def slip_jump(self) -> float:
        """J [% OP]."""
        return self.breakaway - self.sliding

    @property
    def valve(self) -> Valve:
        """The valve of models.py that these constants are: ideal, play or stick-slip."""
        if self.breakaway <= 0.0:
            return None
        if self.slip_jump <= 0.0:
            return Backlash(float(self.stickband))
        return Stiction(float(self.stickband), float(self.slip_jump), motion_of(self.tolerance))


IDEAL = ValveTrial()


def sticking(stickband: float, jump_share: float, tolerance: float = RESTS) -> ValveTrial:
    """Valve of stickband S [% OP] and slip jump J = jump_share S."""
    return ValveTrial(0.5 * stickband * (1 + jump_share), 0.5 * stickband * (1 - jump_share), tolerance)


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted model.

    gain [% PV/% OP], time_constant_s and dead_time_s [s], valve, sigma2 the innovations variance
    [% PV squared], count the samples judged, ar the noise model of single lags (noise.py), shape (p,), base
    the coefficients of 1, t, decay and the load's step, shape (4,).
    """

    gain: float
    time_constant_s: float
    dead_time_s: float
    valve: ValveTrial
    sigma2: float
    count: int
    ar: Floats
    base: Floats

    @property
    def log_likelihood(self) -> float:
        """Gaussian log likelihood of the innovations, up to a constant."""
        return -0.5 * self.count * math.log(self.sigma2)

    @property
    def slope(self) -> float:
        """Gain over time constant [% PV / (% OP s)]."""
        return self.gain / self.time_constant_s


@njit(cache=True)
def _resting_blocks(
    op: Floats, low: Floats, high: Floats, breakaway: float, sliding: float, factor: int
) -> Floats:
    """The same of a stem that rests after each move, where the direction of motion need not be remembered."""
    out = np.empty(low.size)
    stem = first_slip(op, breakaway, sliding)
    for k in range(low.size):
        if high[k] - stem <= breakaway and stem - low[k] <= breakaway:
            out[k] = stem
            continue
        total = 0.0
        for i in range(k * factor, (k + 1) * factor):
            gap = op[i] - stem
            if gap > breakaway:
                stem = op[i] - sliding
            elif gap < -breakaway:
                stem = op[i] + sliding
            total += stem
        out[k] = total / factor
    return out


@njit(cache=True)
def stem_blocks(
    op: Floats, low: Floats, high: Floats, breakaway: float, sliding: float, tolerance: float, factor: int
) -> Floats:
    """Stem behind OP as means of blocks, shape (n // factor,), of a valve with breakaway > 0.

    `low` and `high` are OP's extremes in each block: a stem at rest that lies within reach of both rests on.
    """
    if tolerance == RESTS:
        return _resting_blocks(op, low, high, breakaway, sliding, factor)
    out = np.empty(low.size)
    stem, moving, turned = first_slip(op, breakaway, sliding), 0.0, op[0]
    for k in range(low.size):
        if moving == 0.0 and high[k] - stem <= breakaway and stem - low[k] <= breakaway:
            out[k] = stem
            continue
        total = 0.0
        for i in range(k * factor, (k + 1) * factor):
            stem, moving, turned = stem_step(stem, moving, turned, op[i], breakaway, sliding, tolerance)
            total += stem
        out[k] = total / factor
    return out


@njit(cache=True)
def stem_behind(stems: Stems, breakaway: float, sliding: float, tolerance: float) -> Floats:
    """Stem less its mean [% OP] behind a valve's constants: the recorded one where there is one."""
    if breakaway <= 0.0:
        return stems.ideal
    if stems.recorded.size:
        return stems.recorded
    stem = stem_blocks(stems.op, stems.low, stems.high, breakaway, sliding, tolerance, stems.factor)
    return stem - stem.mean()


def stem_of(stems: Stems, valve: ValveTrial) -> Floats:
    """Stem less its mean [% OP], shape (m,), of the stems of a window."""
    found = stem_behind(stems, valve.breakaway, valve.sliding, valve.tolerance)
    return np.asarray(found, dtype=np.float64)


def residual(window: Window, fit: Fit) -> Floats:
    """PV less the response to the stem [% PV], shape (n,): load and noise, with the model's slow terms in it.

    In a fine window the response is stepped at the record's own interval and then averaged over blocks, as PV was.
    """
    stem = stem_of(window.stems, fit.valve)
    if window.fine:
        lag = unit_lag(
            fit.time_constant_s, fit.dead_time_s + window.half_block_s, window.dt_s / window.factor
        )
        x = respond(stem, lag, window.factor)
    else:
        x = respond(stem, unit_lag(fit.time_constant_s, fit.dead_time_s, window.dt_s))
    return window.centred - fit.gain * x


def process_of(window: Window, fit: Fit) -> Fopdt:
    """The process of a fit, its dead time in the record's own samples."""
    return Fopdt(fit.gain, fit.time_constant_s, fit.dead_time_s + window.half_block_s)


def slow_terms(window: Window, fit: Fit) -> Floats:
    """Mean, trend, decay and step of PV by a fit [% PV], shape (n,)."""
    n = window.y.size
    t = 2.0 * np.arange(n) / n - 1.0
    decay = np.exp(-np.arange(n) * window.dt_s / fit.time_constant_s)
    if fit.time_constant_s > 0.5 * window.duration_s:
        decay[:] = 0.0
    return np.asarray(fit.base[0] + fit.base[1] * t + fit.base[2] * decay + fit.base[3] * window.extra)


def disturbance(window: Window, fit: Fit) -> Floats:
    """PV less the whole model, slow terms included [% PV], shape (n,)."""
    return residual(window, fit) - slow_terms(window, fit)
