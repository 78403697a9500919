"""How well parameters are known: curvature, the scatter of the scores, and what both leave out."""

from __future__ import annotations

import numpy as np

from identification.limits import INTERVALS
from identification.models import Estimate
from identification.record import Floats

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
    return Estimate(e.value, min(e.low, *ends), max(e.high, *ends), e.unit)
