"""What a shared oscillation means for each of its loops: the source leads, the others follow and are left alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analyzer.config import PlantLimits
from analyzer.loop.decisions import Cause
from analyzer.loop.finding import Root
from analyzer.plantwide.compare import Lags
from analyzer.plantwide.groups import Group, groups_of
from analyzer.plantwide.source import Candidate, Peer, candidates_of
from analyzer.plantwide.wave import Wave

LAG_KNOWN = 0.5
"""Standard deviation of a lag over the lag up to which it is told; ours: two deviations from nothing."""
MOST_IN_TREE = 40
"""Loops of a group up to which the way from loop to loop is told."""
BY_WAY = 0.02
"""Coherence by which a loop has to go better with another follower than with the source; ours: less is chance."""


@dataclass(frozen=True, slots=True)
class Traced:
    """A group with its candidates, the likeliest first.

    links, how each other loop goes with the likeliest source; parents, the loop from which each seems to have it;
    followers, those of them that follow the source.
    """

    group: Group
    candidates: tuple[Candidate, ...]
    links: Mapping[str, Root]
    parents: Mapping[str, str]
    followers: frozenset[str]

    @property
    def source(self) -> str:
        """The likeliest source."""
        return self.candidates[0].loop


def follower_confidence(own: Mapping[Cause, float], root: Root, limits: PlantLimits) -> dict[Cause, float]:
    """The confidences of a follower [%], from its own and its source: the load is at least as sure as the coherence;
    what else the loop shows comes from the source."""
    load = max(own.get(Cause.LOAD, 0.0), 100.0 * root.coherence)
    rest = {c: min(own.get(c, 0.0), limits.follower_most_pct) for c in (Cause.VALVE, Cause.TUNING)}
    return {Cause.LOAD: load, **rest}


def may_follow(own: Peer, other: Peer, level: float, limits: PlantLimits) -> bool:
    """Whether a loop can follow another at this coherence.

    Two loops that each cycle by themselves do not keep step over a night, so one of the two moves the other; what
    comes from a neighbour's stem looks like stem motion in the follower too, but explains it worse. A loop whose own
    valve seems at fault follows one whose valve is so by more evidence, and no other.
    """
    if level < limits.coherent:
        return False
    if own.cause is not Cause.VALVE:
        return True
    return other.cause is Cause.VALVE and other.evidence >= own.evidence


def _traced(group: Group, peers: Mapping[str, Peer], limits: PlantLimits) -> Traced | None:
    """A group with its candidates and followers; None where no verdict of its loops is known."""
    lags = Lags(m.wave for m in group.members)
    candidates = candidates_of(lags, peers, limits)
    if not candidates:
        return None
    best = candidates[0]
    links = _links(group, best, lags)
    followers = [
        loop
        for loop, link in links.items()
        if best.confidence_pct >= limits.source_pct
        and loop in peers
        and may_follow(peers[loop], peers[best.loop], link.coherence, limits)
    ]
    return Traced(group, candidates, links, _parents(best.loop, lags), frozenset(followers))


def _links(group: Group, best: Candidate, lags: Lags) -> dict[str, Root]:
    """How the other loops of a group go with its likeliest source."""
    out = {}
    for member in group.members:
        loop = member.wave.loop
        if loop != best.loop:
            lag = lags.between(best.loop, loop)
            known = lag.lag_s if lag.deviation_s < LAG_KNOWN * abs(lag.lag_s) else None
            out[loop] = Root(best.loop, max(lag.coherence, member.coherence), known, best.confidence_pct)
    return out


def _parents(source: str, lags: Lags) -> dict[str, str]:
    """The loop from which each other one seems to have the wave: the tree of greatest coherence from the source on.

    Coherence falls along the way, for each loop adds something of its own; of large groups all hang on the source.
    """
    others = [loop for loop in lags.waves if loop != source]
    if len(lags.waves) > MOST_IN_TREE:
        return dict.fromkeys(others, source)
    best = {loop: (lags.between(source, loop).coherence, source) for loop in others}
    out: dict[str, str] = {}
    while best:
        loop = max(best, key=lambda name: (best[name][0], name))
        out[loop] = best.pop(loop)[1]
        for other, (level, _) in best.items():
            found = lags.between(loop, other).coherence
            if found > level + BY_WAY:
                best[other] = found, loop
    return out


def trace(waves: Sequence[Wave], peers: Mapping[str, Peer], limits: PlantLimits) -> list[Traced]:
    """The groups of a night, traced to their sources, those of more loops first."""
    found = (_traced(g, peers, limits) for g in groups_of(waves, limits))
    return [t for t in found if t is not None]


def followers_of(found: Sequence[Traced]) -> dict[str, tuple[Root, Wave]]:
    """The source that each follower has, in its larger wave where it follows in two groups.

    A loop that leads one group follows nobody in another where its wave is smaller.
    """
    out: dict[str, tuple[Root, Wave]] = {}
    leads = {t.source: t.group.waves[t.source].amplitude_pct for t in found if t.followers}
    for t in found:
        waves = t.group.waves
        for loop in t.followers:
            size = waves[loop].amplitude_pct
            if leads.get(loop, 0.0) < size and (loop not in out or size > out[loop][1].amplitude_pct):
                out[loop] = t.links[loop], waves[loop]
    return {loop: (_rooted(loop, out), wave) for loop, (_, wave) in out.items()}


def _rooted(loop: str, found: Mapping[str, tuple[Root, Wave]]) -> Root:
    """The source at the end of the chain: a follower's follower follows the loop that leads both."""
    at, seen = found[loop][0], {loop}
    while at.loop in found and at.loop not in seen:
        seen.add(at.loop)
        further = found[at.loop][0]
        level = min(at.coherence, further.coherence)
        at = Root(further.loop, level, None, min(at.confidence_pct, further.confidence_pct))
    return at
