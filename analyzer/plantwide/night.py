"""The plant-wide pass over the loops of a night: followers are sent to their source, groups get rows of their own."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from analyzer.config import PlantLimits
from analyzer.loop.decisions import Cause, GroupRole, Status
from analyzer.loop.finding import Cell, Finding, Root, Sign, Swing, following
from analyzer.plantwide.source import Candidate, Peer
from analyzer.plantwide.verdict import Traced, follower_confidence, followers_of, trace
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
    traced = trace(waves, _peers(loops), limits)
    told = [t for t in traced if any(k in loops and loops[k].oscillates for k in t.group.loops)]
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


def _follower(alone: Finding, known: Finding, root: Root, wave: Wave, limits: PlantLimits) -> Finding:
    """A loop as a follower; as it was where it does not oscillate, not even with its part in what is shared."""
    confidence = follower_confidence(alone.confidence, root, limits)
    sign = Sign(Cause.LOAD, limits.follower_sign, following_text(root))
    told = following(known, root, swing_of(alone, root, wave, limits), confidence, sign)
    return told if told.oscillates else known


def swing_of(own: Finding, root: Root, wave: Wave, limits: PlantLimits) -> Swing | None:
    """What oscillates in a follower: its wave where that is no oscillation by itself and a fair part of the error."""
    if own.oscillates or wave.share < limits.weak_share:
        return own.swing
    share, amplitude = wave.oscillating_pct, wave.amplitude_pct
    hours = own.number("usable_h") * share / 100.0
    return Swing(amplitude * root.coherence * hours, share, wave.period_s, amplitude)


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


def likely(found: Traced, limits: PlantLimits) -> list[str]:
    """The fewest candidates that together are as sure as an answer has to be, the likeliest first."""
    out, total = [], 0.0
    for candidate in found.candidates:
        out.append(candidate.loop)
        total += candidate.confidence_pct
        if total >= limits.sure_pct:
            break
    return out


def _role(loop: str, found: Traced, followers: Mapping[str, Root], limits: PlantLimits) -> GroupRole:
    if loop in found.followers and loop in followers:
        return GroupRole.FOLLOWER
    if loop == found.source and found.candidates[0].confidence_pct >= limits.source_pct:
        return GroupRole.SOURCE
    return GroupRole.CANDIDATE if loop in likely(found, limits) else GroupRole.SHARES


def gain_pct(wave: Wave, error_pct: Cell) -> float | None:
    """Part of the average absolute error that goes with a wave [% of span]."""
    if not isinstance(error_pct, float):
        return None
    return error_pct * (1.0 - math.sqrt(max(1.0 - min(wave.share, 1.0), 0.0)))


def group_rows(
    number: int,
    found: Traced,
    followers: Mapping[str, Root],
    loops: Mapping[str, Finding],
    limits: PlantLimits,
) -> list[dict[str, Any]]:
    """A row for each loop of a group that is told, the source first, then by amplitude."""
    known = {c.loop: c for c in found.candidates}
    out = []
    for loop, wave in found.group.waves.items():
        if loop not in loops:
            continue
        link, candidate = found.links.get(loop), known.get(loop)
        out.append(
            {
                "loop": loop,
                "night": loops[loop].night,
                "group": str(number),
                "role": _role(loop, found, followers, limits),
                "source_pct": candidate.confidence_pct if candidate else 0.0,
                "group_period_s": found.group.period_s,
                "parent": found.parents.get(loop),
                "coherence": link.coherence if link else 1.0,
                "lag_s": link.lag_s if link else 0.0,
                "wave_amplitude_pct": wave.amplitude_pct,
                "wave_share_pct": 100.0 * min(wave.share, 1.0),
                "gain_pct": gain_pct(wave, loops[loop].known.get("average_absolute_error_pct")),
                "group_signs": _signs(candidate) if candidate else None,
            }
        )
    return sorted(out, key=lambda r: (-r["source_pct"], -r["wave_amplitude_pct"], r["loop"]))


def _signs(candidate: Candidate) -> str:
    return json.dumps({name: round(value, 3) for name, value in candidate.signs.items()})


def own_groups(rows: Sequence[Row]) -> dict[str, str]:
    """The group of each loop: that in which it follows or leads, else that of its larger wave."""

    def worth(row: Row) -> tuple[bool, float]:
        return row["role"] in (GroupRole.FOLLOWER, GroupRole.SOURCE), row["wave_amplitude_pct"]

    best: dict[str, Row] = {}
    for row in rows:
        if row["loop"] not in best or worth(row) > worth(best[row["loop"]]):
            best[row["loop"]] = row
    return {loop: row["group"] for loop, row in best.items()}
