"""How well a valve fault followed by a lag explains PV from OP, judged by its innovations.

The model is y = c0 + c1 t + c2 decay + K x + noise with A(q) noise = innovation: the stem is a valve operator on
the recorded OP, x the response of a unit-gain lag with dead time, A(q) = 1 - ar1 q^-1 - ... an autoregression
that makes the residual white. An integrator is the lag whose time constant outlasts the window; then only gain over
time constant is known. Gain and the c are solved linearly, time constant and dead time are searched, the valve is
scanned.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from identification.estimation.descent import nats
from identification.estimation.window import Stems, Window
from identification.models import Fopdt
from identification.record import Floats
from identification.simulation.valve import RESTS, StemLaw, first_slip, stem_step


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted model.

    gain [% PV/% OP], time_constant_s and dead_time_s [s], valve, sigma2 the innovations variance
    [% PV squared], count the samples judged, ar the noise model of single lags (noise.py), shape (p,), base
    the coefficients of 1, t, decay and the load's step, shape (4,), window what it is fitted to.
    """

    gain: float
    time_constant_s: float
    dead_time_s: float
    valve: StemLaw
    sigma2: float
    count: int
    ar: Floats
    base: Floats
    window: Window = field(repr=False)

    @property
    def process(self) -> Fopdt:
        """The process, its dead time in the record's own samples."""
        return Fopdt(self.gain, self.time_constant_s, self.dead_time_s + self.window.half_block_s)

    @property
    def log_likelihood(self) -> float:
        """Gaussian log likelihood of the innovations, up to a constant."""
        return -nats(self.count, self.sigma2, 1.0)

    @property
    def slope(self) -> float:
        """Gain over time constant [% PV / (% OP s)]."""
        return self.gain / self.time_constant_s


@njit(cache=True)
def _resting_blocks(s: Stems, law: StemLaw) -> Floats:
    """The same of a stem that rests after each move, where the direction of motion need not be remembered."""
    out = np.empty(s.low.size)
    stem = first_slip(s.op, law)
    for k in range(s.low.size):
        if s.high[k] - stem <= law.breakaway and stem - s.low[k] <= law.breakaway:
            out[k] = stem
            continue
        total = 0.0
        for i in range(k * s.factor, (k + 1) * s.factor):
            gap = s.op[i] - stem
            if gap > law.breakaway:
                stem = s.op[i] - law.sliding
            elif gap < -law.breakaway:
                stem = s.op[i] + law.sliding
            total += stem
        out[k] = total / s.factor
    return out


@njit(cache=True)
def stem_blocks(s: Stems, law: StemLaw) -> Floats:
    """Stem behind OP as means of blocks, shape (n // factor,), of a valve with breakaway > 0.

    A stem at rest within reach of OP's extremes in a block rests on.
    """
    if law.tolerance == RESTS:
        return _resting_blocks(s, law)  # type: ignore[no-any-return]
    out = np.empty(s.low.size)
    stem = (first_slip(s.op, law), 0.0, s.op[0])
    for k in range(s.low.size):
        if stem[1] == 0.0 and s.high[k] - stem[0] <= law.breakaway and stem[0] - s.low[k] <= law.breakaway:
            out[k] = stem[0]
            continue
        total = 0.0
        for i in range(k * s.factor, (k + 1) * s.factor):
            stem = stem_step(stem, s.op[i], law)
            total += stem[0]
        out[k] = total / s.factor
    return out


@njit(cache=True)
def stem_of(s: Stems, law: StemLaw) -> Floats:
    """Stem less its mean [% OP], shape (m,), behind a valve: the recorded one where there is one."""
    if law.breakaway <= 0.0:
        return s.ideal
    if s.recorded.size:
        return s.recorded
    stem = stem_blocks(s, law)
    return stem - stem.mean()
