"""Which tags are PV, OP and SP of one loop, by what the data show: one-to-one over all tags of a bag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analyzer.finder.law import (
    TINY,
    Matrix,
    Moves,
    blocks,
    direction,
    explained,
    fitted,
    innovations,
    shared_noise,
    widths,
)
from analyzer.limits import FINDER

Cause = tuple[int, ...]
"""A tag that may be PV, or PV and SP whose difference is the error."""


@dataclass(frozen=True, slots=True)
class FoundPair:
    """A loop that the data show; places of tags in the bag.

    law : share of OP's moves that the law explains, 0 to 1, in blocks of `width` samples; noise : share of the
    innovations of OP and PV that is one; asked : weight from which a pair counts at this width; runner_up : weight of
    the next best tag; towards : how much more the law holds from PV to OP than back; nearer : how much nearer SP lies
    to the mean of PV than to that of OP; own : how near a set point of no other pair lies to OP, 1 where far;
    shared : whether OP or PV is another loop's set point as well; acts : whether SP moves OP as PV does; told : share
    that the law explains in blocks of `told_width`, the shortest in which it holds; kp : gain, in units of OP per
    unit of PV, negative where OP rises with PV; ti_samples : integral time, inf where none acts, None where two
    ways to it disagree: noise of PV between its samples hides it from the one, not from the other, which asks the
    samples beside.
    """

    pv: int
    op: int
    sp: int | None
    law: float
    noise: float
    width: int
    asked: float
    runner_up: float
    towards: float = 0.0
    nearer: float = 0.0
    own: float = 1.0
    shared: bool = False
    acts: bool = False
    told: float = 0.0
    told_width: int = 1
    kp: float = 0.0
    ti_samples: float | None = None

    @property
    def weight(self) -> float:
        """How much like a controller's the pair is, 0 to 1."""
        return float(self.law * np.sqrt(self.noise))

    @property
    def sure_pct(self) -> float:
        """How sure the pair is [%], by the weakest of its signs: the weight, the runner-up, which of both is OP;
        and an OP that rises with PV, where nothing tells which is which, may be the PV of a follower."""
        signs = (
            self.weight / (self.asked * (FINDER.acting if self.acts else 1.0)),
            self.noise / (FINDER.least_noise * (FINDER.acting if self.acts else 1.0)),
            (FINDER.second_shared if self.shared else FINDER.second)
            * self.weight
            / max(self.runner_up, 1e-9),
            (self.towards + self.nearer) / FINDER.turned,
            self.own / FINDER.own if self.weight < FINDER.plain else np.inf,
            np.inf if self.kp >= 0.0 or self.towards >= 1.0 else FINDER.direct,
        )
        odds = FINDER.sure_pct / (100.0 - FINDER.sure_pct) * max(min(signs), 0.0) ** 2
        return float(min(100.0 * odds / (1.0 + odds), FINDER.surest_pct))


@dataclass(frozen=True, slots=True)
class Bag:
    """What is asked of a bag of tags on one clock: values, shape (n, tags), and which of them move how.

    live : tags that move often enough to be PV or OP; still : tags that never do; same : first of the tags that hold
    what another holds too, by tag.
    """

    values: Matrix
    live: tuple[int, ...]
    still: tuple[int, ...]
    moving: tuple[int, ...]
    same: NDArray[np.int64]

    @classmethod
    def of(cls, values: Matrix) -> Bag:
        """From values without gaps."""
        moved = (np.diff(values, axis=0) != 0).sum(axis=0)
        first: dict[bytes, int] = {}
        same = np.array([first.setdefault(values[:, k].tobytes(), k) for k in range(values.shape[1])])
        own = same == np.arange(len(same))
        least = max(FINDER.least_moves, FINDER.live_share * len(values))
        live, moving = np.flatnonzero(own & (moved >= least)), np.flatnonzero(own & (moved > 0))
        return cls(values, tuple(live), tuple(np.flatnonzero(moved == 0)), tuple(moving), same)

    def twice(self, tag: int) -> bool:
        """Whether another tag holds the same: the output of a master and the set point of its slave."""
        return bool((self.same == tag).sum() > 1)


def errors(bag: Bag) -> list[Cause]:
    """Pairs of tags that may be PV and SP, for one follows the other about its level."""
    if not bag.live or not bag.moving:
        return []
    width = max(len(bag.values) // FINDER.slow_blocks, 1)
    moving = np.array(bag.moving)
    whole = len(bag.values) // width * width
    slow = bag.values[:whole, moving].reshape(-1, width, len(moving)).mean(axis=1)
    mean, spread = slow.mean(axis=0), np.maximum(slow.std(axis=0), 1e-9)
    unit, twice = (slow - mean) / spread, np.array([bag.twice(k) for k in moving])
    found: set[Cause] = set()
    for i in np.flatnonzero(np.isin(moving, bag.live)):
        alike = unit.T @ unit[:, i] / len(unit)
        away = np.abs(mean - mean[i]) / np.maximum(spread, spread[i])
        may = (alike > FINDER.follows) | twice
        near = np.flatnonzero(may & (away < FINDER.about) & (np.arange(len(mean)) != i))
        for k in near[np.argsort(-alike[near])][: FINDER.set_points if len(bag.live) < FINDER.many else 1]:
            pair = int(moving[i]), int(moving[k])
            found.add(pair if pair[1] not in bag.live else (min(pair), max(pair)))
    return sorted(found)


@dataclass(frozen=True, slots=True)
class Scores:
    """The law (either way) and the noise that is shared, of causes and live tags by width, shape (widths, causes,
    tags); moves, a width each."""

    causes: Sequence[Cause]
    law: NDArray[np.float32]
    noise: NDArray[np.float32]
    moves: Sequence[Moves]
    widths: Sequence[int]

    def weight(self, *at: slice | int | NDArray[np.int64]) -> NDArray[np.float32]:
        """How much like a controller's, at places of (widths, causes, tags)."""
        return np.asarray(self.law[at] * np.sqrt(self.noise[at]))


def scored(bag: Bag) -> Scores:
    """How much like a controller's each pair of cause and live tag is."""
    others = [k for k in bag.moving if k not in bag.live]
    causes = [*((k,) for k in (*bag.live, *others)), *errors(bag)]
    columns = [bag.values[:, c[0]] - (bag.values[:, c[1]] if len(c) > 1 else 0.0) for c in causes]
    held, count = np.column_stack(columns), len(bag.live)
    each = widths(len(held))
    moves = [Moves.of(held, width) for width in each]
    law = np.empty((len(each), len(causes), count), dtype=np.float32)
    noise = np.empty_like(law)
    for k, m in enumerate(moves):
        law[k] = np.maximum(explained(m, m.of_tags(count)), explained(m.of_tags(count), m).T)
        noise[k] = shared_noise(m, m.of_tags(count))
    for c, cause in enumerate(causes):
        own = np.isin(bag.live, bag.same[list(cause)])
        law[:, c, own] = noise[:, c, own] = 0.0
    return Scores(causes, law, noise, moves, each)


def found_pairs(values: Matrix) -> list[FoundPair]:
    """Loops among tags, the surest first, whether sure or not.

    Parameters
    ----------
    values : ndarray, shape (n, tags)
        On one clock, without gaps, each in its own unit.
    """
    bag = Bag.of(values)
    if len(bag.live) < 2 or len(values) < FINDER.least_blocks:
        return []
    scores = scored(bag)
    weight, set_points = _preferred(bag, scores)
    chosen = _one_to_one(bag, scores, weight)
    taken = _taken(bag, scores, chosen, set_points)
    return _with_set_points(bag, [_pair(bag, scores, c, j, taken) for c, j in chosen])


def _taken(
    bag: Bag, scores: Scores, chosen: Sequence[tuple[int, int]], set_points: set[int]
) -> NDArray[np.float64]:
    """The weight of the pair in which each live tag is, 0 where it is in none, inf for set points; shape (tags,)."""
    weight = np.where(np.isin(bag.live, list(set_points)), np.inf, 0.0)
    for c, j in chosen:
        own = np.isin(bag.live, (*scores.causes[c], bag.live[j]))
        weight[own] = np.maximum(weight[own], scores.weight(slice(None), c, j).max())
    return weight


def _one_to_one(bag: Bag, scores: Scores, weight: NDArray[np.float32]) -> list[tuple[int, int]]:
    """Causes and tags, each tag in one pair at most: the likest first. A set point stands for itself no more."""
    taken: set[int] = set()
    chosen = []
    likely = np.flatnonzero(weight >= FINDER.least_weight)
    for at in likely[np.argsort(-weight.ravel()[likely])]:
        c, j = divmod(int(at), weight.shape[1])
        cause, tag = scores.causes[c], bag.live[j]
        if taken.isdisjoint((*cause, tag)):
            chosen.append((c, j))
            taken |= {tag, *cause[:1], *(k for k in cause if not bag.twice(k))}
    return chosen


def _preferred(bag: Bag, scores: Scores) -> tuple[NDArray[np.float32], set[int]]:
    """Weights of causes and tags, shape (causes, tags), and the set points: one beside PV comes first where the law
    is better for it than by either alone, and then is neither PV nor OP itself."""
    weight = np.max([scores.weight(w) for w in range(len(scores.widths))], axis=0)
    alone = {cause[0]: c for c, cause in enumerate(scores.causes) if len(cause) == 1}
    set_points = set()
    for c, cause in enumerate(scores.causes):
        if len(cause) > 1:
            each = np.max([scores.law[:, alone[k]] for k in cause], axis=0)
            own = scores.weight(slice(None), c)
            near = own >= FINDER.likely * own.max(axis=0)
            better = ((1 - scores.law[:, c] < FINDER.better * (1 - each)) & near).any(axis=0)
            weight[c] = np.where(
                better, np.maximum(weight[c], weight[[alone[k] for k in cause]].max(axis=0)), 0.0
            )
            j = int(np.argmax(weight[c]))
            sp = _pv_and_sp(bag, scores, cause, bag.live[j])[1]
            if not bag.twice(sp) and weight[c, j] > FINDER.likely:
                set_points.add(sp)
    single = [c for c, cause in enumerate(scores.causes) if len(cause) == 1]
    weight[[c for c in single if scores.causes[c][0] in set_points or c >= len(bag.live)]] = 0.0
    weight[:, np.isin(bag.live, list(set_points))] = 0.0
    return weight, set_points


def _pair(bag: Bag, scores: Scores, c: int, j: int, taken: NDArray[np.float64]) -> FoundPair:
    """The pair of a cause and a tag at the width where it shows most; one of a PV alone in samples, or in blocks so
    long that no wave is left in them, for between these all that shares a wave looks like a law.

    taken : weight of the pair of each live tag; one that is surer of another pair is no runner-up.
    """
    cause, tag, weight = scores.causes[c], bag.live[j], scores.weight(slice(None), c, j)
    asked = np.array([FINDER.weights[FINDER.widths.index(width)] for width in scores.widths])
    pv, sp = _pv_and_sp(bag, scores, cause, tag) if len(cause) > 1 else (cause[0], None)
    may = [True, *(sp is not None or width >= FINDER.longest for width in scores.widths[1:])]
    w = int(np.argmax(np.where(may, weight / asked, 0.0)))
    others = np.flatnonzero(~np.isin(bag.live, (*cause, tag)))
    rivals = scores.weight(w, others, j)
    law = scores.law[:, c, j]
    told = int(np.argmax(law >= min(FINDER.law_told, law.max())))
    towards = _towards(bag, scores, c, j)
    acts = sp is not None and _acts(bag, (pv, sp, tag), scores.widths[told])
    return FoundPair(
        int(pv),
        int(tag),
        sp,
        law=float(scores.law[w, c, j]),
        noise=float(scores.noise[w, c, j]),
        width=scores.widths[w],
        asked=float(asked[w]),
        runner_up=float(np.max(rivals, where=rivals > FINDER.second * taken[others], initial=0.0)),
        towards=towards if not acts else FINDER.certain * (towards >= 0.0),  # signs that differ tell nothing
        acts=acts,
        shared=any(map(bag.twice, (pv, tag))),
        told=float(law[told]) if sp is not None or w == 0 else 0.0,  # SP may have moved both
        told_width=scores.widths[told],
    )


def _acts(bag: Bag, tags: tuple[int, int, int], width: int) -> bool:
    """Whether SP moves OP as PV does, with the other sign: tags are PV, SP and OP."""
    moves = Moves.of(bag.values[:, tags], width)
    error = moves.integral[:, 0] - moves.integral[:, 1]
    slope, _ = fitted(moves.value[:, 2], moves.value[:, 0], moves.value[:, 1], error)
    return bool(1.0 / FINDER.as_pv < -slope[1] / (slope[0] or TINY) < FINDER.as_pv)


def _towards(bag: Bag, scores: Scores, c: int, j: int) -> float:
    """How much more the law holds from PV to OP than back: at the width where that shows most of those at which
    neighbouring averages are alike, for a cycle that the samples miss shows nothing."""
    tags = [scores.causes[c][0], bag.live[j]]
    found = [0.0]
    for width, moves in zip(scores.widths, scores.moves, strict=True):
        x = blocks(bag.values[:, tags], width)
        alike = [np.corrcoef(x[1:, k], x[:-1, k])[0, 1] for k in (0, 1)]
        if min(alike) >= FINDER.resolved:
            found.append(direction(moves, c, j))
    return float(np.clip(max(found, key=abs) / FINDER.errors, -FINDER.certain, FINDER.certain))


def _pv_and_sp(bag: Bag, scores: Scores, cause: Cause, op: int) -> tuple[int, int]:
    """Which of two tags that follow one another is PV, and which SP: what another tag holds too, in its own scale
    (the output of a master, the PV of a leader), or what moves seldom; else SP does not follow OP later."""
    pv, sp = cause
    moved = [int((np.diff(bag.values[:, k]) != 0).sum()) for k in cause]
    held = [_held_elsewhere(bag, scores, k, (*cause, op)) for k in cause]
    seldom = min(moved) < FINDER.seldom * max(moved)
    if held[0] != held[1] and min(moved) > FINDER.steps * max(moved):
        swap = held[0]
    elif seldom:
        swap = moved[0] < moved[1]
    else:
        left = innovations(np.diff(bag.values[:, [*cause, op]], axis=0))
        after = [[np.dot(left[:-k, 2], left[k:, i]) ** 2 for k in range(1, FINDER.later)] for i in (0, 1)]
        swap = sum(after[0]) / np.dot(left[:, 0], left[:, 0]) < sum(after[1]) / np.dot(left[:, 1], left[:, 1])
    return (sp, pv) if swap else (pv, sp)


def _held_elsewhere(bag: Bag, scores: Scores, tag: int, own: Cause) -> bool:
    """Whether a tag's innovations are those of another tag that is none of its `own` loop."""
    if bag.twice(tag) or tag not in bag.live:
        return bag.twice(tag)
    others = np.flatnonzero(~np.isin(bag.live, own))
    return bool(scores.noise[0, bag.live.index(tag), others].max(initial=0.0) > FINDER.copied)


def _with_set_points(bag: Bag, pairs: Sequence[FoundPair]) -> list[FoundPair]:
    """The pairs with set points that never move, one each, by how near they lie to the mean of PV; PV and OP change
    places where one lies nearer to OP."""
    from scipy.optimize import linear_sum_assignment  # half a second, for those who look for loops alone

    taken = {p.sp for p in pairs if p.sp is not None}
    free = [k for k in bag.still if k not in taken]
    if not free or not pairs:
        return sorted((_with_settings(bag, _turned(p)) for p in pairs), key=lambda p: -p.weight)
    level = bag.values[0, free]
    gap = np.array([[_gaps(bag, k, level) for k in (p.pv, p.op)] for p in pairs])
    alone = [i for i, p in enumerate(pairs) if p.sp is None]
    rows, columns = linear_sum_assignment(np.log(gap[alone].min(axis=1))) if alone else ([], [])
    held = {alone[i]: int(k) for i, k in zip(rows, columns, strict=True)}
    claimed = {k for i, k in held.items() if gap[i, :, k].min() < FINDER.claimed}
    loose = [k for k in range(len(free)) if k not in claimed]
    out = [_with_set_point(pair, gap[i], held.get(i), free, loose) for i, pair in enumerate(pairs)]
    return sorted((_with_settings(bag, p) for p in out), key=lambda p: -p.weight)


def known_pair(values: Matrix) -> FoundPair:
    """The law of a loop whose tags are known: PV, OP and, where there is one, SP, shape (n, 2) or (n, 3)."""
    sp = 2 if values.shape[1] > 2 else None
    error = values[:, 0] - (0.0 if sp is None else values[:, 2])
    columns, each = np.column_stack([error, values[:, 1]]), widths(len(values))
    moves = [Moves.of(columns, width) for width in each]
    law = np.array([explained(m, m)[0, 1] for m in moves])
    told = int(np.argmax(law >= min(FINDER.law_told, law.max())))
    noise = float(shared_noise(moves[told], moves[told])[0, 1])
    found = FoundPair(0, 1, sp, float(law[told]), noise, each[told], 1.0, 0.0)
    return _with_settings(Bag.of(values), replace(found, told=float(law[told]), told_width=each[told]))


def _with_settings(bag: Bag, pair: FoundPair) -> FoundPair:
    """The pair with gain and integral time of the law, from blocks in which it holds and OP is at no limit."""
    op, low = bag.values[:, pair.op], 0.0 if pair.sp is None else bag.values[:, pair.sp]
    error = bag.values[:, [pair.pv]] - np.reshape(low, (-1, 1))
    moves = Moves.of(np.column_stack([error, op]), pair.told_width)
    margin = FINDER.at_limit * np.ptp(op)
    limited = (op <= op.min() + margin) | (op >= op.max() - margin)
    within = blocks(limited[:, None].astype(float), pair.told_width)[:, 0] == 0.0
    rows = np.flatnonzero(within[1:] & within[:-1])
    rows = rows[(rows > 0) & (rows < len(moves.value) - 1)]
    moved, wanted, summed = moves.value[rows, 0], moves.value[rows, 1], moves.integral[rows, 0]
    if len(rows) < FINDER.least_moves:
        return replace(pair, kp=0.0, ti_samples=None)
    slope, deviation = fitted(wanted, moved, summed)
    kp, repeats = -float(slope[0]), float(slope[1] / (slope[0] or TINY))
    level = blocks(error, pair.told_width)[:, 0]
    beside = level[rows - 1] + level[rows + 2]
    beside = beside - beside.mean()
    other = float(beside @ (wanted - slope[0] * moved) / ((beside @ summed) or TINY) / (slope[0] or TINY))
    surely = abs(slope[0]) / (abs(slope[1]) + FINDER.acts * deviation[1])
    if surely > FINDER.alone * len(bag.values):
        return replace(pair, kp=kp, ti_samples=np.inf)
    agreed = min(repeats, other) > 0.0 and abs(repeats / other - 1.0) < FINDER.agreed
    return replace(pair, kp=kp, ti_samples=1.0 / other if agreed else None)


def _with_set_point(
    pair: FoundPair, gap: Matrix, k: int | None, free: Sequence[int], loose: list[int]
) -> FoundPair:
    """A pair with the set point at place `k` of the free ones, whose distances from PV and OP are `gap`; the `loose`
    ones are no pair's."""
    if k is None:
        turned = _turned(pair)
    else:
        told = float(np.clip(np.log(gap[1, k] / gap[0, k]), -FINDER.certain, FINDER.certain))
        turned = _turned(replace(pair, nearer=told))
    pv, op = gap if turned.pv == pair.pv else gap[::-1]
    sp = free[k] if k is not None and pv[k] < 1.0 else turned.sp
    return replace(turned, sp=sp, own=float(op[loose].min(initial=1.0)))


def _gaps(bag: Bag, tag: int, level: Matrix) -> Matrix:
    """How far set points lie from the mean of a tag: in its spreads, times the share of the distance of the next
    other one; 1 at most."""
    x = bag.values[:, tag]
    away = np.abs(level - x.mean())
    other = np.where(level[:, None] == level, np.inf, away).min(axis=1)
    near = np.clip(away / max(float(x.std()), 1e-9), FINDER.nearest, 1.0)
    beside = np.where(np.isfinite(other), away / np.maximum(other, 1e-9), 1.0)
    return np.asarray(near * np.clip(beside, FINDER.nearest, 1.0))


def _turned(pair: FoundPair) -> FoundPair:
    """The pair the way round for which more speaks."""
    if pair.towards + pair.nearer >= 0.0:
        return pair
    return replace(pair, pv=pair.op, op=pair.pv, towards=-pair.towards, nearer=-pair.nearer)
