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
class Seen:
    """A valve identified from its position: its backlash, and its stick-slip if any."""

    play: StemLaw
    jumping: StemLaw | None


def left(op: Floats, position: Floats, law: StemLaw) -> float:
    """Mean square residual of a valve against a position, with a free offset [% of span squared]."""
    return float(np.var(position - walk(op, law, first_slip(op, law))))


def closed_in(op: Floats, position: Floats, width: float) -> StemLaw:
    """The backlash after its width [% OP] is refined by decreasing steps."""

    def tried(op: Floats, width: float, way: int, step: float) -> tuple[float, float]:
        other = width * (1 + way * step)
        return other, left(op, position, sticking(other, 0.0))

    width, _ = compass(op, width, left(op, position, sticking(width, 0.0)), tried, (1, -1), STEPS, 1e-9)
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
        way = going[first]
        if way != 0 and last < position.size - 1 and first > 0:
            before = float(np.mean(position[max(first - 2, 0) : first + 1]))
            after = float(np.mean(position[last : last + 3]))
            out.append((way * (op[first + 1] - before), way * (op[last] - after), way * (after - before)))
    return np.array(out, dtype=np.float64).reshape(-1, 3)


def seen(op: Floats, position: Floats) -> Seen | None:
    """Backlash or stick-slip between a recorded OP and a recorded stem.

    op, position : shape (n,), OP and stem [% of span]. None where the stem follows OP, or where neither backlash nor
    stick-slip explains the difference.
    """
    low, high = np.quantile(op, [0.02, 0.98])
    reach, offset = float(high - low), float(np.median(position - op))
    apart = float(np.var(position - op))
    if reach <= 0 or apart <= 0:
        return None
    best = min((w * reach for w in WIDTHS), key=lambda w: left(op, position, sticking(w, 0.0)))
    play = closed_in(op, position, best)
    found = slips(op, position - offset)
    large = found[found[:, 2] > 0.5 * np.max(found[:, 2], initial=0.0)]
    band = 0.5 * least_move(position)
    way = float(np.abs(np.diff(walk(position, StemLaw(band, band), float(position[0])))).sum())
    by_slips = min(float(found[:, 2].sum()) / max(way, 1e-9), 1.0)
    if len(large) >= SLIPS and by_slips > BY_SLIPS:
        go, rest = float(np.median(large[:, 0])), float(np.median(large[:, 1]))
        if go > max(rest, 0.0):
            return Seen(play, sticking(go + rest, (go - rest) / (go + rest)))
    return Seen(play, None) if left(op, position, play) < (1.0 - LEAST_SHARE) * apart else None
