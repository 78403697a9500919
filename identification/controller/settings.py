"""Which settings of a PI controller reproduce OP from SP and PV."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from identification.record import Floats, LoopRecord, Mask
from identification.simulation.lag import first_order


@dataclass(frozen=True, slots=True)
class ControllerFit:
    """PI settings found from a record.

    kp [% OP / % PV], ti_s [s] (inf where no integral action is seen), explained : share of the variance of
    OP's increments that the law gives [-], count : increments used.
    """

    kp: float
    ti_s: float
    explained: float
    count: int


class _Products(NamedTuple):
    """Sums over the increments used of products of those of the error (e), of its integral (s) and of OP (m)."""

    ee: float
    es: float
    ss: float
    em: float
    sm: float
    mm: float
    used: int

    def explained(self, kp: float, ki: float) -> float:
        """Share of the variance of OP's increments that a law gives [-]."""
        given = kp * self.em + ki * self.sm
        squared = kp * kp * self.ee + 2 * kp * ki * self.es + ki * ki * self.ss
        return (2 * given - squared) / self.mm


@njit(cache=True)
def _summed(
    e: Floats, op: Floats, out_of_law: Mask, dt_s: float, step: int
) -> tuple[float, float, float, float, float, float, int]:
    """The sums of `_Products` over increments of `step` samples that span none that is out of the law."""
    ee, es, ss, em, sm, mm, count = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    since, total, mean = 0, 0.0, e.mean()
    for k in range(e.size):
        since = 0 if out_of_law[k] else since + 1
        total += e[k] - mean
        if k < step:
            continue
        total -= e[k - step] - mean
        if since <= step:
            continue
        d, i, m = e[k] - e[k - step], (total + step * mean) * dt_s, op[k] - op[k - step]
        ee, es, ss = ee + d * d, es + d * i, ss + i * i
        em, sm, mm, count = em + d * m, sm + i * m, mm + m * m, count + 1
    return ee, es, ss, em, sm, mm, count


def _regression(record: LoopRecord, error: Floats, period_s: float) -> _Products | None:
    """Increments of the error and its integral beside those of OP, over an eighth of a period.

    None where OP or the error never moves, or too little of the record is in automatic.
    """
    step = max(round(period_s / 8 / record.dt_s), 1)
    if len(record) < 10 * step + 50:
        return None
    out_of_law = record.bad | record.mask("manual") | record.mask("saturated")
    found = _Products(*_summed(error, record.op, out_of_law, record.dt_s, step))
    if found.used < 50 or found.mm <= 0 or float(np.ptp(error)) == 0.0:
        return None
    return found


def fit_pi(record: LoopRecord, period_s: float) -> ControllerFit | None:
    """PI settings by least squares on increments over an eighth of a period.

    An increment of OP over m samples is kp times that of e plus kp/ti times the integral of e between; over
    an eighth of a period both are large against the resolution of the trends, and drifts of a bias cancel.

    period_s : period, or other time scale on which the loop moves [s]. None where OP or the error never
    moves, or too little of the record is in automatic.
    """
    found = _regression(record, record.error, period_s)
    return None if found is None else _least_squares(found, record.duration_s)


LONGEST_INTEGRAL = 10.0
"""Integral time, in lengths of the record, from which there is no integral action; ours: over the record it gives a
tenth of what the gain gives."""


def integral_time(kp: float, ki: float, record_s: float) -> float:
    """Integral time [s] of a law, inf where its integral does next to nothing in a record of so many seconds."""
    ti = kp / ki if ki != 0 and kp / ki > 0 else math.inf
    return ti if ti < LONGEST_INTEGRAL * record_s else math.inf


def _least_squares(x: _Products, record_s: float) -> ControllerFit:
    scale = np.sqrt(np.array([x.ee, x.ss]) / x.used) + 1e-300
    gram = np.array([[x.ee, x.es], [x.es, x.ss]]) / np.outer(scale, scale)
    kp, ki = (float(c) for c in np.linalg.lstsq(gram, np.array([x.em, x.sm]) / scale, rcond=None)[0] / scale)
    ti = integral_time(kp, ki, record_s)
    return ControllerFit(kp, ti, x.explained(kp, ki), x.used)


FILTERS = (0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0)
"""Filters of the controller's PV that are tried [samples]; ours: none is far from one of them."""
FILTER_WORTH = 0.05
"""Share of the variance of OP's increments that a longer filter must explain more, to be taken [-]; ours."""
LONGEST_FILTER = 1.0 / 6.0
"""Longest filter tried, as a share of the period [-]; beyond it the filter, not the law, would be fitted."""


@dataclass(frozen=True, slots=True)
class LawsCompared:
    """Given PI settings beside recovered ones, each with the PV filter that suits it best.

    kp [% OP / % PV], ti_s [s] : recovered; explained, explained_given : shares of the variance of OP's increments
    that these and the given ones explain [-].
    """

    kp: float
    ti_s: float
    explained: float
    explained_given: float


def compare_laws(
    record: LoopRecord, period_s: float, kp: float, ti_s: float, alike: float = 0.0
) -> LawsCompared | None:
    """Given settings and the best ones for the record, a PV filter allowed to both.

    Many controllers act on a filtered PV while the raw one is recorded. Left out, a filter of a tenth of the period
    passes for half the gain and a third of the integral time.

    period_s : period, or other time scale on which the loop moves [s]; kp, ti_s : the given settings [% OP / % PV],
    [s]; ti_s may be inf; alike : difference of the shares explained below which no filter is tried: the given
    settings do [-]. None where the record tells no settings.
    """
    best, given, error = None, -math.inf, record.error
    for samples in FILTERS:
        if samples * record.dt_s > LONGEST_FILTER * period_s:
            break
        found = _regression(record, first_order(error, samples), period_s)
        if found is None:
            return None
        free = _least_squares(found, record.duration_s)
        needed = -math.inf if best is None else best.explained + FILTER_WORTH
        best = free if best is None or free.explained > needed else best
        given = max(given, found.explained(kp, kp / ti_s))
        if best.explained - given < alike:
            break
    return None if best is None else LawsCompared(best.kp, best.ti_s, best.explained, given)
