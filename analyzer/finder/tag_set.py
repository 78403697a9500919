"""Candidate roles of tags: which may be PV, OP or SP, at which set point one is controlled, and which one
responds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analyzer.finder.held import LEAST_MOVES, SLOW_BLOCKS, answers, nearness, tracked
from analyzer.finder.law import Matrix, blocks
from analyzer.finder.position_and_mode import LIVE_SHARE

FOLLOWS = 0.3
"""Correlation of averages over long blocks from which one tag may be the set point of the other:
proofs/finder.md."""
ABOUT = 0.7  # Distance of their means over the larger spread of both, at most: proofs/finder.md
SET_POINTS = 2  # Tags that are tried as a set point of each [tags]: proofs/finder.md
HELD = 2.0
"""Least nearness (natural log) to a moving set point of a tag that is controlled at it: proofs/finder.md."""
HELD_ALONE = 1.0  # Least margin of its nearness to that of any other tag: proofs/finder.md
ANSWERS = 8.0
"""Significance from which a tag moves in the same sample as a set point [standard errors]:
proofs/finder.md."""
ANSWERS_ALONE = 2.5
"""Least ratio of its significance to that of any other tag, and to that with any other set point:
proofs/finder.md."""
UNLIKE = -0.05
"""Log of a tag's slow moves over those of its error below which it is not held at a set point that moves:
proofs/finder.md."""
MANY = 500  # Tags from which one set point is tried of each [tags]: proofs/finder.md

Cause = tuple[int, ...]
"""A tag that may be PV, or PV and SP with the difference as error."""


@dataclass(frozen=True, slots=True)
class TagSet:
    """An unordered set of tags on one clock: values, shape (n, tags), and how they move.

    live : tags that move often enough to be PV or OP; still : tags that never move; same : first tag with identical
    values, by tag.
    """

    values: Matrix
    live: tuple[int, ...]
    still: tuple[int, ...]
    moving: tuple[int, ...]
    same: NDArray[np.int64]

    @classmethod
    def of(cls, values: Matrix) -> TagSet:
        """From values without gaps."""
        moved = (np.diff(values, axis=0) != 0).sum(axis=0)
        first: dict[bytes, int] = {}
        same = np.array([first.setdefault(values[:, k].tobytes(), k) for k in range(values.shape[1])])
        own = same == np.arange(len(same))
        least = max(LEAST_MOVES, LIVE_SHARE * len(values))
        live, moving = np.flatnonzero(own & (moved >= least)), np.flatnonzero(own & (moved > 0))
        return cls(values, tuple(live), tuple(np.flatnonzero(moved == 0)), tuple(moving), same)

    def is_duplicate(self, tag: int) -> bool:
        """Whether another tag has identical values: the output of a master and the set point of its slave."""
        return bool((self.same == tag).sum() > 1)


def errors(bag: TagSet) -> set[Cause]:
    """Pairs of tags that may be PV and SP, because one follows the other about its level."""
    if not bag.live or not bag.moving:
        return set()
    width = max(len(bag.values) // SLOW_BLOCKS, 1)
    moving = np.array(bag.moving)
    slow = blocks(bag.values[:, moving], width)
    mean, spread = slow.mean(axis=0), np.maximum(slow.std(axis=0), 1e-9)
    unit, twice = (slow - mean) / spread, np.array([bag.is_duplicate(k) for k in moving])
    found: set[Cause] = set()
    for i in np.flatnonzero(np.isin(moving, bag.live)):
        alike = unit.T @ unit[:, i] / len(unit)
        away = np.abs(mean - mean[i]) / np.maximum(spread, spread[i])
        may = (alike > FOLLOWS) | twice
        near = np.flatnonzero(may & (away < ABOUT) & (np.arange(len(mean)) != i))
        for k in near[np.argsort(-alike[near])][: SET_POINTS if len(bag.live) < MANY else 1]:
            pair = int(moving[i]), int(moving[k])
            found.add(pair if pair[1] not in bag.live else (min(pair), max(pair)))
    return found


def held_at(bag: TagSet) -> set[Cause]:
    """Tags with the set point at which each is clearly controlled, unlike any other tag. The set point rarely moves,
    or is recorded twice, as a master's output is."""
    moving = [k for k in bag.moving if k not in bag.live or bag.is_duplicate(k)]
    if len(bag.live) < 2 or not moving:
        return set()
    unlike = tracked(bag.values[:, bag.live], bag.values[:, moving]) < UNLIKE
    never = np.equal.outer(bag.live, moving) | (unlike & ~np.array([bag.is_duplicate(k) for k in moving]))
    near = np.where(never, 0.0, nearness(bag.values, bag.live, moving))
    best, (second, first) = np.argmax(near, axis=0), np.sort(near, axis=0)[-2:]
    plain = (first >= HELD) & (first - second >= HELD_ALONE)
    return {(bag.live[best[k]], moving[k]) for k in np.flatnonzero(plain)}


def answering(bag: TagSet, held: set[Cause]) -> dict[Cause, int]:
    """The tag that moves immediately with the set point of another tag, if it is the only one: OP."""
    pairs = sorted(held)
    others = [k for k in bag.live if k not in {pv for pv, _ in pairs}]
    if not pairs or len(others) < 2:
        return {}
    size = answers(bag.values, others, [sp for _, sp in pairs])
    found = {}
    while size.max() >= ANSWERS:
        i, k = np.unravel_index(np.argmax(size), size.shape)
        most, size[i, k] = size[i, k], 0.0
        if ANSWERS_ALONE * max(size[i].max(), size[:, k].max()) <= most:
            found[pairs[k]] = others[i]
        size[i] = size[:, k] = 0.0
    return found
