"""Regression of a controller's law on increments: OP's moves over many lengths of time against those of the error, of
its integral and of its slope.

Increments cancel slow bias drifts; those that span a limit, a gap or time in manual are left out. Short ones show the
proportional and the derivative action, long ones the integral; rounding affects both, so the weight of each length is
what the law explains there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from identification.record import Floats, LoopRecord, Mask

LONGEST_INTEGRAL = 10.0
"""Integral time, in lengths of the record, from which there is no integral action: over the record it gives a
tenth of what the gain gives."""
INCREMENTS = 50  # Increments from which a length of them counts
LEVEL_OF = 16
"""Lengths of an increment over which a drift of the integral is attributed to a constant error in the
record of SP or PV. A constant error of SP over hours is not a different law (test_rounded_setpoint.py);
increments are far shorter."""
CLAMPED = 4  # Ratio of OP's time at a clamp to that at the next value: a sine does so 2.4 times
END_SAMPLES = 5
"""Samples at the next value that are added [samples]: those of an OP without steps are one each."""
OP_VALUES = 8  # Number of OP values from which its ends are distinguished from its steps
TELLING = 0.5
"""Share of OP's increments explained by the best law, from which a length of them identifies a law."""
SMALL = 0.01  # Share of OP's variance under which the residual is from scans and rounding, not from the law


@dataclass(frozen=True, slots=True)
class ControllerFit:
    """PI settings identified from a record: kp [% OP / % PV], ti_s [s] (inf where no integral action is visible), and
    the share of the variance of OP's increments that they explain [-]."""

    kp: float
    ti_s: float
    explained: float


def integral_time(kp: float, ki: float, record_s: float) -> float:
    """Integral time [s] of a law, inf where its integral is negligible in a record of so many seconds."""
    ti = kp / ki if ki != 0 and kp / ki > 0 else math.inf
    return ti if ti < LONGEST_INTEGRAL * record_s else math.inf


def explained(products: Floats, gains: Floats) -> float:
    """Share of OP's variance, in products of increments, explained by gains of error, integral, slope, shape (3,)."""
    law = np.append(-gains, 1.0)
    return 1.0 - float(law @ products[:4, :4] @ law) / float(products[3, 3])


def blurred(products: Floats, gains: Floats) -> float:
    """Share of OP's variance left by the true law because of the uncertain integral, as the controller scans between
    samples [-]."""
    return float(gains[1] ** 2 * products[4, 4] / products[3, 3])


def _level_by_turns(moved: Floats, inside: Mask, length: int) -> Floats:
    """The mean of each row over each block of `length` columns, shape of `moved`; only those inside count."""
    starts = np.arange(0, max(inside.size - length // 2, 1), max(length, 1))
    counts = np.maximum(np.add.reduceat(inside.astype(float), starts), 1.0)
    means = np.add.reduceat(moved, starts, axis=1) / counts
    return np.repeat(means, np.diff([*starts, inside.size]), axis=1)


def increments(
    rows: Floats, out_of_law: Mask, samples: int, step: int = 1, level: bool = False
) -> Floats | None:
    """Mean products, shape (5, 5), of increments over `samples`, begun every `step`, of the rows, shape (5, n),
    without those that span samples outside the law and without the part explained by further rows; `level`: less
    their means over blocks of LEVEL_OF of them, because a constant rounding error of SP or PV makes the integral
    drift."""
    since = np.cumsum(out_of_law)
    inside = (since[samples::step] == since[:-samples:step]) & ~out_of_law[:-samples:step]
    count = int(np.count_nonzero(inside))
    if count < INCREMENTS:
        return None
    moved = (rows[:, samples::step] - rows[:, :-samples:step]) * inside
    if level:
        moved -= _level_by_turns(moved, inside, LEVEL_OF * samples // step) * inside
    for feed in moved[5:]:
        moved = _without(moved, feed.copy())
    moved = moved[:5]
    products = moved @ moved.T / count
    return products if products[3, 3] > 0 and products[0, 0] > 0 else None


def _without(moved: Floats, feed: Floats) -> Floats:
    """Increments without their part along the feedforward signal (Frisch and Waugh 1933): its gain then has no
    effect."""
    size = float(feed @ feed)
    return moved - np.outer(moved @ feed, feed) / size if size > 0 else moved


def rows_of(
    record: LoopRecord, error: Floats, slope: Floats | None = None, scan_s: float = math.inf
) -> Floats:
    """Error, integral [% s], slope [% / s], OP, and the error of an integral of every second sample, shape (5, n); a
    feedforward signal, if any, as a sixth row.

    A controller that scans between the samples sums up errors between two of them: about their mean, with scan_s
    toward zero, and not the latter alone, which is half a sample early.
    """
    none = np.zeros(error.size) if slope is None else slope
    coarser = np.repeat(error[::2], 2)[: error.size]
    early_s = 0.5 * max(record.dt_s - scan_s, 0.0)
    whole = np.cumsum(error) * record.dt_s - early_s * error
    lacking = np.cumsum(error - coarser) * record.dt_s
    feed = () if record.feed is None else (record.feed,)
    terms = np.stack((error, whole, none, lacking))
    if record.gain_share is not None:  # velocity form: the gain of a sample multiplies its moves
        terms = np.cumsum(record.gain_share * np.diff(terms, prepend=terms[:, :1]), axis=1)
    return np.stack((*terms[:3], record.op, terms[3], *feed))


def clamped(op: Floats) -> Mask:
    """True where OP is at an end of its own range, shape (n,), if it is there far more often than at the adjacent
    value, unlike any oscillation."""
    levels, counts = np.unique(op, return_counts=True)
    ends = [
        levels[end]
        for end, next_to in ((0, 1), (-1, -2))
        if levels.size > OP_VALUES and counts[end] > CLAMPED * (counts[next_to] + END_SAMPLES)
    ]
    return np.isin(op, ends)


def out_of_law(record: LoopRecord) -> Mask:
    """True where a sample is not usable or OP is at an end of its range, shape (n,)."""
    return ~record.usable | record.mask("saturated")


def fit_pi(record: LoopRecord, period_s: float) -> ControllerFit | None:
    """PI settings by least squares on increments over an eighth of a period [s], or of another time scale on which
    the loop moves; None where OP or the error never moves, or too little of the record is in automatic."""
    step = max(round(period_s / 8 / record.dt_s), 1)
    if len(record) < 10 * step + INCREMENTS:
        return None
    found = increments(rows_of(record, record.error), out_of_law(record), step)
    if found is None:
        return None
    gains = best_gains([found], np.ones(1), np.eye(3)[:2], np.zeros(3))
    ti_s = integral_time(gains[0], gains[1], record.duration_s)
    return ControllerFit(float(gains[0]), ti_s, explained(found, gains))


def best_gains(of: Iterable[Floats], weight: Floats, free: Floats, held: Floats) -> Floats:
    """Gains, shape (3,): `held` plus the best combination of the rows of `free`, shape (k, 3)."""
    total = np.einsum("i,ijk->jk", weight, np.stack([m[:4, :4] for m in of]))
    gram, rhs = free @ total[:3, :3] @ free.T, free @ (total[:3, 3] - total[:3, :3] @ held)
    scale = np.sqrt(np.maximum(np.diag(gram), 0.0)) + 1e-150
    along = np.linalg.lstsq(gram / np.outer(scale, scale), rhs / scale, rcond=1e-10)[0] / scale
    return np.asarray(held + along @ free)


def weights_of(of: Iterable[Floats]) -> Floats:
    """Weight of each length of increments: the share that its own best law explains."""
    own = [explained(m, best_gains([m], np.ones(1), np.eye(3), np.zeros(3))) for m in of]
    share = np.clip(own, 0.0, 1.0)
    moved = np.array([m[3, 3] for m in of])
    return np.where(share >= TELLING, share / (1.0 + 2 * SMALL - share) / moved, 0.0)
