"""The plant-wide pass over the rows of a night: followers are sent to their source, groups get rows of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from analyzer.config import PlantLimits
from analyzer.loop.decisions import CAUSES, Cause, Status, counts
from analyzer.plantwide.rows import group_rows, is_told, own_groups, wave_columns
from analyzer.plantwide.source import Peer
from analyzer.plantwide.verdict import followers_of, follows, trace
from analyzer.plantwide.wave import Wave
from analyzer.words.present import follower_row, root_row

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class TracedNight:
    """The rows of a night, those of followers and of their sources changed, and the rows of its groups."""

    rows: dict[str, Row]
    groups: Sequence[Row]


def traced_night(
    rows: dict[str, Row], waves: Sequence[Wave], limits: PlantLimits, first: int = 1
) -> TracedNight:
    """What the plant-wide pass makes of a night.

    Parameters
    ----------
    rows : dict
        The rows of the loops by name, each with its own verdict.
    waves : sequence of Wave
        Of all loops.
    limits : PlantLimits
    first : int
        Number of the first group.
    """
    told = [t for t in trace(waves, _peers(rows), limits) if is_told(t, rows)]
    found = followers_of(told)
    sources = {loop: source for loop, (source, _) in found.items()}
    groups = [r for k, t in enumerate(told, first) for r in group_rows(k, t, sources, rows, limits)]
    moved: dict[str, list[str]] = {}
    for loop, source in sources.items():
        moved.setdefault(source.loop, []).append(loop)
    changed = {loop: root_row(rows[loop], sorted(names)) for loop, names in moved.items()}
    for loop, (source, wave) in found.items():
        verdict = follows(_confidence(rows[loop]), source, limits, wave)
        seen = {**rows[loop], **wave_columns(rows[loop], verdict, limits)}
        if counts(seen["oscillating_pct"]):
            changed[loop] = follower_row(seen, verdict)
    own = own_groups(groups)
    return TracedNight({k: {**r, "group": own.get(k)} for k, r in (rows | changed).items()}, groups)


def _peers(rows: Mapping[str, Row]) -> dict[str, Peer]:
    """The verdicts of the loops that were assessed."""
    return {
        k: Peer(
            Cause(r["cause"] or Cause.NONE),
            r["evidence"] or 0.0,
            r["osc_tuning_pct"] or 0.0,
            r["master"] or "",
        )
        for k, r in rows.items()
        if r["status"] == Status.OK
    }


def _confidence(row: Row) -> dict[Cause, float]:
    """The confidences of a row [%], 0 where none is told."""
    return {cause: row[f"osc_{cause}_pct"] or 0.0 for cause in CAUSES}
