"""The plant-wide pass over the loops of a night, and the consequences of a common oscillation: the source leads, the
others follow it and are left unchanged, and groups have their own rows.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from analyzer.columns import Row
from analyzer.config import PlantLimits
from analyzer.loop.decisions import (
    CAUSES,
    Action,
    Cause,
    Fault,
    Figures,
    Finding,
    GroupRole,
    OscillationFigures,
    Remedy,
    Sign,
    SignKind,
    SourceLoop,
    Status,
)
from analyzer.plantwide.groups import Group, groups_of
from analyzer.plantwide.oscillation_lines import OscillationLines
from analyzer.plantwide.source import Candidate, Lags, candidates_of

LAG_KNOWN = 0.5
"""Largest ratio of a lag's standard deviation to the lag for a report: the lag is then two deviations from
zero."""
MOST_IN_TREE = 40
"""Loops of a group up to which the path from loop to loop is reported [loops]: in larger groups all are
linked to the source."""
BY_WAY = 0.02
"""Least excess of a loop's coherence with another follower over that with the source, for a path through
that follower; less is chance."""

READ = ("usable_h", "evidence", "average_absolute_error_pct")
"""Columns of a loop that are read here, in addition to attributes of a Finding."""
Loops = Mapping[str, Finding]
"""The loops of a night by name."""


def traced_night(
    loops: Loops, oscillations: Sequence[OscillationLines], limits: PlantLimits, first: int = 1
) -> tuple[dict[str, Finding], list[dict[str, Any]]]:
    """Result of the plant-wide pass: the loops, with followers and their sources changed, and rows of groups.

    loops : by name, each with its own verdict; oscillations : of all loops; first : number of the first group.
    """
    assessed = {k: f for k, f in loops.items() if f.status is Status.OK}
    traced = trace(oscillations, assessed, limits)
    reported = [t for t in traced if any(k in loops and loops[k].oscillates for k in t.group.loops)]
    found = followers_of(reported)
    sources = {loop: source for loop, (source, _) in found.items()}
    groups = [r for k, t in enumerate(reported, first) for r in group_rows(k, t, sources, loops, limits)]
    done = dict(loops)
    for loop, source in sources.items():
        lead = done[source.loop]
        done[source.loop] = replace(lead, moves=tuple(sorted((*lead.moves, loop))))
    for loop, (source, oscillation) in found.items():
        done[loop] = _follower(done[loop], source, oscillation, limits)
    own = own_groups(groups)
    return {k: replace(f, group=own.get(k)) for k, f in done.items()}, groups


def following(
    own: Finding,
    root: SourceLoop,
    swing: OscillationFigures | None,
    seen: tuple[SignKind, Figures],
    limits: PlantLimits,
) -> Finding:
    """A loop that follows another one: an external disturbance moves it, and its own valve and settings are left
    unchanged.

    own, of the loop alone; swing, its part of the common oscillation if it has none of its own; seen, the evidence
    for following, with its figures. The confidence in the load is at least the coherence; other findings come from
    its source.
    """
    confidence = {c: min(own.confidence.get(c, 0.0), limits.follower_most_pct) for c in CAUSES}
    confidence[Cause.LOAD] = max(own.confidence.get(Cause.LOAD, 0.0), 100.0 * root.coherence)
    return replace(
        own,
        swing=swing,
        cause=Cause.LOAD,
        fault=Fault.NONE,
        confidence=confidence,
        signs=(Sign(Cause.LOAD, limits.follower_sign, *seen), *own.signs),
        remedy=Remedy(Action.SEE_SOURCE_LOOP, f"Look at {root.loop} first."),
        follows=root,
    )


def _follower(own: Finding, root: SourceLoop, oscillation: OscillationLines, limits: PlantLimits) -> Finding:
    """A loop as a follower; unchanged if it does not oscillate, not even with its part of the common oscillation."""
    seen = SignKind.FOLLOWS, (root.loop, root.lag_s, root.coherence)
    follower = following(own, root, swing_of(own, root, oscillation, limits), seen, limits)
    return follower if follower.oscillates else own


def swing_of(
    own: Finding, root: SourceLoop, oscillation: OscillationLines, limits: PlantLimits
) -> OscillationFigures | None:
    """Oscillation of a follower: its part, if it has none of its own and the part is a fair share of the error."""
    if own.oscillates or oscillation.share < limits.weak_share:
        return own.swing
    share, amplitude = oscillation.oscillating_pct, oscillation.amplitude_pct
    hours = own.number("usable_h") * share / 100.0
    return OscillationFigures(amplitude * root.coherence * hours, share, oscillation.period_s, amplitude)


def likely(found: Traced, limits: PlantLimits) -> list[str]:
    """The fewest candidates that together reach the required confidence, most likely first."""
    out, total = [], 0.0
    for candidate in found.candidates:
        out.append(candidate.loop)
        total += candidate.confidence_pct
        if total >= limits.sure_pct:
            break
    return out


def _role(loop: str, found: Traced, followers: Mapping[str, SourceLoop], limits: PlantLimits) -> GroupRole:
    if loop in found.followers and loop in followers:
        return GroupRole.FOLLOWER
    if loop == found.source and found.candidates[0].confidence_pct >= limits.source_pct:
        return GroupRole.SOURCE
    return GroupRole.CANDIDATE if loop in likely(found, limits) else GroupRole.SHARES


def group_rows(
    number: int, found: Traced, followers: Mapping[str, SourceLoop], loops: Loops, limits: PlantLimits
) -> list[dict[str, Any]]:
    """A row for each loop of a reported group, the source first, then by amplitude."""
    known = {c.loop: c for c in found.candidates}
    itself = SourceLoop("", 1.0, 0.0, 0.0)
    out = []
    for loop, oscillation in found.group.oscillations.items():
        if loop not in loops:
            continue
        link, candidate = found.links.get(loop, itself), known.get(loop, Candidate(loop, {}, 0.0))
        share, error = min(oscillation.share, 1.0), loops[loop].known.get("average_absolute_error_pct")
        removed = 1.0 - math.sqrt(max(1.0 - share, 0.0))  # part of the error due to the oscillation
        signs = json.dumps({k: round(v, 3) for k, v in candidate.signs.items()}) if loop in known else None
        row = {
            "loop": loop,
            "night": loops[loop].night,
            "group": str(number),
            "role": _role(loop, found, followers, limits),
            "source_pct": candidate.confidence_pct,
            "group_period_s": found.group.period_s,
            "parent": found.parents.get(loop),
            "coherence": link.coherence,
            "lag_s": link.lag_s,
            "wave_amplitude_pct": oscillation.amplitude_pct,
            "wave_share_pct": 100.0 * share,
            "gain_pct": error * removed if isinstance(error, float) else None,
            "group_signs": signs,
        }
        out.append(row)
    return sorted(out, key=lambda r: (-r["source_pct"], -r["wave_amplitude_pct"], r["loop"]))


def own_groups(rows: Sequence[Row]) -> dict[str, str]:
    """The group of each loop: that in which it follows or leads, otherwise that of its larger oscillation."""

    def worth(row: Row) -> tuple[bool, float]:
        return row["role"] in (GroupRole.FOLLOWER, GroupRole.SOURCE), row["wave_amplitude_pct"]

    worthiest_first = sorted(rows, key=worth, reverse=True)
    return {row["loop"]: row["group"] for row in reversed(worthiest_first)}


@dataclass(frozen=True, slots=True)
class Traced:
    """A group with its candidates, most likely first.

    links, relation of each other loop to the most likely source; parents, the loop from which each probably receives
    the oscillation; followers, those of them that follow the source.
    """

    group: Group
    candidates: tuple[Candidate, ...]
    links: Mapping[str, SourceLoop]
    parents: Mapping[str, str]
    followers: frozenset[str]

    @property
    def source(self) -> str:
        """The most likely source."""
        return self.candidates[0].loop


def may_follow(own: Finding, other: Finding, level: float, limits: PlantLimits) -> bool:
    """Whether a loop can follow another at this coherence.

    Two independently cycling loops do not stay in phase over a night, so one of the two moves the other. An
    oscillation from a neighbour's stem looks like stem motion in the follower too, but explains it worse. A loop
    whose own valve seems faulty can follow only a loop with more evidence of a valve fault.
    """
    if level < limits.coherent:
        return False
    if own.cause is not Cause.VALVE:
        return True
    return other.cause is Cause.VALVE and other.number("evidence") >= own.number("evidence")


def _traced(group: Group, peers: Loops, limits: PlantLimits) -> Traced | None:
    """A group with its candidates and followers; None if no verdict of its loops is known."""
    lags = Lags(group.oscillations)
    candidates = candidates_of(lags, peers, limits)
    if not candidates:
        return None
    best = candidates[0]
    links = _links_to_source(group, best, lags, limits)
    tested = links.keys() & peers.keys() if best.confidence_pct >= limits.source_pct else ()
    lead = peers[best.loop]
    followers = frozenset(k for k in tested if may_follow(peers[k], lead, links[k].coherence, limits))
    return Traced(group, candidates, links, _parents(best.loop, lags, limits), followers)


def _links_to_source(group: Group, best: Candidate, lags: Lags, limits: PlantLimits) -> dict[str, SourceLoop]:
    """Relations of the other loops of a group to its most likely source."""
    out = {}
    for loop, coherence in group.coherence.items():
        if loop != best.loop:
            lag = lags.between(best.loop, loop)
            known = lag.lag_s if lag.deviation_s < LAG_KNOWN * abs(lag.lag_s) else None
            out[loop] = SourceLoop(best.loop, max(lag.coherence, coherence), known, best.confidence_pct)
    return out


def _parents(source: str, lags: Lags, limits: PlantLimits) -> dict[str, str]:
    """The loop from which each other one probably receives the oscillation: the tree of greatest coherence.

    Coherence decreases along the path, because each loop adds its own noise; in large groups all follow the source.
    """
    others = [loop for loop in lags.oscillations if loop != source]
    if len(lags.oscillations) > MOST_IN_TREE:
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


def trace(oscillations: Sequence[OscillationLines], peers: Loops, limits: PlantLimits) -> list[Traced]:
    """The groups of a night, traced to their sources, those of more loops first."""
    found = (_traced(g, peers, limits) for g in groups_of(oscillations, limits))
    return [t for t in found if t is not None]


def followers_of(found: Sequence[Traced]) -> dict[str, tuple[SourceLoop, OscillationLines]]:
    """The source of each follower, in its larger oscillation if it follows in two groups.

    A loop that leads one group does not follow in another where its oscillation is smaller.
    """
    out: dict[str, tuple[SourceLoop, OscillationLines]] = {}
    leads = {t.source: t.group.oscillations[t.source].amplitude_pct for t in found if t.followers}
    for t in found:
        oscillations = t.group.oscillations
        for loop in t.followers:
            size = oscillations[loop].amplitude_pct
            if leads.get(loop, 0.0) < size and (loop not in out or size > out[loop][1].amplitude_pct):
                out[loop] = t.links[loop], oscillations[loop]
    return {loop: (_rooted(loop, out), oscillation) for loop, (_, oscillation) in out.items()}


def _rooted(loop: str, found: Mapping[str, tuple[SourceLoop, OscillationLines]]) -> SourceLoop:
    """The source at the end of the chain: a follower of a follower follows the loop that leads both."""
    at, seen = found[loop][0], {loop}
    while at.loop in found and at.loop not in seen:
        seen.add(at.loop)
        further = found[at.loop][0]
        level = min(at.coherence, further.coherence)
        at = SourceLoop(further.loop, level, None, min(at.confidence_pct, further.confidence_pct))
    return at
