"""Harmonic balance: the limit cycles that describing functions predict for a loop with play or stick-slip.

G(iw) C(iw) N(A) = -1 (the source study's Eq. 3) has its phase in w alone once A is chosen to fit, so all
solutions are the zeros of one function of w.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from identification.models import Loop
from identification.record import Floats
from tuning.describing import Branch, branches
from tuning.linear import controller_response, frequencies, loop_response, spaced

POLISH_STEPS = 6
"""Eightfold bracketings that polish a root found on the grid."""
END_STEPS, FINER = 2, 40
"""Refinements, and points of each, of the frequencies at which a branch begins and ends."""
REACH_POINTS = 600
"""Frequencies at which a branch is looked at: no pair of solutions further apart than 2 % is missed."""


@dataclass(frozen=True, slots=True)
class Balance:
    """One solution of the harmonic balance.

    period_s [s], op_amplitude [% OP] and pv_amplitude [% PV] (half of peak to peak), stable: whether the loop
    returns to it (a limit cycle) or leaves it (the border between two fates); jumps of the stem per half
    cycle (0: play); stem_amplitude [% OP] of the stem's fundamental.
    """

    period_s: float
    op_amplitude: float
    pv_amplitude: float
    stem_amplitude: float
    stable: bool
    jumps: int


@lru_cache(maxsize=8)
def _roots_of_phase(loop: Loop) -> tuple[Floats, Floats]:
    """Frequencies [rad/s] and sqrt(-phase) that N(A) must have there, both of shape (m,)."""
    omega = frequencies(loop)
    return omega, np.sqrt(np.maximum(-np.angle(-1.0 / loop_response(loop, omega)), 0.0))


def reach(loop: Loop, branch: Branch, points: int = REACH_POINTS) -> Floats:
    """Grid [rad/s] of the frequencies at which some amplitude of a branch closes the phase.

    `points` for each stretch of them, shape (k,), dense towards the ends, where the amplitude runs away;
    empty where there is none. The phase of G C does not depend on the gain, and so neither does the grid.
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
    """The frequencies [rad/s] between which a branch closes the phase, within omega of shape (m,), m >= 2."""
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
    """ln abs(G C N) at the amplitude whose N closes the phase, shape (m,); nan where no amplitude does."""
    response = loop_response(loop, omega)
    phase = np.angle(-1.0 / response)
    return np.log(np.abs(response)) + branch.at_phase(phase)[1]


def _roots(loop: Loop, branch: Branch, omega: Floats) -> list[float]:
    """Frequencies [rad/s] of all solutions on a branch, bracketed on the grid and polished."""
    excess = _excess(loop, branch, omega)
    sign = np.sign(excess)
    at = np.flatnonzero(
        (sign[:-1] * sign[1:] <= 0) & np.isfinite(excess[:-1] + excess[1:]) & (sign[:-1] != 0)
    )
    return [_polish(loop, branch, float(omega[k]), float(omega[k + 1])) for k in at]


def _polish(loop: Loop, branch: Branch, low: float, high: float) -> float:
    for _ in range(POLISH_STEPS):
        inner = np.linspace(low, high, 9)
        sign = np.sign(_excess(loop, branch, inner))
        k = int(np.flatnonzero(sign[:-1] * sign[1:] <= 0)[0]) if np.any(sign[:-1] * sign[1:] <= 0) else 0
        low, high = float(inner[k]), float(inner[k + 1])
    return 0.5 * (low + high)


def _is_stable(loop: Loop, branch: Branch, omega: float, phase: float) -> bool:
    """Loeb's criterion: with A a little larger the oscillation must decay.

    From 1 + N(A) L(s) = 0, ds/dA = -i (dlnN/dA)/(dlnL/dw), whose real part must be negative (Atherton 1982).
    """
    w = omega * np.array([1 - 1e-4, 1 + 1e-4])
    slope = np.diff(np.log(loop_response(loop, w)))[0]
    slope = complex(slope.real, math.remainder(slope.imag, 2 * math.pi))
    angle = phase + 1e-4 * np.array([-1.0, 1.0])
    log_a, log_n = branch.at_phase(angle)
    along_a = complex(log_n[1] - log_n[0], angle[1] - angle[0]) / (log_a[1] - log_a[0])
    return (along_a / slope).imag < 0


def _solution(loop: Loop, branch: Branch, omega: float) -> Balance:
    at = np.array([omega])
    phase = np.angle(-1.0 / loop_response(loop, at))
    log_a, log_n = branch.at_phase(phase)
    amplitude = float(np.exp(log_a[0]))
    gain = float(np.abs(controller_response(loop.controller, at))[0])
    return Balance(
        period_s=2.0 * math.pi / omega,
        op_amplitude=amplitude,
        pv_amplitude=amplitude / gain,
        stem_amplitude=amplitude * float(np.exp(log_n[0])),
        stable=_is_stable(loop, branch, omega, float(phase[0])),
        jumps=branch.jumps,
    )


def harmonic_balance(loop: Loop) -> tuple[Balance, ...]:
    """All solutions of G C N(A) = -1, dead time and scan exact.

    Parameters
    ----------
    loop : Loop
        With scan_s = 0 the controller is continuous, as in the study.

    Returns
    -------
    tuple of Balance
        From the fastest to the slowest; empty where the curves do not meet.
    """
    found = [_solution(loop, b, w) for b in branches(loop.valve) for w in _roots(loop, b, reach(loop, b))]
    return tuple(sorted(found, key=lambda s: s.period_s))


def predicted_cycle(loop: Loop) -> Balance | None:
    """The largest stable solution of the harmonic balance, None where there is none."""
    stable = [s for s in harmonic_balance(loop) if s.stable]
    return max(stable, key=lambda s: s.op_amplitude, default=None)
