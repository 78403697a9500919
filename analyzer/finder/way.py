"""Decision which of two tags is OP, and which of two is SP."""

from __future__ import annotations

import numpy as np

from analyzer.finder.bag import Bag, Cause
from analyzer.finder.held import at_no_limit, limited, slower
from analyzer.finder.law import TINY, Matrix, Moves, blocks, direction, fitted, innovations
from analyzer.finder.scores import Scores
from analyzer.limits import FINDER


def freer(pv: Matrix, op: Matrix, still: bool) -> float:
    """How much more OP moves like an output than PV: it rests at its limits and, with constant SP, drifts."""
    drift = np.clip(slower(pv, op) * FINDER.drift, -FINDER.drift_certain, FINDER.drift_certain) * still
    return float(drift + FINDER.at_limits * (float(limited(op)) - float(limited(pv))))


def towards(held: Matrix, scores: Scores, c: int, j: int) -> float:
    """Evidence for the law from PV to OP, the columns of `held`, over the reverse: at the width with the strongest
    evidence among those with similar neighbouring averages, because an undersampled cycle is no evidence."""
    found = [0.0]
    for width, moves, law in zip(scores.widths, scores.moves, scores.law[:, c, j], strict=True):
        if law >= FINDER.telling and resolved(held, width):
            rows = at_no_limit(held, width)
            if len(rows) >= FINDER.least_moves:
                found.append(direction(moves, c, j, rows))
    return float(np.clip(max(found, key=abs) / FINDER.errors, -FINDER.certain, FINDER.certain))


def acts(tags: Matrix, width: int) -> bool:
    """Whether SP moves OP as PV does, with the opposite sign: tags are PV, SP and OP, shape (n, 3)."""
    moves = Moves.of(tags, width)
    error = moves.integral[:, 0] - moves.integral[:, 1]
    slope, _ = fitted(moves.value[:, 2], moves.value[:, 0], moves.value[:, 1], error)
    return bool(1.0 / FINDER.as_pv < -slope[1] / (slope[0] or TINY) < FINDER.as_pv)


def resolved(held: Matrix, width: int) -> bool:
    """Whether neighbouring averages of all tags are similar, shape (n, tags)."""
    x = blocks(held, width)
    x = x - x.mean(axis=0)
    return bool(((x[1:] * x[:-1]).sum(axis=0) >= FINDER.resolved * (x**2).sum(axis=0)).all())


def pv_and_sp(bag: Bag, scores: Scores, cause: Cause, op: int) -> tuple[int, int]:
    """Which of two tags that follow each other is PV, and which SP: SP is duplicated by another tag in its own scale
    (a master's output, a leader's PV), or rarely moves; otherwise it is the one that does not follow OP later."""
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
    """Whether a tag's innovations are those of another tag outside its `own` loop."""
    if bag.twice(tag) or tag not in bag.live:
        return bag.twice(tag)
    others = np.flatnonzero(~np.isin(bag.live, own))
    return bool(scores.noise[0, bag.live.index(tag), others].max(initial=0.0) > FINDER.copied)
