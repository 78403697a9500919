"""Similarity of each pair of tags to a controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analyzer.finder.held import alike
from analyzer.finder.law import Moves, explained_either_way, shared_noise, widths
from analyzer.finder.tag_set import Cause, TagSet, errors, held_at


@dataclass(frozen=True, slots=True)
class Scores:
    """The law (in either direction) and the shared noise, of causes and live tags by width, shape (widths, causes,
    tags); moves, one per width; held, the tags that are clearly controlled at a set point; alike, which live tags are
    equal except for backlash or noise, shape (tags, tags)."""

    causes: Sequence[Cause]
    law: NDArray[np.float32]
    noise: NDArray[np.float32]
    moves: Sequence[Moves]
    widths: Sequence[int]
    held: set[Cause]
    alike: NDArray[np.bool_]

    def weight(self, *at: slice | int | NDArray[np.int64]) -> NDArray[np.float32]:
        """Similarity to a controller, at indices of (widths, causes, tags)."""
        return np.asarray(self.law[at] * np.sqrt(self.noise[at]))


def scored(bag: TagSet) -> Scores:
    """Similarity of each pair of cause and live tag to a controller."""
    held = held_at(bag)
    others = [k for k in bag.moving if k not in bag.live]
    causes = [*((k,) for k in (*bag.live, *others)), *sorted(errors(bag) | held)]
    columns = [bag.values[:, c[0]] - (bag.values[:, c[1]] if len(c) > 1 else 0.0) for c in causes]
    error, count = np.column_stack(columns), len(bag.live)
    each = widths(len(error))
    moves = [Moves.of(error, width) for width in each]
    law = np.empty((len(each), len(causes), count), dtype=np.float32)
    noise = np.empty_like(law)
    for k, m in enumerate(moves):
        law[k] = explained_either_way(m, count)
        noise[k] = shared_noise(m, m.of_tags(count))
    one = alike(bag.values[:, bag.live])
    place = {tag: k for k, tag in enumerate(bag.live)}
    for c, cause in enumerate(causes):
        own = np.isin(bag.live, bag.same[list(cause)])
        own |= one[[place[k] for k in cause if k in place]].any(axis=0)
        law[:, c, own] = noise[:, c, own] = 0.0
    return Scores(causes, law, noise, moves, each, held, one)
