"""What each sign of a cause weighs: a multinomial logit, fitted to simulated loops whose cause is known.

Each sign counts along a broken line, and the odds of the causes are products over the signs, as in a scorecard (Good
1950, weight of evidence). Which way a sign may point is fixed by physics; how much it weighs is fitted. Weights and
knots are one whole, written by `python -m proofs.cause_weights`, which says on what they were fitted and how
they do on loops that they were not.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from analyzer.loop.cause_measures import NAMES
from analyzer.loop.decisions import CAUSES, Cause
from identification.record import Floats

FILE = "cause_weights.json"


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights of all measures.

    knots by measure, shape (k,) each; pieces, slopes of its line below, between and above them [nat per unit], shape
    (1 + k, 3) each, causes as in CAUSES; usual, what a measure adds on average [nat], shape (3,) each; base
    [nat], shape (3,).
    """

    knots: Mapping[str, Floats]
    pieces: Mapping[str, Floats]
    usual: Mapping[str, Floats]
    base: Floats


def parted(x: Floats, knots: Floats) -> Floats:
    """A value as the part below the first knot and the parts beyond each; x of shape (...), result (..., 1 + k)."""
    ends = np.append(np.diff(knots), np.inf)
    below = np.minimum(x, knots[0])[..., None]
    beyond = np.clip(x[..., None] - knots, 0.0, ends)
    return np.concatenate((below, beyond), axis=-1)


@cache
def weights() -> Weights:
    """The weights as the study wrote them."""
    kept = json.loads((files("analyzer.loop") / FILE).read_text("utf-8"))
    order = [str(c) for c in CAUSES]
    table = kept["measures"]
    knots = {n: np.array(table[n]["knots"], dtype=np.float64) for n in NAMES}
    pieces = {n: np.array([table[n][c] for c in order], dtype=np.float64).T for n in NAMES}
    usual = {n: np.array(table[n]["usual"], dtype=np.float64) for n in NAMES}
    return Weights(knots, pieces, usual, np.array([kept["base"][c] for c in order], dtype=np.float64))


def contributions(found: Floats) -> Floats:
    """What each measure of one loop adds to the log odds of each cause [nat], shape (len(NAMES), 3)."""
    w = weights()
    return np.array(
        [parted(np.asarray(x), w.knots[n]) @ w.pieces[n] for n, x in zip(NAMES, found, strict=True)]
    )


def pushes(found: Floats) -> dict[str, Floats]:
    """How far each measure moves the odds of each cause, beyond what it usually does and beyond their mean [nat], of
    shape (3,) each, by its name."""
    added = contributions(found) - np.array([weights().usual[n] for n in NAMES])
    return dict(zip(NAMES, added - added.mean(axis=1, keepdims=True), strict=True))


def chances(found: Floats) -> dict[Cause, float]:
    """Probability of each cause [-] of one loop's measures, shape (len(NAMES),)."""
    score = weights().base + contributions(found).sum(axis=0)
    odds = np.exp(score - score.max())
    return dict(zip(CAUSES, (odds / odds.sum()).tolist(), strict=True))
