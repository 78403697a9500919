"""The loop without its valve: frequency response, stability, sensitivity; dead time and scan exact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from identification.models import Fopdt, Integrator, Loop, Pid, Process
from identification.record import Floats, Mask
from identification.simulation.closed_loop import scan_step
from identification.simulation.discretization import discretize
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


def frequencies(loop: Loop, points: int = POINTS, lowest: float = LOWEST) -> Floats:
    """Logarithmic grid [rad/s], shape (points,), from `lowest`/slowest time to where delay or scan end."""
    delay = loop.process.dead_time_s + 0.5 * loop.controller.scan_s
    top = 6.0 * math.pi / delay if delay > 0 else 1e4 / slowest_s(loop)
    if loop.controller.scan_s > 0:
        top = min(top, math.pi / loop.controller.scan_s)
    return np.geomspace(lowest / slowest_s(loop), top, points)


def _characteristic(loop: Loop, points: int) -> tuple[Complexes, Complexes]:
    """Characteristic polynomial in 1/z along the upper unit circle: the fixed part, and the part times kp.

    A controller without integral leaves a factor 1 - 1/z on the circle, which is taken out.
    """
    h = max(scan_step(loop), loop.process.dead_time_s / MOST_DELAY)
    d, c = discretize(loop.process, h), loop.controller
    w = np.exp(-1j * _angles(loop, h, points + 8 * d.delay))
    step, rate = 1.0 - w, _rate(c) * h
    late = (d.now + d.before * w) * w ** (d.delay + 1)
    if rate == 0.0:
        return 1.0 - d.pole * w, (1.0 + c.td_s / h * step) * late
    return step * (1.0 - d.pole * w), (step + rate + c.td_s / h * step**2) * late


def _angles(loop: Loop, h: float, points: int) -> Floats:
    low = 1e-3 * h / max(slowest_s(loop), h)
    return np.sort(np.concatenate((np.linspace(0.0, np.pi, points), np.geomspace(low, np.pi, points))))


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
    fixed, scaled = _characteristic(loop, points)
    phase = np.unwrap(np.angle(fixed + np.asarray(kp)[:, None] * scaled), axis=1)
    stable: Mask = np.abs(phase[:, -1] - phase[:, 0]) < 0.5 * np.pi
    return stable


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
    response = loop_response(loop, frequencies(loop, points, lowest=1e-2))
    return Margins(True, float(np.max(1.0 / np.abs(1.0 + response))))
