"""Which settings of a PI controller reproduce OP from SP and PV."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from identification.record import Floats, LoopRecord, Mask


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


def _increments(x: Floats, step: int) -> Floats:
    return x[step:] - x[:-step]


def _usable(record: LoopRecord, step: int) -> Mask:
    """True where an increment spans only good, automatic, unsaturated samples, shape (n - step,)."""
    out_of_law = record.bad | record.mask("manual") | record.mask("saturated")
    seen = np.concatenate(([0], np.cumsum(out_of_law)))
    return seen[step + 1 :] == seen[: -step - 1]


def _regression(record: LoopRecord, period_s: float) -> tuple[Floats, Floats] | None:
    """Increments of the error and its integral, shape (2, m), and of OP, shape (m,), over an eighth of a period.

    None where OP or the error never moves, or too little of the record is in automatic.
    """
    step = max(round(period_s / 8 / record.dt_s), 1)
    if len(record) < 10 * step + 50:
        return None
    use = _usable(record, step)
    e = record.error
    total = np.concatenate(([0.0], np.cumsum(e))) * record.dt_s
    rows, moved = (
        np.stack([_increments(e, step), total[step + 1 :] - total[1:-step]]),
        _increments(record.op, step),
    )
    if not use.all():
        rows, moved = rows[:, use], moved[use]
    if use.sum() < 50 or float(moved @ moved) <= 0 or float(np.ptp(e)) == 0.0:
        return None
    return rows, moved


def fit_pi(record: LoopRecord, period_s: float) -> ControllerFit | None:
    """PI settings by least squares on increments over an eighth of a period.

    An increment of OP over m samples is kp times that of e plus kp/ti times the integral of e between; over
    an eighth of a period both are large against the resolution of the trends, and drifts of a bias cancel.

    Parameters
    ----------
    record : LoopRecord
    period_s : float
        Period, or other time scale on which the loop moves [s].

    Returns
    -------
    ControllerFit or None
        None where OP or the error never moves, or too little of the record is in automatic.
    """
    found = _regression(record, period_s)
    return None if found is None else _least_squares(*found)


def _least_squares(rows: Floats, moved: Floats) -> ControllerFit:
    scale = np.sqrt((rows**2).mean(axis=1)) + 1e-300
    scaled = rows / scale[:, None]
    coefficients = np.linalg.lstsq(scaled @ scaled.T, scaled @ moved, rcond=None)[0] / scale
    kp, ki = (float(c) for c in coefficients)
    ti = kp / ki if ki != 0 and kp / ki > 0 else math.inf
    return ControllerFit(kp, ti, _explained(rows, moved, coefficients), moved.size)


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

    Parameters
    ----------
    record : LoopRecord
    period_s : float
        Period, or other time scale on which the loop moves [s].
    kp, ti_s : float
        The given settings [% OP / % PV], [s]; ti_s may be inf.
    alike : float
        Difference of the shares explained below which no filter is tried: the given settings do [-].

    Returns
    -------
    LawsCompared or None
        None where the record tells no settings.
    """
    best, given = None, -math.inf
    for samples in FILTERS:
        if samples * record.dt_s > LONGEST_FILTER * period_s:
            break
        found = _regression(_filtered(record, samples), period_s)
        if found is None:
            return None
        free = _least_squares(*found)
        needed = -math.inf if best is None else best.explained + FILTER_WORTH
        best = free if best is None or free.explained > needed else best
        given = max(given, _explained(*found, np.array([kp, kp / ti_s])))
        if best.explained - given < alike:
            break
    return None if best is None else LawsCompared(best.kp, best.ti_s, best.explained, given)


def _filtered(record: LoopRecord, samples: float) -> LoopRecord:
    """The record with its error behind a first-order filter of so many samples."""
    if samples == 0.0:
        return record
    keep = math.exp(-1.0 / samples)
    e = record.error
    return replace(record, sp=lfilter([1.0 - keep], [1.0, -keep], e - e[0]) + e[0] + record.pv)


def _explained(rows: Floats, moved: Floats, coefficients: Floats) -> float:
    left = moved - coefficients @ rows
    return 1.0 - float(left @ left) / float(moved @ moved)
