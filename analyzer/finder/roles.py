"""Decision which of two tags is OP, and which of two is SP."""

from __future__ import annotations

import numpy as np

from analyzer.finder.held import CERTAIN, LEAST_MOVES, at_no_limit, limited, slower
from analyzer.finder.law import TINY, Matrix, Moves, blocks, direction, fitted, innovations
from analyzer.finder.scores import Scores
from analyzer.finder.tag_set import Cause, TagSet

RESOLVED = 0.7
"""Correlation of neighbouring averages from which their order shows cause and effect: proofs/finder.md."""
ERRORS = 25.0
"""Difference of the law's two directions that counts as one unit of evidence [standard errors]. In
benchmarks/world (bags of seeds 49 to 56) and plants the direction is right in 243 of 244 loops from 30
standard errors on. Below, it is wrong in 7 of 14 (proofs/finder.md)."""
SELDOM = 0.7  # Moves of a set point over those of its PV, at most: proofs/finder.md
LATER = 6  # Samples within which PV follows OP, and a set point does not [samples]: proofs/finder.md
DRIFT = 4.0  # Weight of a factor e between the slow shares of OP and PV: proofs/finder.md
DRIFT_CERTAIN = 1.5  # Largest weight of drift as a sign of which of two tags is OP: proofs/finder.md
AT_LIMITS = 2.0  # Weight of the sign that only one of two tags is at an extreme: proofs/finder.md
TELLING = 0.5  # Share explained by the law, from which it shows which of two tags is OP: proofs/finder.md
AS_PV = 5.0  # Largest ratio of the effects of SP and PV on OP, and of the inverse: proofs/finder.md
COPIED = 0.85  # Share of innovations from which one tag is another in its own scale: proofs/finder.md
STEPS = 0.1
"""Moves of a tag over those of another from which it moves in steps and is the set point of both:
proofs/finder.md."""


def output_evidence(pv: Matrix, op: Matrix, still: bool) -> float:
    """How much more OP moves like an output than PV: it rests at its limits and, with constant SP, drifts."""
    drift = np.clip(slower(pv, op) * DRIFT, -DRIFT_CERTAIN, DRIFT_CERTAIN) * still
    return float(drift + AT_LIMITS * (float(limited(op)) - float(limited(pv))))


def direction_evidence(held: Matrix, scores: Scores, c: int, j: int) -> float:
    """Evidence for the law from PV to OP, the columns of `held`, over the reverse: at the width with the strongest
    evidence among those with similar neighbouring averages, because an undersampled cycle is no evidence."""
    found = [0.0]
    for width, moves, law in zip(scores.widths, scores.moves, scores.law[:, c, j], strict=True):
        if law >= TELLING and resolved(held, width):
            rows = at_no_limit(held, width)
            if len(rows) >= LEAST_MOVES:
                found.append(direction(moves, c, j, rows))
    return float(np.clip(max(found, key=abs) / ERRORS, -CERTAIN, CERTAIN))


def acts(tags: Matrix, width: int) -> bool:
    """Whether SP moves OP as PV does, with the opposite sign: tags are PV, SP and OP, shape (n, 3)."""
    moves = Moves.of(tags, width)
    error = moves.integral[:, 0] - moves.integral[:, 1]
    slope, _ = fitted(moves.value[:, 2], moves.value[:, 0], moves.value[:, 1], error)
    return bool(1.0 / AS_PV < -slope[1] / (slope[0] or TINY) < AS_PV)


def resolved(held: Matrix, width: int) -> bool:
    """Whether neighbouring averages of all tags are similar, shape (n, tags)."""
    x = blocks(held, width)
    x = x - x.mean(axis=0)
    return bool(((x[1:] * x[:-1]).sum(axis=0) >= RESOLVED * (x**2).sum(axis=0)).all())


def pv_and_sp(bag: TagSet, scores: Scores, cause: Cause, op: int) -> tuple[int, int]:
    """Which of two tags that follow each other is PV, and which SP: SP is duplicated by another tag in its own scale
    (a master's output, a leader's PV), or rarely moves; otherwise it is the one that does not follow OP later."""
    pv, sp = cause
    moved = [int((np.diff(bag.values[:, k]) != 0).sum()) for k in cause]
    held = [_held_elsewhere(bag, scores, k, (*cause, op)) for k in cause]
    seldom = min(moved) < SELDOM * max(moved)
    if held[0] != held[1] and min(moved) > STEPS * max(moved):
        swap = held[0]
    elif seldom:
        swap = moved[0] < moved[1]
    else:
        innovation = innovations(np.diff(bag.values[:, [*cause, op]], axis=0))
        after = [
            [np.dot(innovation[:-k, 2], innovation[k:, i]) ** 2 for k in range(1, LATER)] for i in (0, 1)
        ]
        swap = sum(after[0]) / np.dot(innovation[:, 0], innovation[:, 0]) < sum(after[1]) / np.dot(
            innovation[:, 1], innovation[:, 1]
        )
    return (sp, pv) if swap else (pv, sp)


def _held_elsewhere(bag: TagSet, scores: Scores, tag: int, own: Cause) -> bool:
    """Whether a tag's innovations are those of another tag outside its `own` loop."""
    if bag.is_duplicate(tag) or tag not in bag.live:
        return bag.is_duplicate(tag)
    others = np.flatnonzero(~np.isin(bag.live, own))
    return bool(scores.noise[0, bag.live.index(tag), others].max(initial=0.0) > COPIED)
