"""Which loop leads and which follow: oscillations of one plant that are one oscillation.

A loop whose error moves with that of another at the same period (coherence over the lines about it, so that
starts, stops and wanderings of the phase agree, not the period alone) and that shows no fault of its own is a
follower: its cause is a load, and the loop that has the fault is the source.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analyzer.config import CauseLimits
from analyzer.decisions import Action, Cause, Fault
from identification.signals.spectrum import Complex, Spectrum

HALF_BAND = 0.08
"""Half width of the band that is compared, as a share of the frequency; ours."""
PIECE, PIECE_LINES = 0.03, 8
"""Width of the pieces of the band within which the phase may be taken as constant, as a share of the frequency and
in lines at least: the delay from loop to loop turns it over the whole band."""
LEAST_LINES = 4
"""Fewest lines on each side of the period."""
REACH = 2.0
"""Lines kept about a loop's own period reach from f/REACH to f*REACH, for neighbours of other periods."""


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """Lines of a loop's error about its period, small enough to keep for every loop.

    loop; period_s [s]; start_s, duration_s of the record [s]; first, the number of the first line kept; lines,
    complex, shape (m,).
    """

    loop: str
    period_s: float
    start_s: float
    duration_s: float
    first: int
    lines: Complex


def fingerprint(loop: str, period_s: float, start_s: float, s: Spectrum) -> Fingerprint:
    """Cut the lines about a period out of a spectrum."""
    line = s.duration_s / period_s
    first = max(math.floor(line / REACH), 1)
    last = min(math.ceil(line * REACH), s.lines.size - 1)
    return Fingerprint(
        loop, period_s, start_s, s.duration_s, first, s.lines[first : last + 1].astype(np.complex64)
    )


def _cut(f: Fingerprint, low: int, high: int) -> Complex | None:
    if low < f.first or high >= f.first + f.lines.size:
        return None
    return f.lines[low - f.first : high - f.first + 1]


def coherence(follower: Fingerprint, leader: Fingerprint) -> float:
    """Coherence of two errors about the follower's period [-]; 0 where the records do not cover one time."""
    if abs(follower.start_s - leader.start_s) > 0.02 * follower.period_s:
        return 0.0
    if abs(follower.duration_s - leader.duration_s) > 1e-3 * follower.duration_s:
        return 0.0
    line = follower.duration_s / follower.period_s
    half = max(HALF_BAND * line, LEAST_LINES)
    low, high = max(round(line - half), 1), round(line + half)
    x, y = _cut(follower, low, high), _cut(leader, low, high)
    if x is None or y is None:
        return 0.0
    pieces = max(x.size // max(PIECE_LINES, round(PIECE * line)), 1)
    edges = (np.arange(pieces) * x.size) // pieces
    cross = np.abs(np.add.reduceat(x * y.conj(), edges)) ** 2
    power = np.add.reduceat(np.abs(x) ** 2, edges) * np.add.reduceat(np.abs(y) ** 2, edges)
    return float(cross.sum() / power.sum()) if power.sum() > 0 else 0.0


@dataclass(frozen=True, slots=True)
class Peer:
    """What a loop's own verdict says when sources are looked for.

    cause; evidence [nat] of its valve fault; tuning_pct, confidence of its tuning [%].
    """

    cause: Cause
    evidence: float
    tuning_pct: float

    @property
    def rank(self) -> float:
        """How much the loop can be a source: a valve at fault before a tuning, by the evidence."""
        if self.cause is Cause.VALVE:
            return 1000.0 + self.evidence
        return self.tuning_pct if self.cause is Cause.TUNING else 0.0


@dataclass(frozen=True, slots=True)
class Source:
    """The loop that another one follows, and their coherence [-]."""

    loop: str
    coherence: float


@dataclass(frozen=True, slots=True)
class Follower:
    """The verdict on a loop that follows another one, in place of its own.

    source; confidence [%] of each cause; strength of the sign that says so (0 to 1); cause, fault and action are
    those of every follower: a load from outside, and nothing to do here.
    """

    source: Source
    confidence: Mapping[Cause, float]
    strength: float
    cause: Cause = Cause.LOAD
    fault: Fault = Fault.NONE
    action: Action = Action.SEE_SOURCE_LOOP


def follows(own: Mapping[Cause, float], source: Source, limits: CauseLimits) -> Follower:
    """The verdict on a follower, from its own confidences [%] and its source.

    The load is at least as sure as the coherence; what else the loop shows comes from the source.
    """
    load = max(own[Cause.LOAD], 100.0 * source.coherence)
    rest = {c: min(own[c], limits.follower_most_pct) for c in (Cause.VALVE, Cause.TUNING)}
    return Follower(source, {Cause.LOAD: load, **rest}, limits.follower_sign)


def _may_follow(own: Peer, other: Peer, level: float, limits: CauseLimits) -> bool:
    """Whether one loop can follow another at this coherence.

    A loop whose own valve seems at fault follows only one whose valve is so by far more evidence: what comes from
    a neighbour's stem looks like stem motion in the follower too, but explains it worse.
    """
    if other.rank <= own.rank or level < limits.coherent:
        return False
    if own.cause is not Cause.VALVE:
        return True
    factor = limits.outweighs_wave if level >= limits.one_wave else limits.outweighs
    outweighed = other.evidence >= factor * own.evidence
    return other.cause is Cause.VALVE and level >= limits.follows and outweighed


def source_of(
    own: Fingerprint, prints: Sequence[Fingerprint], peers: Mapping[str, Peer], limits: CauseLimits
) -> Source | None:
    """The loop with a better reason to oscillate that this one moves with; None where there is none."""
    best = None
    for other in prints:
        if own.duration_s < limits.follow_cycles * own.period_s:
            break
        if other.loop == own.loop or abs(math.log(other.period_s / own.period_s)) > limits.same_period:
            continue
        found = coherence(own, other)
        follows = _may_follow(peers[own.loop], peers[other.loop], found, limits)
        if follows and (best is None or found > best.coherence):
            best = Source(other.loop, found)
    return best


def trace(prints: Sequence[Fingerprint], peers: Mapping[str, Peer], limits: CauseLimits) -> dict[str, Source]:
    """Followers and their sources."""
    known = [p for p in prints if p.loop in peers and peers[p.loop].cause is not Cause.NONE]
    found = {own.loop: source_of(own, known, peers, limits) for own in known}
    sources = {loop: source for loop, source in found.items() if source is not None}
    return {loop: _root(loop, sources) for loop in sources}


def _root(loop: str, sources: Mapping[str, Source]) -> Source:
    """The source at the end of the chain: a follower's follower follows the loop that leads both."""
    at, seen = sources[loop], {loop}
    while at.loop in sources and at.loop not in seen:
        seen.add(at.loop)
        at = Source(sources[at.loop].loop, min(at.coherence, sources[at.loop].coherence))
    return at
