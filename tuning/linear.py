"""The loop without its valve: frequency response, stability, sensitivity; dead time and scan exact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from identification.models import Fopdt, Integrator, Loop, Pid, Process
from identification.record import Floats, Mask
from identification.simulation.closed_loop import scan_step
from identification.simulation.lag import discretize
from tuning.describing import Complexes

LOWEST = 1e-6
"""Lowest frequency looked at, over that of the slowest of time constant, integral time and dead time."""
POINTS = 900
"""Frequencies of a grid."""
MOST_DELAY = 4000
"""Scans of dead time that stability is judged with at most [-]; ours: beyond it the loop is judged at a scan of that
share of the dead time, which shifts its phase by 1/8000 of the dead time's own, so that no grid grows with the data.
"""


@dataclass(frozen=True, slots=True)
class Margins:
    """Robustness of a loop's linear part.

    stable : whether the closed loop without its valve is stable.
    ms : maximum sensitivity, max abs(1/(1 + L)) (Astrom, Hagglund 2006); inf where it is not stable.
    """

    stable: bool
    ms: float


def integral_s(controller: Pid) -> float:
    """Integral time [s], inf where the integral is off (stated as 0 or inf)."""
    return controller.ti_s if controller.ti_s > 0 else math.inf


def _rate(controller: Pid) -> float:
    """1/Ti [1/s], 0 where the integral is off."""
    return 1.0 / integral_s(controller)


def process_continuous(process: Process, omega: Floats) -> Complexes:
    """G(iw) [% PV / % OP] of the continuous process, shape (m,), at omega [rad/s] of shape (m,)."""
    s = 1j * omega
    late = np.exp(-s * process.dead_time_s)
    if isinstance(process, Integrator):
        return process.slope * late / s
    return process.gain * late / (process.time_constant_s * s + 1.0)


def process_sampled(process: Process, scan_s: float, omega: Floats) -> Complexes:
    """Pulse response of the process behind its zero-order hold at z = exp(i w h), shape (m,); exact."""
    d = discretize(process, scan_s)
    back = np.exp(-1j * omega * scan_s)
    return (d.now + d.before * back) * back ** (d.delay + 1) / (1.0 - d.pole * back)


def controller_continuous(controller: Pid, omega: Floats) -> Complexes:
    """C(iw) [% OP / % PV] of the ideal PID, shape (m,)."""
    s = 1j * omega
    return np.asarray(controller.kp * (1.0 + _rate(controller) / s + controller.td_s * s), np.complex128)


def controller_sampled(controller: Pid, omega: Floats) -> Complexes:
    """C(z) of the velocity form with backward Euler, at z = exp(i w h), shape (m,)."""
    h = controller.scan_s
    step = 1.0 - np.exp(-1j * omega * h)
    return controller.kp * (1.0 + _rate(controller) * h / step + controller.td_s / h * step)


def controller_response(controller: Pid, omega: Floats) -> Complexes:
    """C at omega [rad/s], shape (m,): sampled at its scan, or continuous where scan_s is 0."""
    if controller.scan_s > 0:
        return controller_sampled(controller, omega)
    return controller_continuous(controller, omega)


def process_response(process: Process, scan_s: float, omega: Floats) -> Complexes:
    """G at omega [rad/s], shape (m,): behind the scan's hold, or continuous where scan_s is 0."""
    if scan_s > 0:
        return process_sampled(process, scan_s, omega)
    return process_continuous(process, omega)


def loop_response(loop: Loop, omega: Floats) -> Complexes:
    """G C at omega [rad/s], shape (m,), without the valve."""
    c = loop.controller
    return process_response(loop.process, c.scan_s, omega) * controller_response(c, omega)


def slowest_s(loop: Loop) -> float:
    """The slowest time of the loop [s]: time constant, finite integral time, dead time and scan."""
    ti = integral_s(loop.controller)
    times = [loop.process.dead_time_s, loop.controller.scan_s, ti if math.isfinite(ti) else 0.0]
    if isinstance(loop.process, Fopdt):
        times.append(loop.process.time_constant_s)
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


@njit(cache=True)
def _phase(
    pole: float,
    now: float,
    before: float,
    delay: int,
    kp: float,
    rate: float,
    td: float,
    low: float,
    points: int,
) -> float:
    """Phase [rad] that the characteristic polynomial in 1/z goes through along the upper unit circle.

    Its points are `points` even ones and as many in even ratios from `low` [rad] on. `rate` is the scan over the
    integral time, `td` the derivative time over the scan. A controller without integral leaves a factor 1 - 1/z on
    the circle, which is taken out.
    """
    total, last, i, j = 0.0, 0.0, 0, 0
    ratio = math.log(math.pi / low) / (points - 1)
    while i < points or j < points:
        even = math.pi * i / (points - 1) if i < points else math.inf
        spread = low * math.exp(ratio * j) if j < points else math.inf
        angle = min(even, spread)
        i, j = (i + 1, j) if even <= spread else (i, j + 1)
        w = complex(math.cos(angle), -math.sin(angle))
        step = 1.0 - w
        turned = angle * (delay + 1)
        late = (now + before * w) * complex(math.cos(turned), -math.sin(turned))
        if rate == 0.0:
            value = 1.0 - pole * w + kp * (1.0 + td * step) * late
        else:
            value = step * (1.0 - pole * w) + kp * (step + rate + td * step * step) * late
        here = math.atan2(value.imag, value.real)
        if i + j > 1:
            moved = here - last
            total += moved - 2.0 * math.pi * np.round(moved / (2.0 * math.pi))
        last = here
    return total


def stable_gains(loop: Loop, kp: Floats, points: int = 500) -> Mask:
    """True for each gain at which the sampled linear loop is stable.

    A continuous controller is taken at the step that the simulator gives it. The polynomial in 1/z has its
    unstable roots inside the unit circle; their number is the winding of its values along the circle.

    Parameters
    ----------
    loop : Loop
        Its own gain and its valve do not count.
    kp : ndarray of shape (n,)
        Gains [% OP / % PV].
    points : int
        Points on the half circle, besides eight for each scan of dead time.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    h = max(scan_step(loop), loop.process.dead_time_s / MOST_DELAY)
    d, c = discretize(loop.process, h), loop.controller
    process = d.pole, d.now, d.before, d.delay
    law = _rate(c) * h, c.td_s / h, 1e-3 * h / max(slowest_s(loop), h), points + 8 * d.delay
    turned = np.array([_phase(*process, float(k), *law) for k in np.asarray(kp)])
    return np.abs(turned) < 0.5 * np.pi


def is_stable(loop: Loop, points: int = 500) -> bool:
    """Whether the sampled linear loop, its valve left out, is stable."""
    return bool(stable_gains(loop, np.array([loop.controller.kp]), points)[0])


def margins(loop: Loop, points: int = 400) -> Margins:
    """Stability and maximum sensitivity of the loop's linear part.

    Parameters
    ----------
    loop : Loop
        Its valve is left out.
    points : int
        Frequencies at which the sensitivity is looked at.

    Returns
    -------
    Margins
    """
    if not is_stable(loop):
        return Margins(False, math.inf)
    omega, c = frequencies(loop, points, lowest=1e-2), loop.controller
    if c.scan_s <= 0:
        return Margins(True, float(np.max(1.0 / np.abs(1.0 + loop_response(loop, omega)))))
    d = discretize(loop.process, c.scan_s)
    process, law = (d.pole, d.now, d.before, d.delay), (c.kp, _rate(c) * c.scan_s, c.td_s / c.scan_s)
    return Margins(True, 1.0 / _least_distance(process, law, omega * c.scan_s))


@njit(cache=True)
def _least_distance(
    process: tuple[float, float, float, int], law: tuple[float, float, float], angles: Floats
) -> float:
    """Least distance of the sampled loop's response to -1 over some angles [rad] of z, shape (m,)."""
    pole, now, before, delay = process
    kp, rate, td = law
    least = math.inf
    for k in range(angles.size):
        w = complex(math.cos(angles[k]), -math.sin(angles[k]))
        step, turned = 1.0 - w, angles[k] * (delay + 1)
        g = (now + before * w) * complex(math.cos(turned), -math.sin(turned)) / (1.0 - pole * w)
        least = min(least, abs(1.0 + g * kp * (1.0 + rate / step + td * step)))
    return least
