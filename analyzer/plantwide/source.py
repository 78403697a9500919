"""Source of a common oscillation: candidates ranked by independent criteria.

The criteria are the loop's own verdict (a faulty valve, a tuning at its limit of stability), the earliest motion, the
ability to predict the others, the clearest oscillation, which is least mixed with others, and the least filtered
waveform (nonlinearity is strongest at its source and decreases along the path, Thornhill 2005). Each is a number
about 0 to 1; the weighted sum is the log odds of a candidate against the others of its group.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from analyzer.config import PlantLimits
from analyzer.loop.decisions import Cause, Finding
from analyzer.plantwide.oscillation_lines import OscillationLines, in_steps
from identification.record import Floats
from identification.signals.cross_spectrum import Delay, band, granger_f, lag, tapered

CANDIDATES = 12
"""Candidates of a group that are weighed, the likeliest by their verdicts and the clearness of their
oscillations [loops]."""
MUCH_EVIDENCE = 1000.0  # Evidence of a valve's fault that counts as the maximum [nat]
SURE_LEAD = 3.0  # Deviations from which a lead is certain

LAG_PERIODS = 4.0  # Range of the search for lags [periods]
LAG_LEAST_S = 900.0  # The same at least [s]: clocks of two historians differ by minutes
FORESEEN = 12  # Steps of the past that predict others [steps]: half of a period to a whole one
LEAST_STEPS = 300  # Fewest common steps of trends for a test of prediction [steps]: 12 for each constant
LEAST_F = 3.0  # F of Granger's test from which a prediction is more than chance: one in a thousand by chance
PLAIN_RATIO = 10.0  # Ratio of the F of both directions from which the direction is clear

AT_ONCE = 64
"""Oscillations whose predictions are computed at a time."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A possible source of a common oscillation, its criteria by name (0 to 1), and its confidence [%]."""

    loop: str
    signs: Mapping[str, float]
    confidence_pct: float


def _first_guess(
    oscillations: Sequence[OscillationLines], peers: Mapping[str, Finding], most: int
) -> list[OscillationLines]:
    """The oscillations of the most likely candidates, up to a number."""

    def rank(w: OscillationLines) -> tuple[float, float]:
        own = peers[w.loop]
        valve = own.cause is Cause.VALVE
        return -(own.number("evidence") if valve else _tuning_share(own)), -w.prominence

    known = [w for w in oscillations if w.loop in peers]
    by_verdict, by_clearness = sorted(known, key=rank), sorted(known, key=lambda w: -w.prominence)
    chosen = {w.loop: w for w in (*by_verdict[: most // 2], *by_clearness)}
    return list(chosen.values())[:most]


def _tuning_share(own: Finding) -> float:
    """Confidence in too tight a tuning [-]."""
    return own.confidence.get(Cause.TUNING, 0.0) / 100.0


def _leads(loops: Sequence[str], lags: Lags, limits: PlantLimits) -> tuple[Floats, Floats]:
    """Mean certainty with which each loop leads the others (-1 to 1), and its mean coherence with them."""
    n = len(loops)
    ahead, shared = np.zeros((n, n)), np.zeros((n, n))
    for i, j in combinations(range(n), 2):
        found = lags.between(loops[i], loops[j])
        sure = max(min(found.lag_s / (SURE_LEAD * max(found.deviation_s, 1e-9)), 1.0), -1.0)
        ahead[i, j], ahead[j, i] = sure * found.coherence, -sure * found.coherence
        shared[i, j] = shared[j, i] = found.coherence
    count = max(n - 1, 1)
    return ahead.sum(axis=1) / count, shared.sum(axis=1) / count


def _relative(x: Floats) -> Floats:
    """Each over the largest of them."""
    top = float(x.max(initial=0.0))
    return x / top if top > 0 else np.zeros(x.size)


def candidates_of(lags: Lags, peers: Mapping[str, Finding], limits: PlantLimits) -> tuple[Candidate, ...]:
    """The candidates of a group with their confidences, most likely first; the rest to 100 % is an unobserved source.

    lags : of the group's oscillations, on one clock; peers : verdicts by loop; a loop without one is no candidate.
    """
    oscillations = _first_guess(list(lags.oscillations.values()), peers, CANDIDATES)
    if not oscillations:
        return ()
    signs = _signs_by_name(oscillations, [peers[w.loop] for w in oscillations], lags, limits)
    valves = any(s["valve"] > 0 for s in signs)
    seen = 1.0 - (limits.unseen_with_valve_pct if valves else limits.unseen_pct) / 100.0
    odds = np.array([sum(getattr(limits, f"sign_{k}") * v for k, v in s.items()) for s in signs])
    chance = np.exp(odds - odds.max())
    pct = 100.0 * seen * chance / chance.sum()
    found = [Candidate(w.loop, s, float(p)) for w, s, p in zip(oscillations, signs, pct, strict=True)]
    return tuple(sorted(found, key=lambda c: (-c.confidence_pct, c.loop)))


def _signs_by_name(
    oscillations: Sequence[OscillationLines], peers: Sequence[Finding], lags: Lags, limits: PlantLimits
) -> list[dict[str, float]]:
    """The criteria of each candidate by name."""
    first, shared = _leads([w.loop for w in oscillations], lags, limits)
    own = [p.number("evidence") if p.cause is Cause.VALVE else 0.0 for p in peers]
    most = math.log1p(MUCH_EVIDENCE)
    columns: dict[str, Sequence[float] | Floats] = {
        "valve": [min(math.log1p(max(x, 0.0)) / most, 1.0) for x in own],
        "best_valve": _relative(np.array(own)),
        "tuning": [(p.cause is Cause.TUNING) * _tuning_share(p) for p in peers],
        "oscillates": [w.own and w.harmonic == 1 for w in oscillations],
        "first": first,
        "foresees": prediction_balance(oscillations),
        "central": _relative(shared),
        "clear": _relative(np.log(np.maximum([w.prominence for w in oscillations], 1.0))),
        "share": [min(w.share, 1.0) for w in oscillations],
        "nonlinear": _relative(np.array([w.nonlinearity for w in oscillations])),
    }
    return [{name: float(x[i]) for name, x in columns.items()} for i in range(len(oscillations))]


class Lags:
    """Lags between pairs of loops; each is computed once."""

    def __init__(self, oscillations: Mapping[str, OscillationLines]) -> None:
        self.oscillations = oscillations
        self._known: dict[tuple[str, str], Delay] = {}

    def between(self, one: str, other: str) -> Delay:
        """Lag of the second loop's oscillation behind the first one's."""
        pair = one, other
        if pair not in self._known:
            self._known[pair] = _lag(self.oscillations[one], self.oscillations[other])
        return self._known[pair]


def _lag(one: OscillationLines, other: OscillationLines) -> Delay:
    low, high, _ = band(one.line)
    low = max(low, one.first + 1, other.first + 1)
    high = min(high, one.first + one.lines.size - 1, other.first + other.lines.size - 1)
    if high - low < 4:
        return Delay(0.0, math.inf, 0.0)
    x, y = (tapered(w.lines[low - w.first - 1 : high - w.first + 1]) for w in (one, other))
    return lag(x, y, one.duration_s, max(LAG_PERIODS * one.period_s, LAG_LEAST_S))


def _foreseeing(
    oscillations: Sequence[OscillationLines], leading: int | None = None
) -> tuple[list[int], Floats]:
    """Oscillations whose trends have common steps, and Granger's F of each on each, or of the pairs of the first
    `leading` with the later ones, shape (k, k); none if fewer than two have them, or over too few steps."""
    step = max((w.step_s for w in oscillations if w.trend.size), default=0.0)
    found: list[tuple[int, int, Floats]] = []
    for i, w in enumerate(oscillations):
        few = round(step / w.step_s) if w.trend.size else 0
        if few < 1 or abs(few * w.step_s / step - 1.0) > 1e-6:
            continue
        found.append((i, *in_steps(w.trend, w.trend_first, few)))
    begin = max((first for _, first, _ in found), default=0)
    end = min((first + x.size for _, first, x in found), default=0)
    if len(found) < 2 or end - begin < LEAST_STEPS:
        return [], np.zeros((0, 0))
    trends = np.array([x[begin - first : end - first] for _, first, x in found], float)
    known = [i for i, *_ in found]
    return known, granger_f(trends, FORESEEN, leading and sum(i < leading for i in known))


def prediction_balance(oscillations: Sequence[OscillationLines]) -> Floats:
    """Mean over the others of how much better each predicts them than they predict it (-1 to 1), by Granger's F."""
    out = np.zeros(len(oscillations))
    known, f = _foreseeing(oscillations)
    if not known:
        return out
    clear = np.maximum(f, f.T) >= LEAST_F
    ratio = np.log(np.maximum(f, 0.1) / np.maximum(f.T, 0.1)) / math.log(PLAIN_RATIO)
    out[known] = np.where(clear, np.clip(ratio, -1.0, 1.0), 0.0).sum(axis=1) / (len(known) - 1)
    return out


def median_granger_f(ones: Sequence[OscillationLines], others: Sequence[OscillationLines]) -> Floats:
    """Median F with which each oscillation's past predicts others, shape (k,); 0 if theirs predicts it as well or
    better."""
    out = np.zeros(len(ones))
    alike: dict[tuple[float, int, int], list[int]] = {}
    for i, one in enumerate(ones):
        alike.setdefault((one.step_s, one.trend_first, one.trend.size), []).append(i)
    for at in (same[k : k + AT_ONCE] for same in alike.values() for k in range(0, len(same), AT_ONCE)):
        known, f = _foreseeing([*(ones[i] for i in at), *others], len(at))
        if known[:1] == [0] and len(known) > len(at):
            forth, back = (
                np.median(f[: len(at), len(at) :], axis=1),
                np.median(f[len(at) :, : len(at)], axis=0),
            )
            out[at] = np.where(forth > back, forth, 0.0)
    return out
