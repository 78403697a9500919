"""One regression of a controller's law on increments: OP's moves over many lengths of time beside those of the error,
of its integral and of its slope.

Increments cancel drifts of a bias, and what spans a limit, a hole or time in manual is left out. Short ones show the
proportional and the derivative action, long ones the integral; rounding spoils both, so each length counts by what
the law explains there. Of what no list states (a filter of PV, one of the slope, whether set point moves act on
gain and derivative, one sample between PV's stamp and OP's) every law takes what suits it best, a stated one too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from identification.limits import LAW
from identification.models import Pid
from identification.record import Floats, LoopRecord, Mask
from identification.simulation.lag import first_order

ON_ERROR = ((1.0, 1.0), (1.0, 0.0), (0.0, 0.0))
"""What gain and derivative take of the set point's moves: the usual three [-]."""


@dataclass(frozen=True, slots=True)
class ControllerFit:
    """PI settings found from a record: kp [% OP / % PV], ti_s [s] (inf where no integral action is seen), and the
    share of the variance of OP's increments that they give [-]."""

    kp: float
    ti_s: float
    explained: float


@dataclass(frozen=True, slots=True)
class LawsCompared:
    """A law found beside a stated one, over the increments that tell most against the stated: the shares of OP's
    variance that each explains there [-]."""

    found: Pid
    explained: float
    explained_stated: float

    @property
    def left(self) -> float:
        """What the stated law leaves over what the found one does [-]."""
        return (1.0 - self.explained_stated) / max(1.0 - self.explained, 1e-9)


def integral_time(kp: float, ki: float, record_s: float) -> float:
    """Integral time [s] of a law, inf where its integral does next to nothing in a record of so many seconds."""
    ti = kp / ki if ki != 0 and kp / ki > 0 else math.inf
    return ti if ti < LAW.longest_integral * record_s else math.inf


def explained(products: Floats, gains: Floats) -> float:
    """Share of OP's variance, in products of increments, that gains of error, integral and slope give, shape (3,)."""
    law = np.append(-gains, 1.0)
    return 1.0 - float(law @ products[:4, :4] @ law) / float(products[3, 3])


def blurred(products: Floats, gains: Floats) -> float:
    """Share of OP's variance that the true law would leave for its integral being unsure, for the controller scans
    between the samples [-]."""
    return float(gains[1] ** 2 * products[4, 4] / products[3, 3])


def increments(
    rows: Floats, out_of_law: Mask, samples: int, step: int = 1, level: bool = False
) -> Floats | None:
    """Mean products, shape (5, 5), of increments over so many samples, begun every `step`, of the rows, shape (5, n),
    that span none that is out of the law, less what goes with those of a sixth row, where there is one; `level`: less
    their means, for a constant error of PV's makes the integral run away."""
    since = np.cumsum(out_of_law)
    inside = (since[samples::step] == since[:-samples:step]) & ~out_of_law[:-samples:step]
    count = int(np.count_nonzero(inside))
    if count < LAW.increments:
        return None
    moved = (rows[:, samples::step] - rows[:, :-samples:step]) * inside
    if level:
        moved -= np.outer(moved.sum(axis=1) / count, inside)
    moved = moved if len(moved) == 5 else _without(moved[:5], moved[5])
    products = moved @ moved.T / count
    return products if products[3, 3] > 0 and products[0, 0] > 0 else None


def _without(moved: Floats, feed: Floats) -> Floats:
    """Increments without their part along those of what is fed forward (Frisch and Waugh 1933): its gain, whatever it
    is, then changes nothing."""
    size = float(feed @ feed)
    return moved - np.outer(moved @ feed, feed) / size if size > 0 else moved


def _rows(record: LoopRecord, error: Floats, slope: Floats | None = None) -> Floats:
    """Error, integral [% s], slope [% / s], OP, and what the integral of every second sample lacks, shape (5, n);
    what is fed forward as a sixth row, where there is some."""
    none = np.zeros(error.size) if slope is None else slope
    coarser = np.repeat(error[::2], 2)[: error.size]
    whole, lacking = np.cumsum(error) * record.dt_s, np.cumsum(error - coarser) * record.dt_s
    feed = () if record.feed is None else (record.feed,)
    return np.stack((error, whole, none, record.op, lacking, *feed))


def clamped(op: Floats) -> Mask:
    """True where OP rests at an end of its own that it keeps to, shape (n,): one at which it stands far oftener than
    at the next value, which no wave does."""
    levels, counts = np.unique(op, return_counts=True)
    ends = [
        levels[end]
        for end, next_to in ((0, 1), (-1, -2))
        if levels.size > LAW.op_values and counts[end] > LAW.clamped * (counts[next_to] + LAW.end_samples)
    ]
    return np.isin(op, ends)


def _out_of_law(record: LoopRecord) -> Mask:
    return ~record.usable | record.mask("saturated")


def fit_pi(record: LoopRecord, period_s: float) -> ControllerFit | None:
    """PI settings by least squares on increments over an eighth of a period [s], or of another time scale on which
    the loop moves; None where OP or the error never moves, or too little of the record is in automatic."""
    step = max(round(period_s / 8 / record.dt_s), 1)
    if len(record) < 10 * step + LAW.increments:
        return None
    found = increments(_rows(record, record.error), _out_of_law(record), step)
    if found is None:
        return None
    gains = _least_squares([found], np.ones(1), np.eye(3)[:2], np.zeros(3))
    ti_s = integral_time(gains[0], gains[1], record.duration_s)
    return ControllerFit(float(gains[0]), ti_s, explained(found, gains))


def _least_squares(of: Iterable[Floats], weight: Floats, free: Floats, held: Floats) -> Floats:
    """Gains, shape (3,), that are `held` plus what suits best along the rows of `free`, shape (k, 3)."""
    total = np.einsum("i,ijk->jk", weight, np.stack([m[:4, :4] for m in of]))
    gram, asked = free @ total[:3, :3] @ free.T, free @ (total[:3, 3] - total[:3, :3] @ held)
    scale = np.sqrt(np.maximum(np.diag(gram), 0.0)) + 1e-150
    along = np.linalg.lstsq(gram / np.outer(scale, scale), asked / scale, rcond=1e-10)[0] / scale
    return np.asarray(held + along @ free)


def _weights(of: Iterable[Floats]) -> Floats:
    """Weight of each length of increments: by what its own best law explains of it."""
    own = [explained(m, _least_squares([m], np.ones(1), np.eye(3), np.zeros(3))) for m in of]
    share = np.clip(own, 0.0, 1.0)
    moved = np.array([m[3, 3] for m in of])
    return np.where(share >= LAW.telling, share / (1.0 + 2 * LAW.small - share) / moved, 0.0)


def _settings(gains: Floats, record_s: float, stated: Pid) -> Pid | None:
    """The settings that gains make; None where no controller has them."""
    kp, ki, kd = (float(g) for g in gains)
    if kp == 0 or kd / kp < -1e-9:
        return None
    ti_s = integral_time(kp, ki, record_s)
    integral_runs_back = ki / kp < 0 and abs(ki / kp) * record_s > 1.0 / LAW.longest_integral
    return None if integral_runs_back else replace(stated, kp=kp, ti_s=ti_s, td_s=max(kd / kp, 0.0))


@dataclass(frozen=True, slots=True)
class _Seen:
    """A record as one way of the law's sees it: products of increments by their length in samples, what each weighs,
    and the freest law."""

    moves: dict[int, Floats]
    weight: Floats
    free: Floats

    def left(self, gains: Floats) -> Floats:
        """Share of OP's variance that gains leave at each length of increments [-]."""
        return np.array([1.0 - explained(m, gains) for m in self.moves.values()])

    def left_over_all(self, gains: Floats) -> float:
        """The same, of all of them by their weights [-]."""
        moved = self.weight * np.array([m[3, 3] for m in self.moves.values()])
        return float(moved @ self.left(gains) / moved.sum())

    def poorness(self, gains: Floats) -> float:
        """How poorly gains give OP: mean logarithm of what they leave, alike in all ways of the law."""
        return float(np.mean(np.log(LAW.small + self.left(gains))))

    def does(self, gains: Floats) -> bool:
        """Whether gains give OP about as well as any, and that well."""
        left, least = self.left(gains), self.left(self.free)
        unsure = np.array([blurred(m, gains) for m in self.moves.values()])
        return bool((left - unsure <= LAW.enough * least + LAW.small).all() and least.min() < LAW.gives)


def _ways(record: LoopRecord, longest_s: float, stated: Pid) -> Iterator[_Seen]:
    """The record as the usual ways of the law see it, the plainest first; longest_s : filter of PV [s]."""
    slope_filters = LAW.slope_filters + (LAW.more_slope_filters if stated.td_s > 0 else ())
    out_of_law, n = _out_of_law(record) | clamped(record.op), len(record)
    reach = min(n / 20, max(LAW.reach * stated.ti_s / record.dt_s, LAW.longer))
    lengths = [LAW.longer**k for k in range(12) if LAW.longer**k <= reach]
    on_error = ON_ERROR if float(np.ptp(record.sp)) > 0 and not record.sp_estimated else ON_ERROR[:1]
    filters = [f for f in LAW.pv_filters if f == 0.0 or f * record.dt_s <= longest_s]
    for smooth, late in product(filters, (0, 1)):
        pv = first_order(record.pv, smooth)
        pv = np.concatenate((pv[:1], pv[:-1])) if late else pv
        for (on_gain, on_slope), narrow in product(on_error, slope_filters):
            slope = np.diff(on_slope * record.sp - pv, prepend=on_slope * record.sp[0] - pv[0]) / record.dt_s
            rows = _rows(record, record.sp - pv, first_order(slope, narrow))
            rows[0] = on_gain * record.sp - pv
            of = {k: increments(rows, out_of_law, k, max(k // 8, 1), True) for k in lengths}
            found = {k: m for k, m in of.items() if m is not None}
            weight = _weights(found.values())
            if weight.any():
                free = _least_squares(found.values(), weight, np.eye(3), np.zeros(3))
                yield _Seen(found, weight, free)


def compare_laws(record: LoopRecord, period_s: float, stated: Pid) -> LawsCompared | None:
    """A stated law, and the one that the record shows, which differs in as few settings as explain OP.

    period_s : period, or other time scale on which the loop moves [s]. None where the record tells none; the
    stated law itself where that does.
    """
    gains = np.array([stated.kp, stated.kp / stated.ti_s, stated.kp * stated.td_s])
    best, given = None, None
    for seen in _ways(record, LAW.longest_filter * period_s, stated):
        if seen.does(gains):
            return LawsCompared(stated, 1.0, 1.0)
        if best is None or seen.poorness(seen.free) < best.poorness(best.free) - LAW.worth:
            best = seen
        if given is None or seen.poorness(gains) < given.poorness(gains):
            given = seen
    if best is None or given is None:
        return None
    found = _simplest(best, gains, record.duration_s, stated)
    return None if found is None else _most_apart(best, given, gains, *found)


def _most_apart(best: _Seen, given: _Seen, gains: Floats, pid: Pid, law: Floats) -> LawsCompared | None:
    """The law found beside the stated one, over the increments that tell them apart."""
    stated = {k: explained(m, gains) + blurred(m, gains) for k, m in given.moves.items()}
    laws = [
        LawsCompared(pid, explained(m, law), stated[k])
        for (k, m), weight in zip(best.moves.items(), best.weight, strict=True)
        if weight > 0 and k in stated
    ]
    return max(laws, key=lambda x: x.left * x.explained, default=None)


def _simplest(seen: _Seen, gains: Floats, record_s: float, stated: Pid) -> tuple[Pid, Floats] | None:
    """The law with the fewest settings that are not the stated ones, and its gains."""
    p, i, d = np.eye(3)
    whole, none = gains / gains[0], np.zeros(3)
    trials = [
        (d[None], gains * (p + i)),  # td alone
        (whole[None], none),  # kp alone
        (i[None], gains * (p + d)),  # ti alone
        (np.stack((p + whole * d, i)), none),  # kp and ti
        (np.eye(3), none),
    ]
    enough = LAW.as_well * seen.left_over_all(seen.free)
    for along, held in trials:
        law = _least_squares(seen.moves.values(), seen.weight, along, held)
        pid = _settings(law, record_s, stated)
        if pid is not None and seen.left_over_all(law) <= enough:
            return pid, law
    return None
