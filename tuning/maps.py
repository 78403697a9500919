"""The source study's Figures 3 to 7 as arrays: curves, travel over Kp and Ti, longest Ti that cycles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.models import Backlash, Fopdt, Loop, Motion, Valve
from identification.record import Floats, Mask
from tuning.balance import Balance, harmonic_balance, reach
from tuning.describing import (
    Branch,
    Complexes,
    backlash,
    band,
    branches,
    is_play,
    jump_range,
    sliding,
    stick_slip,
)
from tuning.linear import controller_response, frequencies, loop_response, stable_gains
from tuning.rules import simc

MAP_POINTS = 300
"""Frequencies of a map's row; periods are then within 0.1 %."""
BISECTIONS = 24
"""Halvings of Ti/T in the search for the largest that cycles: far below the two digits of the table."""


@dataclass(frozen=True, slots=True)
class Curves:
    """Figure 3: N(A) and -1/(G C) in the complex plane.

    valve : ndarray of complex, shape (m,), with its amplitudes [% OP] in `amplitude`.
    linear : ndarray of complex, shape (k,), with its frequencies [rad/s] in `omega`.
    crossings : tuple of Balance
        Where they meet.
    """

    amplitude: Floats
    valve: Complexes
    omega: Floats
    linear: Complexes
    crossings: tuple[Balance, ...]


@dataclass(frozen=True, slots=True)
class TravelMap:
    """Figures 4, 5 and 7: the limit cycle over the Kp-Ti plane by harmonic balance.

    kp [% OP / % PV] of shape (n,), ti_s [s] of shape (m,). Of shape (m, n), 0 where there is no cycle: travel
    [% OP / s], OP amplitude over period as the study defines it, period_s [s], op_amplitude [% OP] and
    pv_amplitude [% PV]. Masks of shape (m, n): `rests` True where no limit cycle is predicted and the linear
    loop is stable (the study's green), `unstable` True where the linear loop itself is not stable.
    """

    kp: Floats
    ti_s: Floats
    travel: Floats
    period_s: Floats
    op_amplitude: Floats
    pv_amplitude: Floats
    rests: Mask
    unstable: Mask


def valve_curve(valve: Valve, points: int = 400) -> tuple[Floats, Complexes]:
    """Amplitudes [% OP] and N(A), shape (points,), up to 100 half widths, or of stick-slip with one jump."""
    width = band(valve)
    if valve is None or width <= 0.0:
        return np.ones(1), np.ones(1, dtype=np.complex128)
    amplitude = 0.5 * width * (1.0 + np.geomspace(1e-4, 100.0, points))
    if isinstance(valve, Backlash) or is_play(valve):
        return amplitude, backlash(amplitude, width)
    if valve.motion is not Motion.RESTS:
        return amplitude, sliding(amplitude, valve.stickband, valve.slip_jump)
    low, high = jump_range(valve, 1)
    amplitude = np.linspace(low, high, points)
    return amplitude, stick_slip(amplitude, valve.stickband, valve.slip_jump)


def curves(loop: Loop) -> Curves:
    """N(A), -1/(G C) and their intersections (Figure 3)."""
    amplitude, n = valve_curve(loop.valve)
    omega = frequencies(loop, lowest=1e-3)
    return Curves(amplitude, n, omega, -1.0 / loop_response(loop, omega), harmonic_balance(loop))


def _row(loop: Loop, branch: Branch, kp: Floats) -> tuple[Floats, Floats]:
    """Frequency [rad/s] and ln A of the stable solution on a branch per gain, shape (n,); nan where none.

    The phase of G C does not depend on Kp, so the gain that closes the balance is a function of frequency
    alone, and all gains of a row are read from one curve; a solution is stable where that gain rises.
    """
    unit = replace(loop, controller=replace(loop.controller, kp=math.copysign(1.0, loop.controller.kp)))
    omega = reach(unit, branch, MAP_POINTS)
    if omega.size == 0:
        return np.full(kp.size, np.nan), np.full(kp.size, np.nan)
    response = loop_response(unit, omega)
    log_a, log_n = branch.at_phase(np.angle(-1.0 / response))
    above = -np.log(np.abs(response)) - log_n - np.log(np.abs(kp))[:, None]
    rises = (above[:, :-1] <= 0) & (above[:, 1:] > 0)
    k = rises.shape[1] - 1 - np.argmax(rises[:, ::-1], axis=1)
    j = np.arange(kp.size)
    share = np.where(rises[j, k], above[j, k] / (above[j, k] - above[j, k + 1]), np.nan)
    return omega[k] * (omega[k + 1] / omega[k]) ** share, log_a[k] + share * (log_a[k + 1] - log_a[k])


def _largest(loop: Loop, kp: Floats) -> tuple[Floats, Floats]:
    """Frequency [rad/s] and OP amplitude [% OP] of the largest stable solution per gain, shape (n,)."""
    best_w, best_a = np.full(kp.size, np.nan), np.full(kp.size, np.nan)
    for branch in branches(loop.valve):
        w, log_a = _row(loop, branch, kp)
        better = np.isfinite(w) & ~(np.exp(log_a) <= best_a)
        best_w, best_a = np.where(better, w, best_w), np.where(better, np.exp(log_a), best_a)
    return best_w, best_a


def _with(loop: Loop, kp: float, ti_s: float) -> Loop:
    return replace(loop, controller=replace(loop.controller, kp=kp, ti_s=ti_s))


def travel_map(loop: Loop, kp: Floats, ti_s: Floats) -> TravelMap:
    """Valve travel over the Kp-Ti plane by harmonic balance.

    Parameters
    ----------
    loop : Loop
        Its own Kp and Ti do not count. For stick-slip no solution of the balance does not mean rest: with
        integral action OP ramps until the stem slips; `rests` is then False and simulation must tell.
    kp : ndarray of shape (n,)
        Gains [% OP / % PV], all of the controller's sign.
    ti_s : ndarray of shape (m,)
        Integral times [s], > 0.

    Returns
    -------
    TravelMap
    """
    rows = [_with(loop, float(kp[0]), float(ti)) for ti in ti_s]
    omega, amplitude = (np.array(v) for v in zip(*(_largest(r, kp) for r in rows), strict=True))
    stable = np.array([stable_gains(r, kp) for r in rows])
    cycles = np.isfinite(omega)
    period = np.where(cycles, 2.0 * math.pi / np.where(cycles, omega, 1.0), 0.0)
    size = np.where(cycles, amplitude, 0.0)
    return TravelMap(
        kp,
        ti_s,
        travel=size / np.where(cycles, period, 1.0),
        period_s=period,
        op_amplitude=size,
        pv_amplitude=size / _controller_gains(rows, kp, np.where(cycles, omega, 1.0)),
        rests=~cycles & stable & (band(loop.valve) <= 0.0 or is_play(loop.valve)),
        unstable=~stable,
    )


def _controller_gains(rows: Sequence[Loop], kp: Floats, omega: Floats) -> Floats:
    unit = [np.abs(controller_response(r.controller, w)) for r, w in zip(rows, omega, strict=True)]
    return np.array(unit) * np.abs(kp / kp[0])


def largest_cycling_ratio(process: Fopdt, gain_share: float = 1.0, scan_s: float = 0.0) -> float:
    """Largest Ti/T at which play still cycles by harmonic balance (Figure 6).

    Parameters
    ----------
    process : Fopdt
    gain_share : float
        Kp over that of the nominal tuning (SIMC with tau_c = 1.5 L).
    scan_s : float
        0: a continuous controller, as in the study.

    Returns
    -------
    float
        Ti/T; 0 where the loop cycles nowhere between 0.02 and 5, inf where it still cycles at 5.
    """
    loop = Loop(process, replace(simc(process), scan_s=scan_s), Backlash(1.0))
    kp = np.array([loop.controller.kp * gain_share])

    def cycles(ratio: float) -> bool:
        return bool(
            np.isfinite(_largest(_with(loop, float(kp[0]), ratio * process.time_constant_s), kp)[0][0])
        )

    tried = np.geomspace(0.02, 5.0, 40)
    at = [r for r in tried if cycles(float(r))]
    if not at or at[-1] == tried[-1]:
        return math.inf if at else 0.0
    low, high = float(at[-1]), float(at[-1] * (tried[1] / tried[0]))
    for _ in range(BISECTIONS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if cycles(middle) else (low, middle)
    return low
