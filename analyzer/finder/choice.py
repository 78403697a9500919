"""Choice of pairs: PV with its set point if there is one, and one-to-one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analyzer.finder.roles import pv_and_sp
from analyzer.finder.scores import Scores
from analyzer.finder.tag_set import Cause, TagSet, answering

BETTER = 0.7  # Share of PV's unexplained part that may remain with a set point: proofs/finder.md
LIKELY = 0.5  # Weight of a pair from which its set point is no PV and no OP: proofs/finder.md
LINKED = 0.95  # Weight of a pair whose OP moves at once with the set point of its PV: proofs/finder.md
LEAST_WEIGHT = 0.02  # Weight below which no pair is tested: proofs/finder.md


def preferred(bag: TagSet, scores: Scores) -> tuple[NDArray[np.float32], set[int], dict[Cause, int]]:
    """Weights of causes and tags, shape (causes, tags), and the set points. A pair of PV and SP has priority if the
    law is better for it than for either alone; its set point is then neither PV nor OP."""
    weight = np.max([scores.weight(w) for w in range(len(scores.widths))], axis=0)
    alone = {cause[0]: c for c, cause in enumerate(scores.causes) if len(cause) == 1}
    held, set_points = _by_law(scores, weight.max(axis=1)), set[int]()
    answer = answering(bag, held)
    for c, cause in enumerate(scores.causes):
        if cause in held:
            _keep(bag, weight, alone, (c, cause), answer.get(cause))
            set_points |= set() if bag.is_duplicate(cause[1]) else {cause[1]}
        elif len(cause) > 1:
            each = np.max([scores.law[:, alone[k]] for k in cause], axis=0)
            own = scores.weight(slice(None), c)
            near = own >= LIKELY * own.max(axis=0)
            better = ((1 - scores.law[:, c] < BETTER * (1 - each)) & near).any(axis=0)
            either = weight[[alone[k] for k in cause]].max(axis=0)
            weight[c] = np.where(better, np.maximum(weight[c], either), 0.0)
            j = int(np.argmax(weight[c]))
            sp = pv_and_sp(bag, scores, cause, bag.live[j])[1]
            if not bag.is_duplicate(sp) and weight[c, j] > LIKELY:
                set_points.add(sp)
    single = [c for c, cause in enumerate(scores.causes) if len(cause) == 1]
    weight[[c for c in single if scores.causes[c][0] in set_points or c >= len(bag.live)]] = 0.0
    weight[:, np.isin(bag.live, list(set_points))] = 0.0
    return weight, set_points, answer


def _keep(
    bag: TagSet, weight: NDArray[np.float32], alone: dict[int, int], held: tuple[int, Cause], op: int | None
) -> None:
    """Set weights so that PV is combined only with the set point at which it alone is controlled, an index and its
    tags, and only with the OP that responds, if there is one."""
    c, (pv, _) = held
    weight[c] = np.maximum(weight[c], weight[alone[pv]])
    weight[alone[pv]] = weight[:, bag.live.index(pv)] = 0.0
    if op is not None:
        j = bag.live.index(op)
        linked = max(float(weight[c, j]), LINKED)
        weight[c] = weight[:, j] = weight[alone[op]] = 0.0
        weight[c, j] = linked


def _by_law(scores: Scores, most: NDArray[np.float32]) -> set[Cause]:
    """Controlled tags and set points without another tag of more weight there; most : weight of each cause."""
    own = dict(zip(scores.causes, most, strict=True))

    def other(held: Cause) -> float:
        others = (cause for cause in own if len(cause) > 1 and held[1] in cause and held[0] not in cause)
        return max((float(own[cause]) for cause in others), default=0.0)

    return {cause for cause in scores.held if other(cause) < max(LIKELY, float(own[cause]))}


def one_to_one(bag: TagSet, scores: Scores, weight: NDArray[np.float32]) -> list[tuple[int, int]]:
    """Causes and tags in order of weight, each tag in at most one pair. A set point is then no cause of its own."""
    taken: set[int] = set()
    chosen = []
    likely = np.flatnonzero(weight >= LEAST_WEIGHT)
    for at in likely[np.argsort(-weight.ravel()[likely])]:
        c, j = divmod(int(at), weight.shape[1])
        cause, tag = scores.causes[c], bag.live[j]
        if taken.isdisjoint((*cause, tag)):
            chosen.append((c, j))
            taken |= {tag, *cause[:1], *(k for k in cause if not bag.is_duplicate(k))}
    return chosen
