"""Which settings of a PI controller reproduce OP from SP and PV."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

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
    step = max(round(period_s / 8 / record.dt_s), 1)
    if len(record) < 10 * step + 50:
        return None
    use = _usable(record, step)
    e = record.error
    total = np.concatenate(([0.0], np.cumsum(e))) * record.dt_s
    rows = np.stack([_increments(e, step), total[step + 1 :] - total[1:-step]])[:, use]
    moved = _increments(record.op, step)[use]
    power = float(moved @ moved)
    if use.sum() < 50 or power <= 0 or float(np.ptp(e)) == 0.0:
        return None
    scale = np.sqrt((rows**2).mean(axis=1)) + 1e-300
    scaled = rows / scale[:, None]
    coefficients = np.linalg.lstsq(scaled @ scaled.T, scaled @ moved, rcond=None)[0] / scale
    left = moved - coefficients @ rows
    kp, ki = (float(c) for c in coefficients)
    ti = kp / ki if ki != 0 and kp / ki > 0 else math.inf
    return ControllerFit(kp, ti, 1.0 - float(left @ left) / power, int(use.sum()))
