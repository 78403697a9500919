"""Whether a period in the samples is that of the loop, or a faster one that the sampling folds to it.

OP follows the control law of the error at the frequency at which the loop moves. Samples show a faster cycle at
another frequency, but with the gain and the phase that the law has at the true one, conjugate below a multiple of
the sampling frequency (aliasing of sampled signals; Oppenheim and Schafer 2010, chapter 4).
"""

from __future__ import annotations

import numpy as np

from identification.models import Pid
from identification.record import Floats, LoopRecord
from tuning.describing import Complexes
from tuning.frequency_response import controller_response

PERIODS = 8
"""Periods in a block of the cross-spectrum; ours: few enough for a cycle whose phase drifts."""
MOST_FOLDS = 100
"""Multiples of the sampling frequency that are looked at; ours: beyond, a law is proportional alone."""
COHERENT = 0.5
"""Coherence of error and OP at the period from which their ratio may be a law's; ours: of ten blocks a gain is then
known within a third."""
NEAR = 0.4
"""Largest distance between the logs of measured and expected response; ours: a third of the gain, or 23 degrees."""


def is_own_period(record: LoopRecord, period_s: float, controller: Pid) -> bool:
    """Whether error and OP are related at a period [s] as by the control law there, and not as at a faster one that
    the sampling folds to it; False where the record does not show it."""
    ratio = _ratio(record, period_s)
    if ratio is None or controller.kp == 0.0:
        return False
    folds = min(max(int(record.dt_s / (2.0 * max(controller.scan_s, 1e-6))), 1), MOST_FOLDS)
    whole, f = np.arange(1, folds + 1) / record.dt_s, 1.0 / period_s
    below, above = (controller_response(controller, 2.0 * np.pi * x) for x in (whole - f, whole + f))
    own = complex(controller_response(controller, np.array([2.0 * np.pi * f]))[0])
    away = _distance(ratio, np.array([own]))
    others = _distance(ratio, np.concatenate((np.conj(below), above)))
    return bool(away[0] < NEAR and away[0] < 0.5 * others.min())


def _distance(ratio: complex, expected: Complexes) -> Floats:
    return np.asarray(np.abs(np.log(ratio / expected)))


def _ratio(record: LoopRecord, period_s: float) -> complex | None:
    """Cross-spectrum of error and OP over the error's spectrum at a period [s]; None if they are not coherent."""
    length = round(PERIODS * period_s / record.dt_s)
    starts = [
        k
        for k in range(0, len(record) - length + 1, max(length // 2, 1))
        if record.usable[k : k + length].all()
    ]
    if len(starts) < 3:
        return None
    k = np.arange(length)
    window = np.hanning(length) * np.exp(-2j * np.pi * k * record.dt_s / period_s)
    lines = np.array([[_line(x[s : s + length], window) for x in (record.error, record.op)] for s in starts])
    e, op = lines.T
    cross, auto = np.vdot(e, op), float(np.vdot(e, e).real)
    if auto <= 0.0 or abs(cross) ** 2 < COHERENT * auto * float(np.vdot(op, op).real):
        return None
    return complex(cross / auto)


def _line(x: Floats, window: Complexes) -> complex:
    """The line of a block at a given frequency, without its mean and drift."""
    k = np.linspace(-1.0, 1.0, x.size)
    return complex((x - x.mean() - k * (k @ x) / (k @ k)) @ window)
