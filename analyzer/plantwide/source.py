"""Where a shared oscillation starts: candidates ranked by signs that do not rest on each other.

The loop's own verdict (a valve at fault, a tuning at its limit of stability), who moves first, whose wave is the
clearest and so the least mixed with others, whose shape is the least filtered (nonlinearity is strongest at its
source and falls along the way, Thornhill 2005). Each sign is a number about 0 to 1; the weighted sum is the log odds
of a candidate against the others of its group.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analyzer.config import PlantLimits
from analyzer.loop.decisions import Cause
from analyzer.plantwide.foresight import foresees
from analyzer.plantwide.groups import Group
from analyzer.plantwide.wave import Wave
from identification.record import Floats
from identification.signals.cross_spectrum import Lag, band, lag, tapered

MOST = 12
"""Candidates of a group that are weighed, the likeliest by their verdicts and the clearness of their waves."""
MUCH_EVIDENCE = 1000.0
"""Evidence of a valve's fault [nat] that is as much as there can be."""
LAG_PERIODS, LAG_LEAST_S = 4.0, 900.0
"""Lags looked for reach so many periods, and so far at least [s]: clocks of two historians differ by minutes."""
SURE = 3.0
"""Deviations from which a lead is certain."""


@dataclass(frozen=True, slots=True)
class Peer:
    """What a loop's own verdict says when sources are looked for.

    cause; evidence [nat] of its valve fault; tuning_pct, confidence of its tuning [%]; master, the loop whose OP is
    its set point, empty where none is stated.
    """

    cause: Cause
    evidence: float = 0.0
    tuning_pct: float = 0.0
    master: str = ""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A loop at which a shared oscillation may start, its signs by name (0 to 1), and its confidence [%]."""

    loop: str
    signs: Mapping[str, float]
    confidence_pct: float = 0.0


def lag_between(one: Wave, other: Wave) -> Lag:
    """How much later a second wave is than a first one of the same clock."""
    low, high, _ = band(one.line)
    low = max(low, one.first + 1, other.first + 1)
    high = min(high, one.first + one.lines.size - 1, other.first + other.lines.size - 1)
    if high - low < 4:
        return Lag(0.0, math.inf, 0.0)
    x, y = (tapered(w.lines[low - w.first - 1 : high - w.first + 1]) for w in (one, other))
    return lag(x, y, one.duration_s, max(LAG_PERIODS * one.period_s, LAG_LEAST_S))


def _first_guess(group: Group, peers: Mapping[str, Peer]) -> list[Wave]:
    """The waves of the likeliest candidates."""

    def rank(w: Wave) -> tuple[float, float]:
        peer = peers[w.loop]
        return -(peer.evidence if peer.cause is Cause.VALVE else peer.tuning_pct / 100), -w.prominence

    waves = [m.wave for m in group.members if m.wave.loop in peers]
    by_verdict, by_clearness = sorted(waves, key=rank), sorted(waves, key=lambda w: -w.prominence)
    chosen = dict.fromkeys([w.loop for w in (*by_verdict[: MOST // 2], *by_clearness)])
    known = {w.loop: w for w in waves}
    return [known[name] for name in list(chosen)[:MOST]]


def _leads(waves: Sequence[Wave]) -> tuple[Floats, Floats]:
    """Mean certainty with which each wave is ahead of the others (-1 to 1), and its mean coherence with them."""
    n = len(waves)
    ahead, shared = np.zeros((n, n)), np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1, n):
            found = lag_between(waves[i], waves[j])
            sure = max(min(found.lag_s / (SURE * max(found.deviation_s, 1e-9)), 1.0), -1.0)
            ahead[i, j], ahead[j, i] = sure * found.coherence, -sure * found.coherence
            shared[i, j] = shared[j, i] = found.coherence
    count = max(n - 1, 1)
    return ahead.sum(axis=1) / count, shared.sum(axis=1) / count


def _relative(x: Floats) -> Floats:
    """Each over the largest of them."""
    top = float(x.max(initial=0.0))
    return x / top if top > 0 else np.zeros(x.size)


def signs_of(group: Group, peers: Mapping[str, Peer]) -> list[Candidate]:
    """The candidates of a group with their signs, not ranked yet.

    Parameters
    ----------
    group : Group
        Its waves on one clock.
    peers : mapping
        Verdicts by loop; a loop that is not in it is no candidate.
    """
    waves = _first_guess(group, peers)
    ahead, shared = _leads(waves)
    ahead_in_time = foresees(waves)
    known = {w.loop: peers[w.loop] for w in waves}
    clear = _relative(np.log(np.maximum([w.prominence for w in waves], 1.0)))
    bent = _relative(np.array([w.nonlinearity for w in waves]))
    central = _relative(shared)
    most = math.log1p(MUCH_EVIDENCE)
    valves = _relative(np.array([p.evidence if p.cause is Cause.VALVE else 0.0 for p in known.values()]))
    out = []
    for i, w in enumerate(waves):
        peer = known[w.loop]
        signs = {
            "valve": float(peer.cause is Cause.VALVE) * min(math.log1p(max(peer.evidence, 0.0)) / most, 1.0),
            "best_valve": float(valves[i]),
            "tuning": float(peer.cause is Cause.TUNING) * peer.tuning_pct / 100.0,
            "oscillates": float(w.own and w.harmonic == 1),
            "first": float(ahead[i]),
            "foresees": float(ahead_in_time[i]),
            "central": float(central[i]),
            "clear": float(clear[i]),
            "share": min(w.share, 1.0),
            "nonlinear": float(bent[i]),
        }
        out.append(Candidate(w.loop, signs))
    return out


def ranked(candidates: Sequence[Candidate], limits: PlantLimits) -> tuple[Candidate, ...]:
    """The candidates with their confidences, the likeliest first; what is left to 100 % is a source unseen."""
    valves = any(c.signs["valve"] > 0 for c in candidates)
    seen = 1.0 - (limits.unseen_beside_valve_pct if valves else limits.unseen_pct) / 100.0
    odds = np.array([sum(getattr(limits, f"sign_{k}") * v for k, v in c.signs.items()) for c in candidates])
    chance = np.exp(odds - odds.max(initial=-math.inf))
    pct = 100.0 * seen * chance / chance.sum()
    order = sorted(range(len(candidates)), key=lambda i: (-pct[i], candidates[i].loop))
    return tuple(Candidate(candidates[i].loop, candidates[i].signs, float(pct[i])) for i in order)
