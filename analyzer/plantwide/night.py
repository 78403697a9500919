"""The plant-wide pass over the loops of a night: followers are sent to their source, groups get rows of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from analyzer.config import PlantLimits
from analyzer.loop.decisions import CAUSES, Cause, Status
from analyzer.loop.finding import Finding, Root, Sign, following
from analyzer.plantwide.rows import group_rows, is_told, own_groups, swing_of
from analyzer.plantwide.source import Peer
from analyzer.plantwide.verdict import Source, followers_of, follows, trace
from analyzer.plantwide.wave import Wave
from analyzer.words.reason import following_text

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class TracedNight:
    """The loops of a night, those of followers and of their sources changed, and the rows of its groups."""

    loops: dict[str, Finding]
    groups: Sequence[Row]


def traced_night(
    loops: Mapping[str, Finding], waves: Sequence[Wave], limits: PlantLimits, first: int = 1
) -> TracedNight:
    """What the plant-wide pass makes of a night.

    Parameters
    ----------
    loops : mapping
        The loops by name, each with its own verdict.
    waves : sequence of Wave
        Of all loops.
    limits : PlantLimits
    first : int
        Number of the first group.
    """
    told = [t for t in trace(waves, _peers(loops), limits) if is_told(t, loops)]
    found = followers_of(told)
    sources = {loop: source for loop, (source, _) in found.items()}
    groups = [r for k, t in enumerate(told, first) for r in group_rows(k, t, sources, loops, limits)]
    done = dict(loops)
    for loop, source in sources.items():
        lead = done[source.loop]
        done[source.loop] = replace(lead, moves=tuple(sorted((*lead.moves, loop))))
    for loop, (source, wave) in found.items():
        done[loop] = _follower(loops[loop], done[loop], source, wave, limits)
    own = own_groups(groups)
    return TracedNight({k: replace(f, group=own.get(k)) for k, f in done.items()}, groups)


def _follower(alone: Finding, known: Finding, source: Source, wave: Wave, limits: PlantLimits) -> Finding:
    """A loop as a follower; as it was where it does not oscillate, not even with its part in what is shared."""
    verdict = follows({c: alone.confidence.get(c, 0.0) for c in CAUSES}, source, limits, wave)
    root = Root(source.loop, source.coherence, source.lag_s, source.confidence_pct)
    sign = Sign(Cause.LOAD, verdict.strength, following_text(root))
    told = following(known, root, swing_of(alone, verdict, limits), verdict.confidence, sign)
    return told if told.oscillates else known


def _peers(loops: Mapping[str, Finding]) -> dict[str, Peer]:
    """The verdicts of the loops that were assessed."""
    return {
        k: Peer(
            f.cause or Cause.NONE,
            f.number("evidence"),
            f.confidence.get(Cause.TUNING, 0.0),
            f.text("master"),
        )
        for k, f in loops.items()
        if f.status is Status.OK
    }
