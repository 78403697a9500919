"""Groups as rows of the store: a row a loop and group, and the group's number in the rows of the night."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.config import PlantLimits
from analyzer.loop.decisions import GroupRole
from analyzer.loop.finding import Cell, Finding, Swing
from analyzer.plantwide.verdict import Follower, Source, Traced
from analyzer.plantwide.wave import Wave

Row = Mapping[str, Any]


def likely(found: Traced, limits: PlantLimits) -> list[str]:
    """The fewest candidates that together are as sure as an answer has to be, the likeliest first."""
    out, total = [], 0.0
    for candidate in found.candidates:
        out.append(candidate.loop)
        total += candidate.confidence_pct
        if total >= limits.sure_pct:
            break
    return out


def _role(loop: str, found: Traced, followers: Mapping[str, Source], limits: PlantLimits) -> GroupRole:
    if loop in found.followers and loop in followers:
        return GroupRole.FOLLOWER
    if loop == found.source and found.candidates[0].confidence_pct >= limits.source_pct:
        return GroupRole.SOURCE
    return GroupRole.CANDIDATE if loop in likely(found, limits) else GroupRole.SHARES


def gain_pct(wave: Wave, error_pct: Cell) -> float | None:
    """Part of the average absolute error that goes with a wave [% of span]."""
    return (
        None
        if not isinstance(error_pct, float)
        else error_pct * (1.0 - math.sqrt(max(1.0 - min(wave.share, 1.0), 0.0)))
    )


def group_rows(
    number: int,
    found: Traced,
    followers: Mapping[str, Source],
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
                "group_signs": json.dumps({k: round(v, 3) for k, v in candidate.signs.items()})
                if candidate
                else None,
            }
        )
    return sorted(out, key=lambda r: (-r["source_pct"], -r["wave_amplitude_pct"], r["loop"]))


def own_groups(rows: Sequence[Row]) -> dict[str, str]:
    """The group of each loop: that in which it follows or leads, else that of its larger wave."""

    def worth(row: Row) -> tuple[bool, float]:
        return row["role"] in (GroupRole.FOLLOWER, GroupRole.SOURCE), row["wave_amplitude_pct"]

    best: dict[str, Row] = {}
    for row in rows:
        if row["loop"] not in best or worth(row) > worth(best[row["loop"]]):
            best[row["loop"]] = row
    return {loop: row["group"] for loop, row in best.items()}


def is_told(found: Traced, loops: Mapping[str, Finding]) -> bool:
    """Whether a group is worth telling: one of its loops counts as oscillating."""
    return any(loop in loops and loops[loop].oscillates for loop in found.group.loops)


def swing_of(own: Finding, found: Follower, limits: PlantLimits) -> Swing | None:
    """What oscillates in a follower: its wave where that is no oscillation by itself and a fair part of the error."""
    wave = found.wave
    if wave is None or own.oscillates or wave.share < limits.weak_share:
        return own.swing
    share, amplitude = wave.oscillating_pct, wave.amplitude_pct
    hours = own.number("usable_h") * share / 100.0
    return Swing(amplitude * found.source.coherence * hours, share, wave.period_s, amplitude)
