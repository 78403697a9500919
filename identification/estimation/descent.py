"""How every fit goes down, what it is worth, and how well its constants are known: Gauss-Newton steps, a compass
search, evidence in nats, and the covariance from curvature and scatter of the scores.

Each search is written once and does not know what it searches: it is given a context and functions of it. Numba
compiles it into the night's kernels; `explain` calls it as it stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numba.extending import register_jitable

from identification.limits import INTERVALS
from identification.models import Estimate
from identification.record import Floats

Point = TypeVar("Point")
FIRST_DAMPING, LEAST_DAMPING, HEAVIEST = 1e-3, 1e-7, 5e4
"""Damping of a first step, in a constant's own curvature, the least of any, and that from which none rises [-]."""


@register_jitable  # type: ignore[untyped-decorator]
def nats(count: int, worse: float, better: float) -> float:
    """Gain in log likelihood [nat] of Gaussian innovations whose mean square falls, in so many samples."""
    return 0.5 * count * math.log(max(worse, 1e-300) / max(better, 1e-300))


class Descent(NamedTuple):
    """How a descent goes and when it ends.

    steps, trials : how many it may take, and may try; judged : samples that its loss is the mean square of; settled :
    gain of a step [nat] below which it ends; raised, lowered : times that damping rises after a step that wins
    nothing, and falls after one that does; failures : how often it may rise in a row.
    """

    steps: int
    trials: int
    judged: int
    settled: float
    raised: float
    lowered: float
    failures: int


@register_jitable  # type: ignore[untyped-decorator]
def damped_step(gram: Floats, slope: Floats, damping: float) -> Floats:
    """A damped Gauss-Newton step, shape (m,), in scaled constants; none where a number has run away."""
    scale = np.diag(gram) + 1e-12 * np.trace(gram) + 1e-300
    level = (gram + np.diag(damping * scale)) / np.sqrt(np.outer(scale, scale)) + 1e-12 * np.eye(scale.size)
    if not (np.isfinite(level).all() and np.isfinite(slope).all()):
        return np.zeros(scale.size)
    return np.linalg.solve(level, slope / np.sqrt(scale)) / np.sqrt(scale)  # type: ignore[no-any-return]


@register_jitable  # type: ignore[untyped-decorator]
def down(
    context: Any,
    best: Point,
    curved: Callable[[Any, Point, int], tuple[bool, Floats, Floats]],
    stepped: Callable[[Any, Point, Floats], Point],
    rule: Descent,
) -> Point:
    """Damped Gauss-Newton steps from a point to the least of its `loss`.

    curved : whether it is worth going on from a point after so many steps, the Gauss-Newton matrix and the slope
    there; stepped : the point behind a step, with an infinite loss where that leaves what is searched.
    """
    damping, taken, tried, failed = FIRST_DAMPING, 0, 0, 0
    going, gram, slope = curved(context, best, taken)
    while (
        going
        and taken < rule.steps
        and tried < rule.trials
        and failed <= rule.failures
        and damping < HEAVIEST
    ):
        trial = stepped(context, best, damped_step(gram, slope, damping))
        tried += 1
        if not trial.loss < best.loss:  # type: ignore[attr-defined]
            damping, failed = damping * rule.raised, failed + 1
            continue
        won = nats(rule.judged, best.loss, trial.loss)  # type: ignore[attr-defined]
        best, taken, failed = trial, taken + 1, 0
        if won < rule.settled or taken == rule.steps or tried == rule.trials:
            break
        damping = max(damping / rule.lowered, LEAST_DAMPING)
        going, gram, slope = curved(context, best, taken)
    return best


@register_jitable  # type: ignore[untyped-decorator]
def compass(
    context: Any,
    best: Point,
    least: float,
    tried: Callable[[Any, Point, Any, float], tuple[Point, float]],
    moves: Sequence[Any],
    steps: Sequence[float] | Floats,
    share: float = 0.0,
    worth: float = 0.0,
    most: int = 1_000_000,
) -> tuple[Point, float]:
    """The least that moves of ever smaller steps come to: every move that wins is taken at once.

    least : what the first point has; tried : a point moved by a step, and what that has, inf where it is none;
    share, worth : what a move must win, as a share of the least so far and outright; most : moves after which no
    other round is begun.
    """
    taken = 0
    for step in steps:
        moving = True
        while moving and taken < most:
            moving = False
            for move in moves:
                other, found = tried(context, best, move, step)
                if found < least * (1.0 - share) - worth:
                    best, least, moving, taken = other, found, True, taken + 1
    return best, least


NINETY = 1.645
"""Half width of a 90 % interval of a normal error, in standard deviations."""


def scattered(inside: Floats, scores: Floats, sigma2: float) -> Floats:
    """Covariance of parameters, shape (m, m).

    The inverse Gauss-Newton matrix times the innovations variance (Ljung 1999, eq. 9.31). Where the scores of whole
    stretches scatter by more than that (Huber 1967: the model is not the truth, and what it lacks lasts longer than a
    sample), the standard deviations are those of the scatter.

    inside : shape (m, m), inverse of the Gauss-Newton matrix, what was fitted beside the parameters eliminated;
    scores : shape (n, m), derivative of half the squared innovation by each parameter, sample by sample; sigma2 :
    variance of the innovations.
    """
    moves = np.array([part.sum(axis=0) for part in np.array_split(scores, INTERVALS.stretches)]) @ inside
    usual = sigma2 * np.diag(inside)
    wider = np.sqrt(np.maximum((moves**2).sum(axis=0) / np.maximum(usual, 1e-300), 1.0))
    return np.asarray(sigma2 * inside * np.outer(wider, wider))


def inverse(gram: Floats) -> Floats:
    """Inverse of a Gauss-Newton matrix, shape (m, m), directions that the data do not know left out."""
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    unit = np.linalg.pinv(gram / np.outer(scale, scale), rcond=1e-10)
    return np.asarray(unit / np.outer(scale, scale))


def half_width(deviation: float, least: float = 0.0) -> float:
    """Half width of a 90 % interval, in the unit of the standard deviation, and not under what no model knows."""
    return max(NINETY * INTERVALS.wider * deviation, least)


def reaching(e: Estimate, *ends: float) -> Estimate:
    """An estimate whose interval holds some values too."""
    return Estimate(e.value, min((e.low, *ends)), max((e.high, *ends)), e.unit)
