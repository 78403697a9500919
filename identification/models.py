"""The parts of a loop: process, valve, controller; and the estimate of a number.

Units inside the project: seconds, percent of PV span, percent of OP span. Gains are % PV per % OP.
Signs: P and I act on e = SP - PV; kp > 0 means that OP falls when PV rises.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number with its 90 % interval, both in the same unit.

    `value` is the point estimate, `low` and `high` the interval's ends.
    """

    value: float
    low: float
    high: float
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Fopdt:
    """First order plus dead time, K exp(-L s)/(T s + 1).

    gain [% PV / % OP], time_constant_s [s] > 0, dead_time_s [s] >= 0.
    """

    gain: float
    time_constant_s: float
    dead_time_s: float

    @property
    def slope(self) -> float:
        """Gain over time constant [% PV / (% OP s)]: the equivalent integrator at high frequency."""
        return self.gain / self.time_constant_s


@dataclass(frozen=True, slots=True)
class Integrator:
    """Integrating process, k exp(-L s)/s. slope [% PV / (% OP s)], dead_time_s [s] >= 0."""

    slope: float
    dead_time_s: float


Process = Fopdt | Integrator


class Motion(StrEnum):
    """Motion of a stem after it starts to slip."""

    RESTS = "rests"
    """It rests again at once (He, Wang, Pottmann, Qin 2007)."""
    HALTS = "halts"
    """It follows OP until OP reverses or stops (Kano 2004); also true of dry friction."""
    SLIDES = "slides"
    """It follows OP until OP reverses (Choudhury, Thornhill, Shah 2005)."""


@dataclass(frozen=True, slots=True)
class Backlash:
    """Backlash of full width `width` [% OP] (d of the describing function is half of it)."""

    width: float


@dataclass(frozen=True, slots=True)
class Stiction:
    """Two-parameter stick-slip: stickband S [% OP] on reversal, slip jump J [% OP] at the start of a slip.

    S is the total travel of OP after a reversal before the stem moves (deadband plus stickband); 0 <= J <= S in
    plants, J = 0 is backlash (Choudhury, Thornhill, Shah 2005). `motion` determines the motion after a jump.
    """

    stickband: float
    slip_jump: float
    motion: Motion = Motion.RESTS


Valve = Backlash | Stiction | None


class Form(StrEnum):
    """Form of the controller's law."""

    IDEAL = "ideal"
    SERIES = "series"
    PARALLEL = "parallel"


class ErrorForm(StrEnum):
    """The part of the error on which a controller acts."""

    LINEAR = "linear"
    SQUARED = "squared"
    """e abs(e) / 100: the gain grows with the error, and is kp at an error of 100 %."""


@dataclass(frozen=True, slots=True)
class Pid:
    """A PID controller in percent of spans and seconds, ideal form, as simulated by simulation/pi.py.

    kp [% OP / % PV] (negative: direct acting; 0: integral only, whose ti_s is then % PV s per % OP, negative where it
    is direct acting), ti_s [s] (inf or 0: no integral), td_s [s], scan_s [s] the scan period (0: continuous), op_lo
    and op_hi [% OP] its output limits. td_filter : N of the derivative's filter, whose time constant is Td / N (0 or
    inf: none). pv_filter_s : time constant of the filter of PV before the law [s]. gap : size of the error [% PV]
    inside which the gain is gap_gain times the gain outside [-]; the law has no jump at its edge. error_form : as
    above. op_rate : largest rate of OP [% OP/s] (inf or 0: no limit). sp_weight and td_sp_weight : set point weights
    of gain and derivative [-]. gain_share : factor of the stated gain in kp, 1 but where a schedule changes it [-].
    """

    kp: float
    ti_s: float
    td_s: float = 0.0
    scan_s: float = 1.0
    op_lo: float = 0.0
    op_hi: float = 100.0
    td_filter: float = 8.0
    pv_filter_s: float = 0.0
    gap: float = 0.0
    gap_gain: float = 0.0
    error_form: ErrorForm = ErrorForm.LINEAR
    op_rate: float = math.inf
    sp_weight: float = 1.0
    td_sp_weight: float = 0.0
    gain_share: float = 1.0

    @property
    def ki(self) -> float:
        """Integral gain [% OP / (% PV s)], 0 where the integral is off."""
        return (self.kp or 1.0) / self.ti_s if self.ti_s and math.isfinite(self.ti_s) else 0.0

    @property
    def sign(self) -> float:
        """1 where OP falls when PV rises, else -1: the sign of the gain, or of the integral where that is alone."""
        return math.copysign(1.0, self.kp or self.ti_s)

    @property
    def slope_filter_s(self) -> float:
        """Time constant of the derivative's filter [s], 0 for none."""
        return self.td_s / self.td_filter if self.td_filter else 0.0


@dataclass(frozen=True, slots=True)
class Loop:
    """A closed loop: controller -> valve -> process."""

    process: Process
    controller: Pid
    valve: Valve = None
