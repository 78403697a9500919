"""What a ringing loop tells of its settings by itself: at the period at which it rings its response is nearly -1.

Ziegler and Nichols (1942) take settings from that point alone. It holds whatever the process is, also where a filter,
a slow scan or a limit that nobody stated makes an identified model wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from identification.models import Integrator, Loop, Pid
from identification.record import Floats
from identification.signals.spectrum import Spectrum, tapered_power
from tuning.frequency_response import controller_response, integral_s, loop_response

PER_INTEGRAL = 1.2
"""Period of the ringing over the integral time of a PI controller (Ziegler, Nichols 1942)."""
BINS = 300
"""Bins of the error's spectrum, of equal ratio; ours: over five decades they are 4 % wide."""


@dataclass(frozen=True, slots=True)
class Rung:
    """What was seen of a ringing loop: its period [s], and the power of its error [% PV squared, to a factor] at some
    frequencies omega [rad/s], shape (m,) each."""

    period_s: float
    omega: Floats
    power: Floats


def rung(period_s: float, error: Spectrum) -> Rung:
    """What the spectrum of the error shows of a loop that rings at a period [s]."""
    power = tapered_power(error)[1:]
    omega = 2.0 * math.pi / error.duration_s * np.arange(1, power.size + 1)
    bins = (BINS * np.log(omega / omega[0]) / max(math.log(omega[-1] / omega[0]), 1e-9)).astype(np.int64)
    in_bins, weighted = (np.asarray(np.bincount(bins, x), np.float64) for x in (power, power * omega))
    full = in_bins > 0.0
    return Rung(period_s, weighted[full] / in_bins[full], in_bins[full])


def at_period(controller: Pid, period_s: float) -> complex:
    """A controller's response at a period [s], [% OP / % PV]."""
    return complex(controller_response(controller, np.array([2.0 * math.pi / period_s]))[0])


def sensitivity_at(old: Pid, new: Pid, period_s: float) -> float:
    """Sensitivity that new settings leave at the period at which the loop rings with the old ones [-]."""
    return 1.0 / max(abs(1.0 - at_period(new, period_s) / at_period(old, period_s)), 1e-9)


def from_ringing(old: Pid, period_s: float, share: float) -> Pid:
    """Settings that keep a share of the loop's present response at the period at which it rings [s].

    The integral time grows up to that period over 1.2, off where it is off; where that is not enough Kp falls.
    """

    def kept(ti_s: float) -> float:
        return abs(at_period(replace(old, ti_s=ti_s), period_s) / at_period(old, period_s))

    ti_s = max(integral_s(old), period_s / PER_INTEGRAL)
    if kept(ti_s) < share:
        return replace(old, ti_s=float(brentq(lambda x: kept(x) - share, integral_s(old), ti_s)))
    return replace(old, ti_s=ti_s, kp=old.kp * share / kept(ti_s))


def error_ratio(old: Pid, new: Pid, seen: Rung) -> float:
    """Error of new settings over the present one [-], by the spectrum of the recorded error.

    The error is the load or the set point times 1/(1 + L), so that each of its frequencies changes by
    (1 + L)/(1 + L'). Well below the ringing both responses are large and the ratio is that of the controllers; at the
    ringing L is -1. Between, the process counts as the integrator with dead time that gives -1 there.
    """
    laws = [replace(c, scan_s=0.0) for c in (old, new)]
    there, ringing = at_period(laws[0], seen.period_s), 2.0 * math.pi / seen.period_s
    dead_time_s = max(0.5 * math.pi + float(np.angle(there)), 0.0) / ringing
    process = Integrator(ringing / abs(there), dead_time_s)
    before, after = (1.0 + loop_response(Loop(process, c), seen.omega) for c in laws)
    ratio = float(np.sum(seen.power * np.abs(before / after) ** 2)) / max(float(np.sum(seen.power)), 1e-300)
    return math.sqrt(ratio)
