"""Identification of PV, OP and SP of loops from data: one-to-one over all tags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analyzer.finder.choice import one_to_one, preferred
from analyzer.finder.held import (
    CERTAIN,
    alike,
    by_chance,
    closeness,
    law_of,
    limited,
    long_blocks,
    nearness,
    nearness_margin,
    resting_level,
)
from analyzer.finder.law import LEAST_BLOCKS, WIDTHS, Matrix, explained_by_errors, widths
from analyzer.finder.pair import LEAST_LAW_SHARE, LEAST_NOISE, SECOND, FoundPair, with_settings
from analyzer.finder.roles import acts, direction_evidence, output_evidence, pv_and_sp, resolved
from analyzer.finder.scores import Scores, scored
from analyzer.finder.tag_set import TagSet

WEIGHTS = (0.04, 0.5, 0.7, 0.9)
"""Weight of a pair from which it counts, by the lengths of blocks: many tags share slow moves:
proofs/finder.md."""
LONGEST = 64  # Length of blocks from which a PV alone is believed again [samples]: proofs/finder.md


def found_pairs(values: Matrix) -> list[FoundPair]:
    """Loops among tags, most confident first, including those of low confidence.

    Parameters
    ----------
    values : ndarray, shape (n, tags)
        On one clock, without gaps, each in its own unit.
    """
    bag = TagSet.of(values)
    if len(bag.live) < 2 or len(values) < LEAST_BLOCKS:
        return []
    scores = scored(bag)
    weight, set_points, answer = preferred(bag, scores)
    chosen = one_to_one(bag, scores, weight)
    taken = _taken(bag, scores, chosen, set_points)
    pairs = [
        replace(
            _pair(bag, scores, c, j, taken, _slaves(bag, scores, chosen, bag.live[j])),
            answers=answer.get(scores.causes[c]) == bag.live[j],
        )
        for c, j in chosen
    ]
    return _with_set_points(bag, scores, pairs)


def _taken(
    bag: TagSet, scores: Scores, chosen: Sequence[tuple[int, int]], set_points: set[int]
) -> NDArray[np.float64]:
    """The weight of the pair of each live tag, 0 if it is in none, inf for set points; shape (tags,)."""
    weight = np.where(np.isin(bag.live, list(set_points)), np.inf, 0.0)
    for c, j in chosen:
        own = np.isin(bag.live, (*scores.causes[c], bag.live[j]))
        weight[own] = np.maximum(weight[own], scores.weight(slice(None), c, j).max())
    return weight


def _slaves(bag: TagSet, scores: Scores, chosen: Sequence[tuple[int, int]], tag: int) -> set[int]:
    """Tags of the pairs whose set point a tag is: they follow it, and do not belong to its own loop."""
    own = [(*scores.causes[c], bag.live[j]) for c, j in chosen if len(scores.causes[c]) > 1]
    return {k for tags in own if tag in tags[:2] for k in tags if k != tag}


def _pair(
    bag: TagSet, scores: Scores, c: int, j: int, taken: NDArray[np.float64], slaves: set[int]
) -> FoundPair:
    """The pair of a cause and a tag at the width with the strongest evidence. A PV without SP is tested in samples,
    or in blocks longer than any oscillation: between these, any common oscillation resembles a law.

    taken : weight of the pair of each live tag; a tag with a stronger other pair is no runner-up; slaves : tags of
    the pairs whose set point OP is.
    """
    cause, tag = scores.causes[c], bag.live[j]
    weight = scores.weight(slice(None), c, j)
    pv, sp = pv_and_sp(bag, scores, cause, tag) if len(cause) > 1 else (cause[0], None)
    if sp is not None and sp not in bag.live:  # SP hardly moves: the law may be clearer for PV alone
        own = bag.live.index(pv)
        if scores.weight(0, own, j) > weight.max():
            c, cause = own, (pv,)
    error = bag.values[:, cause[0]] - (bag.values[:, cause[1]] if len(cause) > 1 else 0.0)
    held = np.column_stack([error, bag.values[:, tag]])
    law, noise = (np.asarray(x[:, c, j], dtype=float) for x in (scores.law, scores.noise))
    if any(map(limited, held.T)):
        law, noise = law_of(held, scores.widths)
    may = [True, *(len(cause) > 1 or width >= LONGEST for width in scores.widths[1:])]
    required = required_weights(scores.widths)
    w = int(np.argmax(np.where(may, _enough(law * np.sqrt(noise), noise, required), 0.0)))
    one = np.array(bag.live)[scores.alike[[j, bag.live.index(pv)]].any(axis=0)]
    others = np.flatnonzero(~np.isin(bag.live, [k for k in (pv, sp, tag, *slaves, *one) if k is not None]))
    weights = scores.weight(w, others, j)
    shown = int(np.argmax(law >= min(LEAST_LAW_SHARE, law.max())))
    return FoundPair(
        int(pv),
        int(tag),
        sp,
        law=float(law[w]),
        noise=float(noise[w]),
        width=scores.widths[w],
        required_weight=float(required[w]),
        runner_up=float(np.max(weights, where=weights > SECOND * taken[others], initial=0.0)),
        direction_evidence=direction_evidence(held, scores, c, j),
        output_evidence=output_evidence(bag.values[:, pv], bag.values[:, tag], sp is None)
        + CERTAIN * (float(bag.is_duplicate(tag)) - float(bag.is_duplicate(pv))),
        resolved=resolved(held, scores.widths[w]),
        law_share=float(law[shown]) if sp is not None or w == 0 else 0.0,  # SP may have moved both
        law_width=scores.widths[shown],
    )


def required_weights(each: Sequence[int]) -> Matrix:
    """Required weight of a pair at each width."""
    return np.array([WEIGHTS[WIDTHS.index(width)] for width in each])


def _enough(weight: NDArray[Any], noise: NDArray[Any], required: Matrix) -> Matrix:
    """Ratio of weight and of shared noise to the required values: the smaller one, by width."""
    return np.asarray(np.minimum(weight / required, noise / LEAST_NOISE))


def _with_set_points(bag: TagSet, scores: Scores, pairs: Sequence[FoundPair]) -> list[FoundPair]:
    """The pairs in the direction with more evidence, each with the set point of most evidence, one-to-one: the one in
    its law, or one at the level of a tag with the tag's slow moves."""
    from scipy.optimize import linear_sum_assignment  # takes half a second; needed only by the finder

    if not pairs:
        return []
    taken = {p.sp for p in pairs if p.sp is not None}
    free = [k for k in (*bag.still, *bag.moving) if k not in taken and k not in bag.live]
    tags = sorted({k for p in pairs for k in (p.pv, p.op)})
    known, level = nearness(bag.values, tags, free), bag.values[:, free].mean(axis=0)
    slow = long_blocks(bag.values)
    place = {tag: k for k, tag in enumerate(tags)}
    near = np.array([_near_both(bag, p, free, known[[place[p.pv], place[p.op]]], level, slow) for p in pairs])
    alone = [i for i, p in enumerate(pairs) if p.sp is None]
    gain = np.array(
        [min(pairs[i].weight / pairs[i].required_weight, 1.0) * _gain(pairs[i], near[i]) for i in alone]
    )
    rows, columns = linear_sum_assignment(gain.reshape(len(alone), len(free)), maximize=True)
    held = {alone[i]: int(k) for i, k in zip(rows, columns, strict=True)}
    out = [_with_set_point(bag, p, near[i], held.get(i), free) for i, p in enumerate(pairs)]
    out = [replace(p, other=other) for p, other in zip(out, _other_pvs(bag, scores, out), strict=True)]
    return sorted((with_settings(bag, p) for p in out), key=lambda p: -p.weight)


def _other_pvs(bag: TagSet, scores: Scores, pairs: Sequence[FoundPair]) -> list[float]:
    """Of each pair the largest share of OP explained by another tag with its moving set point, in blocks of its
    width: a tag that only follows SP is also controlled there."""
    out, place = [0.0] * len(pairs), {c[0]: k for k, c in enumerate(scores.causes) if len(c) == 1}
    moving = [i for i, p in enumerate(pairs) if p.sp is not None and p.sp not in bag.still]
    for width in {pairs[i].width for i in moving}:
        at = [i for i in moving if pairs[i].width == width]
        columns = [
            [place[bag.same[tag]] for tag in tags]
            for tags in zip(*((pairs[i].sp, pairs[i].op) for i in at), strict=True)
        ]
        law = explained_by_errors(scores.moves[scores.widths.index(width)].of_tags(len(place)), *columns)
        for i, own in zip(at, law[: len(bag.live)].T, strict=True):
            out[i] = _largest_of_others(bag, pairs[i], pairs, own)
    return out


def _largest_of_others(bag: TagSet, pair: FoundPair, pairs: Sequence[FoundPair], law: Matrix) -> float:
    """The largest of the shares of the live tags, shape (tags,), without those of the pair, those equal to PV or OP,
    and those following OP."""
    slaves = {p.pv for p in pairs if p.sp is not None and bag.same[p.sp] == bag.same[pair.op]}
    none = {pair.pv, pair.op, bag.same[pair.sp], *slaves}
    for k in np.argsort(-law):
        tag = bag.live[k]
        if tag not in none and not alike(bag.values[:, [pair.pv, pair.op, tag]])[2, :2].any():
            return float(law[k])
    return 0.0


def _near_both(
    bag: TagSet, pair: FoundPair, free: Sequence[int], known: Matrix, level: Matrix, slow: Matrix
) -> Matrix:
    """Evidence for each free set point as that of PV, and as that of OP, shape (2, set points): what is `known` of
    both by their means and slow moves, or the level at which the other is constant by the law.

    level : mean of each free set point; slow : averages of all tags over long blocks, shape (blocks, tags).
    """
    near, still = known.copy(), np.isin(free, bag.still)
    for at, (tag, other) in enumerate(((pair.pv, pair.op), (pair.op, pair.pv))):
        x = bag.values[:, tag]
        held_at, error = resting_level(x, bag.values[:, other], pair.law_width)
        by_law = closeness(np.maximum(np.abs(level - held_at), error), x.std())
        near[at] -= by_chance(x, level, slow[:, [tag]] - slow[:, free])
        near[at, still] = np.maximum(near[at], by_law)[still]
        if free:
            near[at, np.argmax(near[at])] += nearness_margin(x, level, near[at])
    return near


def _gain(pair: FoundPair, near: Matrix) -> Matrix:
    """Additional evidence for a pair with each set point over none, in the better direction."""
    evidence = pair.direction_evidence + pair.output_evidence
    return np.asarray(np.maximum(near[0] + evidence, near[1] - evidence) - abs(evidence))


def _with_set_point(
    bag: TagSet, pair: FoundPair, near: Matrix, k: int | None, free: Sequence[int]
) -> FoundPair:
    """A pair with the set point at index `k` of the free ones, with nearness `near` to PV and OP."""
    if pair.sp is not None:
        pv, op = nearness(bag.values, (pair.pv, pair.op), [pair.sp])[:, 0]
    else:
        pv, op = (0.0, 0.0) if k is None else near[:, k]
    most = CERTAIN * (1 if pair.sp is None and (k is None or free[k] in bag.still) else 2)
    pv, op = max(pv, 0.0), max(op, 0.0)  # a distance from one tag is no evidence for the other
    turned = _turned(replace(pair, nearer=float(np.clip(pv - op, -most, most))))
    if pair.sp is None and k is not None and near[int(turned.pv != pair.pv), k] > 0.0:
        turned = replace(
            turned, sp=free[k], output_evidence=turned.output_evidence if free[k] in bag.still else 0.0
        )
    if turned.sp is not None and turned.sp not in bag.still:
        return _of_error(bag, turned, turned.sp)
    return turned


def _of_error(bag: TagSet, pair: FoundPair, sp: int) -> FoundPair:
    """The pair with the law of PV and SP together, at the width with the strongest evidence."""
    tags = bag.values[:, [pair.pv, sp, pair.op]]
    held, each = np.column_stack([tags[:, 0] - tags[:, 1], tags[:, 2]]), widths(len(tags))
    law, noise = law_of(held, each)
    w = int(np.argmax(_enough(law * np.sqrt(noise), noise, required_weights(each))))
    shown = int(np.argmax(law >= min(LEAST_LAW_SHARE, law.max())))
    found = replace(
        pair,
        law=float(law[w]),
        noise=float(noise[w]),
        width=each[w],
        required_weight=float(required_weights(each)[w]),
        resolved=resolved(held, each[w]),
        law_share=float(law[shown]),
        law_width=each[shown],
    )
    best = max(found, pair, key=lambda p: min(p.weight / p.required_weight, p.noise / LEAST_NOISE))
    return replace(best, acts=acts(tags, each[shown]))


def _turned(pair: FoundPair) -> FoundPair:
    """The pair in the direction with more evidence."""
    if pair.direction_evidence + pair.output_evidence + pair.nearer >= 0.0:
        return pair
    return replace(
        pair,
        pv=pair.op,
        op=pair.pv,
        direction_evidence=-pair.direction_evidence,
        output_evidence=-pair.output_evidence,
        nearer=-pair.nearer,
    )
