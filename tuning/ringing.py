"""Settings from the ringing of a loop alone: at the ringing period the loop response is nearly -1.

Ziegler and Nichols (1942) derive settings from that point alone. It is valid for any process, also where an unstated
filter, slow scan or limit makes an identified model wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from identification.models import Integrator, Loop, Pid, Process
from identification.record import Floats
from identification.signals.spectrum import Spectrum, tapered_power
from tuning.frequency_response import controller_response, integral_s, loop_response

PER_INTEGRAL = 1.2
"""Period of the ringing over the integral time of a PI controller (Ziegler, Nichols 1942)."""
TIMES, RAISED = 9, 2.0
"""Number of integral times tried, and factor by which the gain may rise at most [-]; for a level, doubling both Kp
and Ti doubles the damping and keeps Ti/Kp, to which the error under a slow load is proportional."""
BINS = 300
"""Bins of the error's spectrum, of equal ratio; ours: over five decades their width is 4 %."""


@dataclass(frozen=True, slots=True)
class ObservedRinging:
    """Observed ringing: its period [s], and the power of the error [% PV squared, to a factor] at some frequencies
    omega [rad/s], shape (m,) each."""

    period_s: float
    omega: Floats
    power: Floats


def observed_ringing(period_s: float, error: Spectrum) -> ObservedRinging:
    """The observed ringing from the spectrum of the error and the period [s]."""
    power = tapered_power(error)[1:]
    omega = 2.0 * math.pi / error.duration_s * np.arange(1, power.size + 1)
    bins = (BINS * np.log(omega / omega[0]) / max(math.log(omega[-1] / omega[0]), 1e-9)).astype(np.int64)
    in_bins, weighted = (np.asarray(np.bincount(bins, x), np.float64) for x in (power, power * omega))
    full = in_bins > 0.0
    return ObservedRinging(period_s, weighted[full] / in_bins[full], in_bins[full])


def at_period(controller: Pid, period_s: float) -> complex:
    """A controller's response at a period [s], [% OP / % PV]."""
    return complex(controller_response(controller, np.array([2.0 * math.pi / period_s]))[0])


def sensitivity_at(old: Pid, new: Pid, period_s: float) -> float:
    """Sensitivity under new settings at the period of the ringing with the old ones [-]."""
    return 1.0 / max(abs(1.0 - at_period(new, period_s) / at_period(old, period_s)), 1e-9)


def process_of(old: Pid, period_s: float) -> Integrator:
    """The integrator with dead time that rings at a period [s] with these settings: above that frequency its phase
    decreases faster than that of a lag with dead time through the same point."""
    there, ringing = at_period(old, period_s), 2.0 * math.pi / period_s
    sign = old.sign  # a direct-acting controller has a process of the opposite sign
    dead_time_s = max(0.5 * math.pi + float(np.angle(sign * there)), 0.0) / ringing
    return Integrator(sign * ringing / abs(there), dead_time_s)


def from_ringing(old: Pid, period_s: float, share: float) -> list[Pid]:
    """Settings that keep a share of the loop's present response at the ringing period [s].

    The integral time is raised up to that period over 1.2, unless it is longer or off. Kp follows; it rises by at
    most RAISED if the integral time caused the ringing. An integral alone is made slower.
    """
    if old.kp == 0.0:
        return [replace(old, ti_s=old.ti_s / share)]
    longest = max(integral_s(old), period_s / PER_INTEGRAL)
    times = np.geomspace(integral_s(old), longest, TIMES) if longest > integral_s(old) else [old.ti_s]
    made = [replace(old, ti_s=float(ti)) for ti in times]
    kept = (share * abs(at_period(old, period_s) / at_period(new, period_s)) for new in made)
    return [replace(new, kp=old.kp * k) for new, k in zip(made, kept, strict=True) if k <= RAISED]


def error_ratio(old: Pid, new: Pid, seen: ObservedRinging, process: Process | None = None) -> float:
    """Error of new settings over the present one [-], by the spectrum of the recorded error.

    The error is the load or the set point times 1/(1 + L), so each of its frequencies changes by (1 + L)/(1 + L').
    Well below the ringing both responses are large and the ratio is that of the controllers; at the ringing L is -1.
    In between, the process is taken as the integrator with dead time that gives -1 there, unless it is given.
    """
    laws = [replace(c, scan_s=0.0) for c in (old, new)]
    process = process or process_of(laws[0], seen.period_s)
    before, after = (1.0 + loop_response(Loop(process, c), seen.omega) for c in laws)
    ratio = float(np.sum(seen.power * np.abs(before / after) ** 2)) / max(float(np.sum(seen.power)), 1e-300)
    return math.sqrt(ratio)
