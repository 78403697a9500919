"""Harmonic balance: the limit cycles that describing functions predict for a loop with backlash or stick-slip.

In G(iw) C(iw) N(A) = -1 (the source study's Eq. 3) the phase depends only on w once A is chosen to fit it, so all
solutions are the zeros of one function of w. Its Figures 3, 4, 5 and 7 are also here as arrays: curves, and travel
over Kp and Ti.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from identification.models import Loop
from identification.record import Floats, Mask
from tuning.describing import Branch, Complexes, band, branches, curve, is_backlash
from tuning.frequency_response import controller_response, frequencies, loop_response, spaced, stable_gains

POLISH_STEPS = 6
"""Eightfold bracketing steps that refine a root found on the grid."""
END_STEPS, FINER = 2, 40
"""Refinements, and points of each, of the first and last frequency of a branch."""
REACH_POINTS, MAP_POINTS = 600, 300
"""Frequencies of the grid on a branch: pairs of solutions more than 2 % apart are found; and those of a map's row,
whose periods are then within 0.1 %."""


@dataclass(frozen=True, slots=True)
class Balance:
    """One solution of the harmonic balance.

    period_s [s], op_amplitude [% OP] and pv_amplitude [% PV] (half of peak to peak), stable: whether the loop
    returns to it (a limit cycle) or leaves it (the boundary between two outcomes); jumps of the stem per
    half cycle (0: backlash).
    """

    period_s: float
    op_amplitude: float
    pv_amplitude: float
    stable: bool
    jumps: int


@lru_cache(maxsize=8)
def _roots_of_phase(loop: Loop) -> tuple[Floats, Floats]:
    """Frequencies [rad/s] and sqrt(-phase) that N(A) must have there, both of shape (m,)."""
    omega = frequencies(loop)
    return omega, np.sqrt(np.maximum(-np.angle(-1.0 / loop_response(loop, omega)), 0.0))


def _reach(loop: Loop, branch: Branch, points: int) -> Floats:
    """Grid [rad/s] of the frequencies at which some amplitude of a branch satisfies the phase condition.

    `points` for each stretch of them, shape (k,), dense towards the ends, where the amplitude diverges; empty where
    there is none. The phase of G C does not depend on the gain, and so neither does the grid.
    """
    omega, root = _roots_of_phase(loop)
    inside = (root <= branch.root[0]) & (root >= branch.root[-1])
    above = root > branch.root[0]
    meets = np.flatnonzero(inside[:-1] | inside[1:] | (above[:-1] != above[1:]))
    stretches = np.split(meets, np.flatnonzero(np.diff(meets) > 1) + 1) if meets.size else []
    share = 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, points)))
    ends = [_ends(loop, branch, omega[m[0] : m[-1] + 2]) for m in stretches]
    return np.concatenate([np.empty(0), *(low * (high / low) ** share for low, high in ends)])


def _ends(loop: Loop, branch: Branch, omega: Floats) -> tuple[float, float]:
    """First and last frequency [rad/s] at which a branch satisfies the phase, within omega of shape (m,), m >= 2."""
    low, high = omega[:2], omega[-2:]
    for _ in range(END_STEPS):
        up, down = spaced(low[0], low[1], FINER), spaced(high[0], high[1], FINER)
        begins = np.flatnonzero(np.isfinite(_excess(loop, branch, up)))
        ends = np.flatnonzero(np.isfinite(_excess(loop, branch, down)))
        first = max(begins[0] - 1, 0) if begins.size else FINER - 2
        last = min(ends[-1], FINER - 2) if ends.size else 0
        low, high = up[first : first + 2], down[last : last + 2]
    return float(low[0]), float(high[1])


def _excess(loop: Loop, branch: Branch, omega: Floats) -> Floats:
    """ln abs(G C N) at the amplitude whose N satisfies the phase, shape (m,); nan where no amplitude does."""
    response = loop_response(loop, omega)
    phase = np.angle(-1.0 / response)
    return np.log(np.abs(response)) + branch.at_phase(phase)[1]


def _roots(loop: Loop, branch: Branch) -> list[tuple[float, bool]]:
    """Frequencies [rad/s] of all solutions on a branch, bracketed on the grid and refined, and which are stable.

    Loeb's criterion (Atherton 1982): with slightly larger A the oscillation must decay. As N's phase increases with A
    on every branch, that is where abs(G C N), at the amplitude that satisfies the phase, decreases with frequency.
    """
    omega = _reach(loop, branch, REACH_POINTS)
    excess = _excess(loop, branch, omega)
    sign = np.sign(excess)
    at = np.flatnonzero(
        (sign[:-1] * sign[1:] <= 0) & np.isfinite(excess[:-1] + excess[1:]) & (sign[:-1] != 0)
    )
    return [(_polish(loop, branch, float(omega[k]), float(omega[k + 1])), bool(sign[k] > 0)) for k in at]


def _polish(loop: Loop, branch: Branch, low: float, high: float) -> float:
    for _ in range(POLISH_STEPS):
        inner = np.linspace(low, high, 9)
        sign = np.sign(_excess(loop, branch, inner))
        k = int(np.argmax(sign[:-1] * sign[1:] <= 0))
        low, high = float(inner[k]), float(inner[k + 1])
    return 0.5 * (low + high)


def _solution(loop: Loop, branch: Branch, omega: float, stable: bool) -> Balance:
    at = np.array([omega])
    log_a, _ = branch.at_phase(np.angle(-1.0 / loop_response(loop, at)))
    amplitude = float(np.exp(log_a[0]))
    gain = float(np.abs(controller_response(loop.controller, at))[0])
    return Balance(
        period_s=2.0 * math.pi / omega,
        op_amplitude=amplitude,
        pv_amplitude=amplitude / gain,
        stable=stable,
        jumps=branch.jumps,
    )


def harmonic_balance(loop: Loop) -> tuple[Balance, ...]:
    """All solutions of G C N(A) = -1, with exact dead time and scan, from the highest to the lowest frequency.

    Empty where the curves do not intersect. With scan_s = 0 the controller is continuous, as in the study.
    """
    found = [_solution(loop, b, *root) for b in branches(loop.valve) for root in _roots(loop, b)]
    return tuple(sorted(found, key=lambda s: s.period_s))


def predicted_cycle(loop: Loop) -> Balance | None:
    """The largest stable solution of the harmonic balance, None where there is none."""
    stable = [s for s in harmonic_balance(loop) if s.stable]
    return max(stable, key=lambda s: s.op_amplitude, default=None)


@dataclass(frozen=True, slots=True)
class Curves:
    """Figure 3: N(A) and -1/(G C) in the complex plane, and their intersections.

    valve has its amplitudes [% OP] in `amplitude`, shape (m,); linear its frequencies [rad/s] in `omega`, shape (k,).
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
    [% OP / s], OP amplitude over period as the study defines it, and period_s [s]. Masks of shape (m, n): `at_rest`
    True where no limit cycle is predicted and the linear loop is stable (the study's green), `unstable` True where
    the linear loop itself is not stable.
    """

    kp: Floats
    ti_s: Floats
    travel: Floats
    period_s: Floats
    at_rest: Mask
    unstable: Mask


def curves(loop: Loop) -> Curves:
    """N(A), -1/(G C) and their intersections (Figure 3)."""
    amplitude, n = curve(loop.valve)
    omega = frequencies(loop, lowest=1e-3)
    return Curves(amplitude, n, omega, -1.0 / loop_response(loop, omega), harmonic_balance(loop))


def _map_row(loop: Loop, branch: Branch, kp: Floats) -> tuple[Floats, Floats]:
    """Frequency [rad/s] and ln A of the stable solution on a branch per gain, shape (n,); nan where none.

    The phase of G C does not depend on Kp, so the gain that satisfies the balance is a function of frequency alone,
    and all gains of a row follow from one curve; a solution is stable where that gain increases.
    """
    unit = replace(loop, controller=replace(loop.controller, kp=math.copysign(1.0, loop.controller.kp)))
    omega = _reach(unit, branch, MAP_POINTS)
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
        w, log_a = _map_row(loop, branch, kp)
        better = np.isfinite(w) & ~(np.exp(log_a) <= best_a)
        best_w, best_a = np.where(better, w, best_w), np.where(better, np.exp(log_a), best_a)
    return best_w, best_a


def travel_map(loop: Loop, kp: Floats, ti_s: Floats) -> TravelMap:
    """Valve travel over gains kp, shape (n,), all of the controller's sign, and integral times ti_s > 0, shape (m,).

    The loop's own Kp and Ti are ignored. For stick-slip, no solution of the balance does not imply rest: with
    integral action OP ramps until the stem slips; `at_rest` is then False and only simulation gives the result.
    """
    rows = [
        replace(loop, controller=replace(loop.controller, kp=float(kp[0]), ti_s=float(ti))) for ti in ti_s
    ]
    omega, amplitude = (np.array(v) for v in zip(*(_largest(r, kp) for r in rows), strict=True))
    stable = np.array([stable_gains(r, kp) for r in rows])
    cycles = np.isfinite(omega)
    period = np.where(cycles, 2.0 * math.pi / np.where(cycles, omega, 1.0), 0.0)
    return TravelMap(
        kp,
        ti_s,
        travel=np.where(cycles, amplitude, 0.0) / np.where(cycles, period, 1.0),
        period_s=period,
        at_rest=~cycles & stable & (band(loop.valve) <= 0.0 or is_backlash(loop.valve)),
        unstable=~stable,
    )
