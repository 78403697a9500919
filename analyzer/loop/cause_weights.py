"""The signs of a cause as numbers, and their weights in a multinomial logit fitted to simulated loops.

Each sign enters by a piecewise linear function, and the odds of the causes are products over the signs, as in a
scorecard (Good 1950, weight of evidence). Physics fixes the direction of each sign; its weight is fitted. Weights and
knots belong together; `python -m proofs.cause_weights` writes them and names the loops of the fit and the results on
other loops.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from analyzer.limits import LOOP
from analyzer.loop.decisions import CAUSES, Cause, Figures, Sign, SignKind
from analyzer.loop.measure import Measured
from analyzer.loop.oscillation import Oscillation
from identification.record import Floats

FILE = "cause_weights.json"


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights of all measures.

    knots by measure, shape (k,) each; pieces, slopes of its line below, between and above them [nat per unit], shape
    (1 + k, 3) each, causes as in CAUSES; usual, average contribution of a measure [nat], shape (len(NAMES), 3); base
    [nat], shape (3,).
    """

    knots: Mapping[str, Floats]
    pieces: Mapping[str, Floats]
    usual: Floats
    base: Floats


def parted(x: Floats, knots: Floats) -> Floats:
    """A value as the part below the first knot and the parts beyond each; x of shape (...), result (..., 1 + k)."""
    ends = np.append(np.diff(knots), np.inf)
    below = np.minimum(x, knots[0])[..., None]
    beyond = np.clip(x[..., None] - knots, 0.0, ends)
    return np.concatenate((below, beyond), axis=-1)


@cache
def weights() -> Weights:
    """The weights as written by the study."""
    kept = json.loads((files("analyzer.loop") / FILE).read_text("utf-8"))
    order = [str(c) for c in CAUSES]
    table = kept["measures"]
    knots = {n: np.array(table[n]["knots"], dtype=np.float64) for n in NAMES}
    pieces = {n: np.array([table[n][c] for c in order], dtype=np.float64).T for n in NAMES}
    usual = np.array([table[n]["usual"] for n in NAMES], dtype=np.float64)
    return Weights(knots, pieces, usual, np.array([kept["base"][c] for c in order], dtype=np.float64))


def contributions(found: Floats) -> Floats:
    """Contribution of each measure of one loop to the log odds of each cause [nat], shape (len(NAMES), 3)."""
    w = weights()
    return np.array(
        [parted(np.asarray(x), w.knots[n]) @ w.pieces[n] for n, x in zip(NAMES, found, strict=True)]
    )


def pushes(found: Floats) -> dict[str, Floats]:
    """Effect of each measure on the odds of each cause, relative to its usual effect and to their mean [nat], of
    shape (3,) each, by its name."""
    added = contributions(found) - weights().usual
    return dict(zip(NAMES, added - added.mean(axis=1, keepdims=True), strict=True))


def chances(found: Floats) -> dict[Cause, float]:
    """Probability of each cause [-] of one loop's measures, shape (len(NAMES),)."""
    score = weights().base + contributions(found).sum(axis=0)
    odds = np.exp(score - score.max())
    return dict(zip(CAUSES, (odds / odds.sum()).tolist(), strict=True))


UNSTABLE = 20.0
"""Amplification [-] used for an unstable loop; ours: more than any stable one's of the study."""
SMALL_GAIN, SMALL_GAIN_CYCLE = 5.0, 0.5
"""Gains in log likelihood [nat], of all and a cycle, up to which they enter linearly, above as their log."""

KEPT = 0.9
"""Height of the autocorrelation's third returning peak [-] from which the frequency is constant; ours: a load from a
machine and a loop at its limit of stability are both above it, and the excess does not distinguish them."""


def _signed_log(x: float) -> float:
    """Linear near zero, logarithmic far from it."""
    return math.copysign(math.log1p(abs(x)), x)


def _log(x: float, low: float, high: float) -> float:
    """Logarithm of a value within bounds."""
    return math.log(min(max(x, low), high))


NAMES = (
    *("evidence", "evidence_per_cycle", "agreeing", "steadiness", "jump", "size"),
    *("line_linear", "line_valve", "amplification", "loop_gain", "dead_time_share", "consistency"),
    *("harmonic", "kurtosis", "rhythm", "saturated", "wave_left"),
)
"""The measures, in the order of `measures`."""


def measures(m: Measured, o: Oscillation) -> Floats:
    """The signs of one oscillating loop as numbers, shape (len(NAMES),), within fixed bounds; NaN if unknown.

    Gains in log likelihood in logarithms; agreeing and steadiness of the trials, 0 without; stickband over range of
    OP; prominences, amplification at the period and K Kp, 1 without settings, in logarithms; dead time over period;
    gain outside the period's band over gain with it; third harmonic over fundamental; kurtosis of the cycle's size;
    the autocorrelation's third returning peak; share of time at a limit; harmonics a faulty valve does not explain.
    """
    t, cycles = m.trials, max(o.cycles, 1.0)
    found = (
        _signed_log(m.evidence / SMALL_GAIN),
        _signed_log(m.evidence / cycles / SMALL_GAIN_CYCLE),
        0.0 if t is None else t.agreeing - 0.5,
        0.0 if t is None else min(max(t.steadiness, -2.0), 15.0),
        _signed_log(max(m.jump, -1e6) / SMALL_GAIN if not math.isinf(m.jump) else 1e3),
        min(max(m.size, 0.0), 1.5),
        _log(m.line_linear, 0.05, 1e4),
        _log(m.line_valve, 0.05, 1e4),
        _log(m.amplification or 1.0 if m.stable else UNSTABLE, 0.1, 50.0),
        _log(1.0 if m.controller is None else abs(m.linear.gain * m.controller.kp), 1e-3, 1e2),
        min(m.linear.dead_time_s / o.period_s, 1.5),
        min(max(m.consistency, 0.0), 1.5),
        min(m.harmonic, 0.4),
        min(max(m.kurtosis, 1.4), 4.0),
        min(max(o.rhythm.third, -0.2), KEPT),
        m.saturated,
        min(max(m.wave_left, LOOP.plain_wave), 0.4),
    )
    return np.array(found, dtype=np.float64)


def _amplification_figures(m: Measured, o: Oscillation) -> Figures:
    return (m.amplification,) if m.stable else ()


GROUPS: Mapping[SignKind, tuple[tuple[str, ...], Callable[[Measured, Oscillation], Figures]]] = {
    SignKind.EVIDENCE: (
        ("evidence", "evidence_per_cycle", "agreeing", "steadiness", "jump"),
        lambda m, o: (m.evidence, *(() if m.trials is None else (m.trials.agreeing, m.trials.count))),
    ),
    SignKind.WIDTH: (("size",), lambda m, o: (m.evidence, m.size)),
    SignKind.LOAD_LEFT: (("line_linear", "line_valve"), lambda m, o: (m.line_linear, m.line_valve)),
    SignKind.AMPLIFICATION: (("amplification",), _amplification_figures),
    SignKind.LOOP_GAIN: (
        ("loop_gain",),
        lambda m, o: () if m.controller is None else (abs(m.linear.gain * m.controller.kp),),
    ),
    SignKind.PROCESS: (("consistency",), lambda m, o: (m.consistency,)),
    SignKind.HARMONIC: (("harmonic",), lambda m, o: (m.harmonic,)),
    SignKind.WAVE_LEFT: (
        ("wave_left",),
        lambda m, o: (m.wave_left if m.wave_left >= LOOP.plain_wave else 0.0,),
    ),
    SignKind.REGULARITY: (("kurtosis", "rhythm"), lambda m, o: (m.kurtosis, o.rhythm.third)),
    SignKind.LIMITS: (("saturated",), lambda m, o: (m.saturated,)),
    SignKind.DEAD_TIME: (("dead_time_share",), lambda m, o: (o.period_s, m.linear.dead_time_s)),
}
"""Measures that together are one sign, and the figures reported for it."""


def signs_of(m: Measured, o: Oscillation, found: Floats) -> tuple[Sign, ...]:
    """The signs of one oscillating loop, by its `measures`; strength is one minus the factor that a sign applies to
    the odds against its cause."""
    moved = pushes(found)
    out = []
    for kind, (names, figures) in GROUPS.items():
        push = np.sum([moved[n] for n in names], axis=0)
        k = int(np.argmax(push))
        if push[k] >= LOOP.least_push:
            out.append(Sign(CAUSES[k], 1.0 - math.exp(-float(push[k])), kind, figures(m, o)))
    if not m.stable or (m.amplification or 0.0) >= LOOP.amplifies:
        told = [s for s in out if s.kind is not SignKind.AMPLIFICATION]
        return (*told, Sign(Cause.TUNING, 0.05, SignKind.AMPLIFICATION, _amplification_figures(m, o)))
    return tuple(out)
