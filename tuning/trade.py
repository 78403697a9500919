"""Trade-off between settings: where no settings are better in everything, the curve to choose from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from identification.models import Fopdt
from identification.record import Floats
from identification.simulation.closed_loop import scan_step
from tuning.forecast import CALMER, DERIVATIVE, SMALLER
from tuning.frequency_response import integral_s
from tuning.rules import effective_delay, simc
from tuning.search import Bench, Candidate, pairs, robust, rounded, try_out

POINTS = 11
"""Gains and integral times of the curve's grid."""
SHARES, MORE = (0.25, 0.5), (1.0, 1.3)
"""Derivative times tried, over the delay, and gains over those of the curve; ours: half the delay is the value of
Ziegler and Nichols (1942)."""


@dataclass(frozen=True, slots=True)
class Trade:
    """Gains and losses of settings.

    curve, robust settings that are not inferior to others in both travel and error, least travel first, figures on
    the first loop; chosen, the two ends that are valid on every loop of the bench, and one with a derivative if
    useful, by name, figures over all loops.
    """

    curve: tuple[Candidate, ...]
    chosen: Mapping[str, Candidate]


def trade(table: Bench) -> Trade:
    """The curve of a bench and the settings chosen on it, valid on every loop consistent with the data: the least
    travel for a stated increase of error, and the least error without more travel."""
    curve, limits = _front(table), table.limits
    calm = (c for c in curve if c.error <= limits.trade_error)
    exact = (c for c in reversed(curve) if c.travel <= 1.0)
    ends = {CALMER: (calm, limits.trade_error, 1.0), SMALLER: (exact, 1.0, limits.travel_growth_sample)}
    chosen = {}
    for name, (candidates, error, travel) in ends.items():
        whole = (
            try_out(table, c.controller, c.ms) for c, _ in zip(candidates, range(limits.tried), strict=False)
        )
        held = next((c for c in whole if c.worst_error <= error and c.worst_travel <= travel), None)
        if held is not None:
            chosen[name] = held
    derived = _with_derivative(table, curve, chosen.get(SMALLER))
    return Trade(curve, chosen if derived is None else {**chosen, DERIVATIVE: derived})


def _with_derivative(table: Bench, curve: Sequence[Candidate], without: Candidate | None) -> Candidate | None:
    """Settings of the curve with a derivative, and some more gain, that reduce the error far more than the best
    without one on every loop, without more travel than now; None if none, or if the loop has a derivative."""
    loop, limits = table.loops[0], table.limits
    if loop.controller.td_s > 0.0:
        return None
    most = (1.0 - limits.worth_error) * (1.0 if without is None else min(without.worst_error, 1.0))
    delay_s, found = effective_delay(loop.process, scan_step(loop)), []
    for c, share, gain in product(curve, SHARES, MORE):
        pid = replace(c.controller, kp=rounded(gain * c.controller.kp), td_s=rounded(share * delay_s))
        ms = robust(table.loops, pid, table.most_ms)
        first = None if ms is None else try_out(table, pid, ms, 1)
        if first is not None and first.error <= most and first.travel <= 1.0:
            found.append(first)
    best = sorted(found, key=lambda c: c.error)[: limits.tried]
    whole = (try_out(table, c.controller, c.ms) for c in best)
    fit = (c for c in whole if c.worst_error <= most and c.worst_travel <= limits.travel_growth_sample)
    return next(fit, None)


def _front(table: Bench) -> tuple[Candidate, ...]:
    """Robust settings of a wide grid not inferior to others in both travel and error, least travel first."""
    tried = ((pid, robust(table.loops, pid, table.most_ms)) for pid in pairs(table.loops[0], *_grid(table)))
    found = [try_out(table, pid, ms, 1) for pid, ms in tried if ms is not None]
    front: list[Candidate] = []
    for c in sorted(found, key=lambda c: (c.travel, c.error)):
        if not front or c.error < front[-1].error:
            front.append(c)
    return tuple(front)


def _grid(table: Bench) -> tuple[Floats, Floats]:
    """Gains [% OP / % PV] and integral times [s] about the present ones and SIMC's, up to the time constant."""
    loop, limits = table.loops[0], table.limits
    nominal = simc(loop.process, scan_s=scan_step(loop))
    gains = sorted((abs(loop.controller.kp), abs(nominal.kp)))
    now_s = integral_s(loop.controller)
    times = sorted((now_s, nominal.ti_s)) if np.isfinite(now_s) else [nominal.ti_s] * 2
    reach, lag = limits.trade_reach, loop.process.time_constant_s if isinstance(loop.process, Fopdt) else 0.0
    return (
        np.geomspace(gains[0] / reach, gains[1] * limits.gain_up, POINTS),
        np.geomspace(times[0] / 2.0, max(times[1] * reach, lag), POINTS),
    )
