"""Response of PV to each set point move: rise, overshoot and settling, as of step responses."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from analyzer.config import FigureLimits
from identification.record import Floats, LoopRecord, Mask
from identification.signals.robust import robust_deviation

ALIKE_LEAST = 3  # Number of similar moves of the set point from which they are a phase of a programme
ALIKE_LEVEL = 0.1
"""Largest difference of the levels of similar moves, over the size: recipes trim set points by less."""

POINTS, FOLLOWED = 48, 2
"""Points kept of a response, and its recorded length in settling times; ours."""
MOST = 12
"""Moves of a night that are kept individually, the latest; ours: a picture has space for no more."""


@dataclass(frozen=True, slots=True)
class Move:
    """One move of the set point, a step or a ramp, between times of constant set point.

    start_s [s since 1970-01-01 UTC]; begin, the set point before it, size, its change [% of span]; ramp_s, its
    duration, 0 for a step [s]; rise_s, from a tenth to nine tenths of the way [s], None if PV never reached that and
    for a ramp, which determines it; overshoot, first excursion of PV beyond the new set point, without noise, over
    the size [-]; settled_s, from the move's end until the error stays small for as long again [s], None if it does
    not before the next move; lasts_s, recorded duration of the course [s]; course, PV at even times until then, 0 at
    the old set point and 1 at the new.
    """

    start_s: float
    begin: float
    size: float
    ramp_s: float
    rise_s: float | None
    overshoot: float
    settled_s: float | None
    lasts_s: float
    course: tuple[float, ...]


def moves(record: LoopRecord, noise: float, limits: FigureLimits) -> tuple[Move, ...]:
    """The moves of a record that are larger than noise [% of span] and than the usual excursions of the error,
    between spans of constant set point.

    Steps in close succession, all up or all down, are one ramp. A set point that always moves, as a slave's, has
    none; neither has one that was estimated from PV.
    """
    if record.sp_estimated:
        return ()
    steps = np.flatnonzero(np.abs(np.diff(record.sp)) > 1e-6) + 1
    if not steps.size:
        return ()
    separate = np.flatnonzero(np.diff(steps) >= limits.move_constant) + 1
    runs = np.split(steps, separate)
    firsts, lasts = (np.array([run[k] for run in runs]) for k in (0, -1))
    before, after = np.append(0, lasts[:-1]), np.append(firsts[1:], len(record))
    size = record.sp[lasts] - record.sp[firsts - 1]
    one_way = np.array([np.ptp(np.sign(np.diff(record.sp[run[0] - 1 : run[-1] + 1]))) <= 1.0 for run in runs])
    large = one_way & (np.abs(size) > limits.move_noise * max(noise, 1e-6))
    edges = np.column_stack((before, firsts, lasts, after))
    found = (_move(record, edges[k], noise, limits) for k in np.flatnonzero(large))
    return tuple(m for m in found if m is not None)


def _move(record: LoopRecord, edges: np.ndarray, noise: float, limits: FigureLimits) -> Move | None:
    """One move; None if the set point was not constant before and after it, the error moved as much before it, or
    samples are missing before PV has settled.

    edges : first sample since which SP was constant, first and last of the move, and that of the next, shape (4,).
    """
    first, at, end, last = (int(x) for x in edges)
    before = record.error[first:at][record.usable[first:at]]
    bad = np.flatnonzero(~record.usable[at - 1 : last])
    until = at - 1 + int(bad[0]) if bad.size else last
    if min(at - first, before.size, until - end) < limits.move_constant:
        return None
    size = float(record.sp[end] - record.sp[at - 1])
    spread = robust_deviation(before - np.median(before))
    if abs(size) <= limits.move_spread * spread:
        return None
    part = slice(at - 1, until)
    found = _answered(record, part, end - at, size, max(noise, spread), limits)
    return found if until == last or found.settled_s is not None else None


def _answered(
    record: LoopRecord, part: slice, ramp: int, size: float, spread: float, limits: FigureLimits
) -> Move:
    """Response of PV to a move of `ramp` samples; part, from the sample before it to the next move; spread of the
    error before [% of span]."""
    begin = float(record.sp[part.start])
    response = (record.pv[part] - begin) / size
    still = spread / abs(size)
    settled = _settled_from(
        np.abs(response[ramp:] - 1.0) > max(2.0 * still, limits.move_settled), limits.move_constant
    )
    shown = response.size if settled is None else min(response.size, FOLLOWED * (settled + ramp) + 2)
    course = np.interp(np.linspace(0, shown - 1, POINTS), np.arange(shown), response[:shown])
    return Move(
        record.start_s + (part.start + 1) * record.dt_s,
        begin,
        size,
        ramp * record.dt_s,
        None if ramp else _rise(response, record.dt_s),
        max(_excursion(response) - 2.0 * still, 0.0),
        None if settled is None else settled * record.dt_s,
        (shown - 1) * record.dt_s,
        tuple(float(f"{x:.3f}") for x in course),
    )


def _settled_from(outside: Mask, least: int) -> int | None:
    """First sample from which nothing is outside for as long again as it took, and for `least` samples at least; None
    if there is none."""
    ends = np.flatnonzero(outside)
    if not ends.size:
        return 0
    starts = np.append(ends[1:], outside.size)
    calm = np.flatnonzero(starts - (ends + 1) >= np.maximum(ends + 1, least))
    return int(ends[calm[0]]) + 1 if calm.size else None


def _excursion(response: Floats) -> float:
    """First excursion of PV beyond the set point [-]; later ones come from loads."""
    beyond = response > 1.0
    if not beyond.any():
        return 0.0
    first = int(np.argmax(beyond))
    back = np.flatnonzero(~beyond[first:])
    return float(response[first : first + (int(back[0]) if back.size else response.size)].max()) - 1.0


def _rise(response: Floats, dt_s: float) -> float | None:
    """Time from the first tenth of the way to the first nine tenths [s], interpolated between samples."""
    at = [int(np.argmax(response >= share)) for share in (0.1, 0.9)]
    if not response.max() >= 0.9 or 0 in at:
        return None
    first, last = (
        k - (response[k] - share) / (response[k] - response[k - 1])
        for k, share in zip(at, (0.1, 0.9), strict=True)
    )
    return float(last - first) * dt_s


@dataclass(frozen=True, slots=True)
class Phase:
    """Similar moves of a programme: set point before and after [% of span], and of each repetition its start [s since
    1970-01-01 UTC], overshoot [% of the size] and settling [s], None if it did not settle."""

    begin: float
    end: float
    start_s: tuple[float, ...]
    overshoot_pct: tuple[float, ...]
    settled_s: tuple[float | None, ...]


def phases(found: Sequence[Move]) -> tuple[Phase, ...]:
    """Repeated moves between the same levels, in the order of their first occurrence."""
    kinds: list[list[Move]] = []
    for m in found:
        same = [k for k in kinds if alike((k[0].begin, k[0].begin + k[0].size), (m.begin, m.begin + m.size))]
        if not same:
            kinds.append([])
        (same[0] if same else kinds[-1]).append(m)
    return tuple(
        Phase(
            float(np.median([m.begin for m in k])),
            float(np.median([m.begin + m.size for m in k])),
            tuple(m.start_s for m in k),
            tuple(round(100.0 * m.overshoot, 2) for m in k),
            tuple(m.settled_s for m in k),
        )
        for k in kinds
        if len(k) >= ALIKE_LEAST
    )


def alike(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two moves between levels are of one kind [% of span]."""
    most = ALIKE_LEVEL * abs(one[1] - one[0])
    return all(abs(a - b) <= most for a, b in zip(one, other, strict=True))


def as_row(found: Sequence[Move]) -> dict[str, float | str | None]:
    """Columns of the night: number of moves, medians of the known figures, and as JSON the latest moves and the
    repeated phases."""
    back = phases(found)
    return {
        "sp_moves": float(len(found)),
        "rise_time_s": _median([m.rise_s for m in found]),
        "overshoot_pct": _median([100.0 * m.overshoot for m in found]),
        "settling_time_s": _median([m.settled_s for m in found]),
        "moves": json.dumps([asdict(m) for m in found[-MOST:]], separators=(",", ":")) if found else None,
        "phases": json.dumps([asdict(p) for p in back], separators=(",", ":")) if back else None,
    }


def _median(values: Sequence[float | None]) -> float | None:
    """The median of the known values, None if there are none."""
    known = [v for v in values if v is not None]
    return float(np.median(known)) if known else None
