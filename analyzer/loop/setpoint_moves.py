"""How PV answers each move of the set point: rise, overshoot and settling, as step responses are told."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from analyzer.config import FigureLimits
from identification.record import Floats, LoopRecord, Mask
from identification.signals.robust import robust_deviation

POINTS, FOLLOWED = 48, 2
"""Points of a course that are kept, and times its settling time that it is followed; ours."""
SMALL = 0.05
"""Share of a move within which an error is small [-]: the 5 % of step responses."""
MOST = 12
"""Moves of a night that are kept one by one, the latest; ours: a picture holds no more."""


@dataclass(frozen=True, slots=True)
class Move:
    """One move of the set point that then stood.

    start_s [s since 1970-01-01 UTC]; size [% of span]; rise_s, from a tenth to nine tenths of the way [s], None where
    PV never got there; overshoot, how far it goes beyond the new set point at first, noise left out, over the size
    [-]; settled_s, until the error stays small for as long again [s], None where it does not before the next move;
    lasts_s, how long the course was followed [s]; course, PV at even times until then, 0 at the old set point and 1
    at the new.
    """

    start_s: float
    size: float
    rise_s: float | None
    overshoot: float
    settled_s: float | None
    lasts_s: float
    course: tuple[float, ...]


def moves(record: LoopRecord, noise: float, limits: FigureLimits) -> tuple[Move, ...]:
    """The moves of a record that are larger than noise [% of span] and than what the error does anyway, between spans
    in which the set point stood.

    A set point that is always under way, as a slave's, has none; neither has one that was estimated from PV.
    """
    if record.sp_estimated:
        return ()
    steps = np.flatnonzero(np.abs(np.diff(record.sp)) > 1e-6) + 1
    edges = np.concatenate(([0], steps, [len(record)]))
    held, size = np.diff(edges), record.sp[steps] - record.sp[steps - 1]
    stood = np.minimum(held[:-1], held[1:]) >= limits.move_stands
    large = np.abs(size) > limits.move_noise * max(noise, 1e-6)
    found = (_move(record, edges[k : k + 3], noise, limits) for k in np.flatnonzero(stood & large))
    return tuple(m for m in found if m is not None)


def _move(record: LoopRecord, edges: np.ndarray, noise: float, limits: FigureLimits) -> Move | None:
    """One move; None where the error did as much before it, or samples are lacking before PV has settled.

    edges : first sample before which SP stood, that of the move, and that of the next, shape (3,).
    """
    first, at, last = (int(x) for x in edges)
    before = record.error[first:at][record.usable[first:at]]
    bad = np.flatnonzero(~record.usable[at - 1 : last])
    until = at - 1 + int(bad[0]) if bad.size else last
    if min(before.size, until - at) < limits.move_stands:
        return None
    size = float(record.sp[at] - record.sp[at - 1])
    spread = robust_deviation(before - np.median(before))
    if abs(size) <= limits.move_spread * spread:
        return None
    found = _answered(record, slice(at - 1, until), size, max(noise, spread), limits.move_stands)
    return found if until == last or found.settled_s is not None else None


def _answered(record: LoopRecord, part: slice, size: float, spread: float, stands: int) -> Move:
    """How PV answers a move; part, from the sample before it to the next move; spread of the error before [% of
    span]."""
    way = (record.pv[part] - record.sp[part.start]) / size
    still = spread / abs(size)
    settled = _settled(np.abs(way - 1.0) > max(2.0 * still, SMALL), stands)
    shown = way.size if settled is None else min(way.size, FOLLOWED * settled + 2)
    course = np.interp(np.linspace(0, shown - 1, POINTS), np.arange(shown), way[:shown])
    return Move(
        record.start_s + (part.start + 1) * record.dt_s,
        size,
        _rise(way, record.dt_s),
        max(_excursion(way) - 2.0 * still, 0.0),
        None if settled is None else settled * record.dt_s,
        (shown - 1) * record.dt_s,
        tuple(float(f"{x:.3f}") for x in course),
    )


def _settled(outside: Mask, least: int) -> int | None:
    """First sample from which nothing is outside for as long again as it took, and for some samples at least; None
    where there is none."""
    ends = np.flatnonzero(outside)
    if not ends.size:
        return 0
    starts = np.append(ends[1:], outside.size)
    calm = np.flatnonzero(starts - (ends + 1) >= np.maximum(ends + 1, least))
    return int(ends[calm[0]]) + 1 if calm.size else None


def _excursion(way: Floats) -> float:
    """How far PV goes beyond the set point before it first comes back [-]; what loads do later is not the move's."""
    beyond = way > 1.0
    if not beyond.any():
        return 0.0
    first = int(np.argmax(beyond))
    back = np.flatnonzero(~beyond[first:])
    return float(way[first : first + (int(back[0]) if back.size else way.size)].max()) - 1.0


def _rise(way: Floats, dt_s: float) -> float | None:
    """Time from the first tenth of the way to the first nine tenths [s], read between samples."""
    at = [int(np.argmax(way >= share)) for share in (0.1, 0.9)]
    if not way.max() >= 0.9 or 0 in at:
        return None
    first, last = (
        k - (way[k] - share) / (way[k] - way[k - 1]) for k, share in zip(at, (0.1, 0.9), strict=True)
    )
    return float(last - first) * dt_s


def as_row(found: Sequence[Move]) -> dict[str, float | str | None]:
    """Columns of the night: how many moves, the medians of what is known of them, and the latest of them as JSON."""
    return {
        "sp_moves": float(len(found)),
        "rise_time_s": _median([m.rise_s for m in found]),
        "overshoot_pct": _median([100.0 * m.overshoot for m in found]),
        "settling_time_s": _median([m.settled_s for m in found]),
        "moves": json.dumps([asdict(m) for m in found[-MOST:]], separators=(",", ":")) if found else None,
    }


def _median(values: Sequence[float | None]) -> float | None:
    """The median of what is known, None where nothing is."""
    known = [v for v in values if v is not None]
    return float(np.median(known)) if known else None
