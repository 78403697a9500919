"""Valve fault from a recorded stem position: OP in, stem out, no process between."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identification.estimation.descent import compass
from identification.record import Floats
from identification.signals.robust import robust_deviation
from identification.simulation.valve import StemLaw, first_slip, sticking, walk

STEPS = (0.03, 0.01, 0.003, 0.001)  # Relative steps of the search of the best backlash
LEAST_SHARE = 0.5
"""Share of the difference between position and OP that a fault has to explain: a positioner's lag leaves less
than a third to backlash."""
SLIP = 5.0
"""Move of the stem within a sample, in standard deviations of its noise, from which it may be a slip
[deviations]."""
SLIPS = 6  # Slips of which medians are taken
BY_SLIPS = 0.5  # Share of slips in the stem's travel, from which it sticks and does not only have backlash

WIDTHS = tuple(float(w) for w in np.geomspace(0.03, 1.2, 60))
"""Backlash widths tried, relative to the range of OP: steps of a sixteenth."""


@dataclass(frozen=True, slots=True)
class ValveFromPosition:
    """A valve identified from its position: its backlash, and its stick-slip if any."""

    backlash: StemLaw
    stick_slip: StemLaw | None


def residual_variance(op: Floats, position: Floats, law: StemLaw) -> float:
    """Mean square residual of a valve against a position, with a free offset [% of span squared]."""
    return float(np.var(position - walk(op, law, first_slip(op, law))))


def refined_backlash(op: Floats, position: Floats, width: float) -> StemLaw:
    """The backlash after its width [% OP] is refined by decreasing steps."""

    def stepped(op: Floats, width: float, sign: int, step: float) -> tuple[float, float]:
        other = width * (1 + sign * step)
        return other, residual_variance(op, position, sticking(other, 0.0))

    start = residual_variance(op, position, sticking(width, 0.0))
    width, _ = compass(op, width, start, stepped, (1, -1), STEPS, 1e-9)
    return sticking(width, 0.0)


def least_move(position: Floats) -> float:
    """Smallest move within a sample that exceeds the stem's noise and resolution [% OP]."""
    step = np.diff(position)
    noise = robust_deviation(step - np.median(step)) / np.sqrt(2.0)
    resolution = float(np.min(np.abs(step)[np.abs(step) > 0], initial=np.inf))
    return max(SLIP * noise, 2.5 * resolution)


def slips(op: Floats, position: Floats) -> Floats:
    """Slips of a stem, shape (m, 3): |OP - stem| [% OP] at the start and at the end of the slip, and its length.

    A slip is a run of samples in which the stem moves in one direction by more than its noise; the medians of its
    start and end need no model of when the stem slips.
    """
    step = np.diff(position)
    going = np.where(np.abs(step) > least_move(position), np.sign(step), 0.0)
    turn = np.flatnonzero(np.diff(np.concatenate(([0.0], going, [0.0]))) != 0)
    out = []
    for first, last in pairwise(turn):
        sign = going[first]
        if sign != 0 and last < position.size - 1 and first > 0:
            before = float(np.mean(position[max(first - 2, 0) : first + 1]))
            after = float(np.mean(position[last : last + 3]))
            out.append((sign * (op[first + 1] - before), sign * (op[last] - after), sign * (after - before)))
    return np.array(out, dtype=np.float64).reshape(-1, 3)


def valve_from_position(op: Floats, position: Floats) -> ValveFromPosition | None:
    """Backlash or stick-slip between a recorded OP and a recorded stem.

    op, position : shape (n,), OP and stem [% of span]. None where the stem follows OP, or where neither backlash nor
    stick-slip explains the difference.
    """
    low, high = np.quantile(op, [0.02, 0.98])
    reach, offset = float(high - low), float(np.median(position - op))
    difference = float(np.var(position - op))
    if reach <= 0 or difference <= 0:
        return None
    best = min((w * reach for w in WIDTHS), key=lambda w: residual_variance(op, position, sticking(w, 0.0)))
    backlash = refined_backlash(op, position, best)
    found = slips(op, position - offset)
    large = found[found[:, 2] > 0.5 * np.max(found[:, 2], initial=0.0)]
    band = 0.5 * least_move(position)
    travel = float(np.abs(np.diff(walk(position, StemLaw(band, band), float(position[0])))).sum())
    by_slips = min(float(found[:, 2].sum()) / max(travel, 1e-9), 1.0)
    if len(large) >= SLIPS and by_slips > BY_SLIPS:
        go, rest = float(np.median(large[:, 0])), float(np.median(large[:, 1]))
        if go > max(rest, 0.0):
            return ValveFromPosition(backlash, sticking(go + rest, (go - rest) / (go + rest)))
    explained = residual_variance(op, position, backlash) < (1.0 - LEAST_SHARE) * difference
    return ValveFromPosition(backlash, None) if explained else None
