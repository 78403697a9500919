"""How well parameters are known: curvature, the scatter of the scores, and what both leave out."""

from __future__ import annotations

import numpy as np

from identification.models import Estimate
from identification.record import Floats

STRETCHES = 30
"""Stretches of a record whose scores are compared; ours: a window of 1,800 blocks holds thirty periods."""
NINETY = 1.645
"""Half width of a 90 % interval of a normal error, in standard deviations."""
WIDER = 1.35
"""Times that errors exceed what curvature and scores tell; ours: no model is the plant, slips that OP's resolution
hides or makes leave the likelihood rough. The 90 % quantile of their ratio is 2.25 over 58 simulated loops with play
(proofs/coverage.py, seed 9) and 2.1 over 170 sealed effects (proofs/concealed/intervals.py, seed 501), where it
should be 1.64; what other seeds say stands beside both commands."""
SLOPE_ALONE = 2.0
"""Times wider still where a cycling record tells gain over time constant alone: ours; of 68 vessels that integrate
and cycle (proofs/coverage.py, seed 603) errors are 2.1 times those of processes that settle (604), in the same
deviations, at noise models of 8 to 110 lags and blocks of one to ten samples alike."""
JUMPING = 1.25
"""Times wider still, of the time constant behind a valve that jumps: ours; of 114 such loops of dry friction (seeds
1, 11, 606) 82 % were held without it."""
SOONER, LATER = 2.5, 0.6
"""Of the dead time behind a valve that jumps: times further down, and the part of what a stickband at its least would
add; ours: of 71 such loops (seed 606) a fifth have a dead time shorter than the interval told without it, none a
longer one, and 94 in 100 lie within half of the way up."""
LEAST_SHARE, LEAST_BLOCK = 0.02, 0.025
"""Least half width of slope, gain and time constant, in their own size, and of a dead time, in blocks of the window:
ours; a window in blocks of the plant is no exact model of it, and of 60 loops that set points move (seed 605) slopes
err by 2.1 % in nine of ten where deviations of .4 % are told, dead times by .01 to .06 blocks."""
LEAST_JUMP = 2.0
"""Times that a slip jump may be smaller than found; ours: on simulated dry friction found ones are too small."""
DECODED = 0.05
"""Standard deviation of a stickband that was told slip by slip, in itself: as its slips scatter (slips.py)."""
LEAST_BAND = 1.5
"""Times that a stickband may be smaller, or larger, than found; ours: on simulated dry friction up to 1.45."""


def scattered(inside: Floats, scores: Floats, sigma2: float) -> Floats:
    """Covariance of parameters, shape (m, m).

    The inverse Gauss-Newton matrix times the innovations variance (Ljung 1999, eq. 9.31). Where the scores of whole
    stretches scatter by more than that (Huber 1967: the model is not the truth, and what it lacks lasts longer than a
    sample), the standard deviations are those of the scatter.

    inside : shape (m, m), inverse of the Gauss-Newton matrix, what was fitted beside the parameters eliminated;
    scores : shape (n, m), derivative of half the squared innovation by each parameter, sample by sample; sigma2 :
    variance of the innovations.
    """
    moves = np.array([part.sum(axis=0) for part in np.array_split(scores, STRETCHES)]) @ inside
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
    return max(NINETY * WIDER * deviation, least)


def reaching(e: Estimate, *ends: float) -> Estimate:
    """An estimate whose interval holds some values too."""
    return Estimate(e.value, min(e.low, *ends), max(e.high, *ends), e.unit)
