"""The loop without its valve: frequency response, stability, sensitivity; dead time and scan are exact."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numba import njit

from identification.models import Fopdt, Integrator, Loop, Pid, Process
from identification.record import Floats, Mask
from identification.simulation.closed_loop import scan_step
from identification.simulation.lag import discretize
from identification.simulation.pi import kept
from tuning.describing import Complexes

LOWEST = 1e-6
"""Lowest frequency of the grid, relative to that of the slowest of time constant, integral time and dead time."""
POINTS, LOOKED_AT = 900, 400
"""Frequencies of a grid, and of the grid for the sensitivity."""
CIRCLE = 500
"""Points of the half circle for the stability test, besides eight for each scan of dead time."""
MOST_DELAY = 4000
"""Largest number of scans of dead time in the stability test [-]; ours: above it a scan of that share of the dead
time is used, which shifts the phase by 1/8000 of the dead time's own, so that no grid grows with the data.
"""


NO_GAIN = 1e-9
"""Gain as which an integral alone is calculated [% OP / % PV]: its response is then exact to the ninth digit."""


def integral_s(controller: Pid) -> float:
    """Integral time [s], inf where the integral is off (given as 0 or inf)."""
    return controller.ti_s if controller.ti_s > 0 else math.inf


def rejects_s(controller: Pid) -> float:
    """Integral of the error after a step of the load at OP, over the step [s % PV / % OP]: Ti/abs(Kp), inf without
    integral action."""
    return 1.0 / abs(controller.ki) if controller.ki else math.inf


def with_gain(controller: Pid) -> Pid:
    """A controller with integral action alone as one with negligible gain; any other unchanged."""
    if controller.kp != 0.0:
        return controller
    return replace(controller, kp=controller.sign * NO_GAIN, ti_s=NO_GAIN * abs(controller.ti_s))


def _rate(controller: Pid) -> float:
    """1/Ti [1/s], 0 where the integral is off."""
    return 1.0 / integral_s(controller)


def process_response(process: Process, scan_s: float, omega: Floats) -> Complexes:
    """G [% PV / % OP] at omega [rad/s], shape (m,): behind the scan's zero-order hold, exact, or continuous where
    scan_s is 0."""
    if scan_s > 0:
        d = discretize(process, scan_s)
        back = np.exp(-1j * omega * scan_s)
        return (d.now + d.before * back) * back ** (d.delay + 1) / (1.0 - d.pole * back)
    s = 1j * omega
    late = np.exp(-s * process.dead_time_s)
    if isinstance(process, Integrator):
        return process.slope * late / s
    return process.gain * late / (process.time_constant_s * s + 1.0)


def controller_response(controller: Pid, omega: Floats) -> Complexes:
    """C [% OP / % PV] at omega [rad/s], shape (m,), with its filters and without a gap: the velocity form with
    backward Euler at its scan, or the PID with a filtered derivative, continuous, where scan_s is 0."""
    c, h = with_gain(controller), controller.scan_s
    s = (1.0 - np.exp(-1j * omega * h)) / h if h > 0 else 1j * omega
    slope = c.td_s * s / (1.0 + c.slope_filter_s * s)
    return np.asarray(c.kp * (1.0 + _rate(c) / s + slope) / (1.0 + c.pv_filter_s * s), np.complex128)


def loop_response(loop: Loop, omega: Floats) -> Complexes:
    """G C at omega [rad/s], shape (m,), without the valve."""
    c = loop.controller
    return process_response(loop.process, c.scan_s, omega) * controller_response(c, omega)


def slowest_s(loop: Loop) -> float:
    """The slowest time of the loop [s]: time constant, finite integral time, filter of PV, dead time and scan; with
    integral action alone also the time in which it corrects an error before a process without lag."""
    c, ti = loop.controller, integral_s(with_gain(loop.controller))
    times = [loop.process.dead_time_s, c.scan_s, c.pv_filter_s, ti if math.isfinite(ti) else 0.0]
    if isinstance(loop.process, Fopdt):
        alone_s = rejects_s(c) / max(abs(loop.process.gain), 1e-12) if c.kp == 0.0 else 0.0
        times += [loop.process.time_constant_s, alone_s]
    return max(times)


def spaced(low: float, high: float, points: int) -> Floats:
    """Values in even ratios from `low` to `high`, both > 0 and of one unit, shape (points,) with points > 1.

    numpy's geomspace takes seven times as long for 12 points and four times for 400.
    """
    out = low * (high / low) ** (np.arange(points) / (points - 1))
    out[-1] = high
    return out


def frequencies(loop: Loop, points: int = POINTS, lowest: float = LOWEST) -> Floats:
    """Logarithmic grid [rad/s], shape (points,), from `lowest`/slowest time to where delay or scan end."""
    delay = loop.process.dead_time_s + 0.5 * loop.controller.scan_s
    top = 6.0 * math.pi / delay if delay > 0 else 1e4 / slowest_s(loop)
    if loop.controller.scan_s > 0:
        top = min(top, math.pi / loop.controller.scan_s)
    return spaced(lowest / slowest_s(loop), top, points)


Scanned = tuple[float, float, float, int]
"""Pole, now, before and delay of a process on its scan."""
Acting = tuple[float, float, float, float]
"""A controller at its scan: gains of integral and derivative over its gain, and shares of their last value kept by
the filters of slope and of PV [-]."""


def _acting(c: Pid, h: float) -> Acting:
    """A controller's law at a scan of `h` [s]."""
    slope_s = c.slope_filter_s
    return _rate(c) * h, c.td_s / (slope_s + h), kept(slope_s, h), kept(c.pv_filter_s, h)


@njit(cache=True)
def _half_turns(process: Scanned, kp: float, law: Acting, low: float, points: int) -> int:
    """Net half turns about 0 of the characteristic polynomial in 1/z along the upper unit circle, between real
    values: number of crossings of the imaginary axis to the left less those to the right.

    The grid has `points` equidistant points and as many in geometric steps from `low` [rad] on. A controller without
    integral leaves a factor 1 - 1/z on the circle, which is removed.
    """
    pole, now, before, delay = process
    rate, td, slope_keep, pv_keep = law
    kp *= 1.0 - pv_keep
    turns, i, j, last = 0, 0, 0, complex(0.0, 0.0)
    spacing, ratio = math.pi / (points - 1), math.exp(math.log(math.pi / low) / (points - 1))
    turn, turn_late = _backwards(spacing), _backwards(spacing * (delay + 1))
    even, even_late, spread = complex(1.0, 0.0), complex(1.0, 0.0), low
    while i < points or j < points:
        if i < points and (j == points or spacing * i <= spread):
            w, late = even, even_late
            even, even_late, i = even * turn, even_late * turn_late, i + 1
        else:
            w, late = _backwards(spread), _backwards(spread * (delay + 1))
            spread, j = spread * ratio, j + 1
        step, late = 1.0 - w, (now + before * w) * late
        own, slope = (1.0 - pole * w) * (1.0 - slope_keep * w) * (1.0 - pv_keep * w), 1.0 - slope_keep * w
        if rate == 0.0:
            value = own + kp * (slope + td * step) * late
        else:
            value = step * own + kp * ((step + rate) * slope + td * step * step) * late
        if i + j > 1 and (value.real < 0.0) != (last.real < 0.0):
            turns += 1 if last.real * value.imag > last.imag * value.real else -1
        last = value
    return turns


@njit(cache=True)
def _backwards(angle: float) -> complex:
    """1/z at an angle [rad] of z on the unit circle."""
    return complex(math.cos(angle), -math.sin(angle))


def stable_gains(loop: Loop, kp: Floats) -> Mask:
    """True for each gain [% OP / % PV], shape (n,), at which the sampled linear loop is stable.

    A continuous controller gets the step of the simulator. The polynomial in 1/z has its unstable roots inside the
    unit circle; their number is the winding number along the circle.
    """
    h = max(scan_step(loop), loop.process.dead_time_s / MOST_DELAY)
    d, c = discretize(loop.process, h), with_gain(loop.controller)
    process, law = (d.pole, d.now, d.before, d.delay), _acting(c, h)
    low, points = 1e-3 * h / max(slowest_s(loop), h), CIRCLE + 8 * d.delay
    return np.array([_half_turns(process, float(k), law, low, points) == 0 for k in np.asarray(kp)])


def is_stable(loop: Loop) -> bool:
    """Whether the sampled linear loop, without its valve, is stable."""
    return bool(stable_gains(loop, np.array([with_gain(loop.controller).kp]))[0])


def maximum_sensitivity(loop: Loop) -> float:
    """Ms of the loop's linear part without its valve, max abs(1/(1 + L)) (Astrom, Hagglund 2006); inf where it is not
    stable."""
    if not is_stable(loop):
        return math.inf
    omega, c = frequencies(loop, LOOKED_AT, lowest=1e-2), with_gain(loop.controller)
    if c.scan_s <= 0:
        return float(np.max(1.0 / np.abs(1.0 + loop_response(loop, omega))))
    d = discretize(loop.process, c.scan_s)
    process, law = (d.pole, d.now, d.before, d.delay), _acting(c, c.scan_s)
    return 1.0 / float(_least_distance(process, c.kp, law, omega * c.scan_s))


def resonance_s(loop: Loop, near_s: float = 0.0, least: float = math.inf) -> float:
    """Period [s] of the largest amplification of loads by the linear part: of the largest peak of abs(1/(1 + L)), or
    of its maximum if there is no peak.

    near_s : period [s] whose nearest peak is preferred among those at least as high as `least`: behind a dead time
    longer than its lag a loop rings at each odd multiple of its frequency, and the highest peak may be any of them.
    """
    omega = frequencies(loop, LOOKED_AT, lowest=1e-2)
    size = 1.0 / np.abs(1.0 + loop_response(loop, omega))
    peaks = 1 + np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:]) & (size[1:-1] >= least))
    if near_s > 0.0 and peaks.size:
        return float(
            2.0 * math.pi / omega[peaks[np.argmin(np.abs(np.log(omega[peaks] * near_s / (2.0 * math.pi))))]]
        )
    return float(2.0 * math.pi / omega[int(np.argmax(size))])


@njit(cache=True)
def _least_distance(process: Scanned, kp: float, law: Acting, angles: Floats) -> float:
    """Smallest distance of the sampled loop's response from -1 over some angles [rad] of z, shape (m,)."""
    pole, now, before, delay = process
    rate, td, slope_keep, pv_keep = law
    kp *= 1.0 - pv_keep
    least = math.inf
    for k in range(angles.size):
        w, late = _backwards(angles[k]), _backwards(angles[k] * (delay + 1))
        step, g = 1.0 - w, (now + before * w) * late / ((1.0 - pole * w) * (1.0 - pv_keep * w))
        least = min(least, abs(1.0 + g * kp * (1.0 + rate / step + td * step / (1.0 - slope_keep * w))))
    return least
