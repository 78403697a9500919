"""Linked loops, judged together: the slave first, because it takes the place of the valve in its master's loop."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from analyzer.config import PlantLimits
from analyzer.loop.action import ACTING
from analyzer.loop.decisions import (
    Action,
    Cause,
    Due,
    Finding,
    GroupRole,
    MissingData,
    Remedy,
    SignKind,
    SourceLoop,
    Status,
)
from analyzer.plantwide.night import following
from analyzer.plantwide.structure import Link, Tie
from analyzer.words import sentences
from analyzer.words.reason import below_first

COLUMN = {Tie.MASTER: "master", Tie.SPLIT: "split_of", Tie.RATIO: "ratio_of"}
"""The column with the loop to which another one is linked."""
READ = (*COLUMN.values(), "half_slope", "split_slope")
"""Columns of a loop that are read here, in addition to attributes of a Finding."""
OWN = (Cause.VALVE, Cause.TUNING)
"""Causes inside a loop."""
HARMONICS = (1, 2, 3)
"""Parts of a master's period in which a slave's error may cycle, because its SP has any waveform."""


def linked(
    loops: Mapping[str, Finding], links: Mapping[str, Link], limits: PlantLimits
) -> dict[str, Finding]:
    """The loops of a night, with linked loops judged together.

    Links in loops.csv have priority; without a stated master, the link found in the trends is used.
    """
    done = {k: _built(f, links.get(k)) for k, f in loops.items()}
    for loop in loops:
        own = done[loop]
        tie = next((t for t, column in COLUMN.items() if own.text(column)), None)
        above = own.text(COLUMN[tie]) if tie is not None else ""
        if tie is not None and above in done and above != loop:
            led = done[above].moves
            done[above], done[loop] = _judged_together(done[above], own, tie, links.get(loop), limits)
            root = done[above].follows
            if root is not None and root.loop == loop:
                _send_on(done, [k for k in led if k != loop], above, root)
    halves: dict[str, list[Finding]] = {}
    for found in done.values():
        halves.setdefault(found.text("split_of"), []).append(found)
    return {k: _with_halves(f, halves.get(k, ()), limits) for k, f in done.items()}


def _with_halves(own: Finding, halves: Sequence[Finding], limits: PlantLimits) -> Finding:
    """A controller of a split range, without new settings if its halves need different ones."""
    if len(halves) != 2 or own.remedy.action is not Action.RETUNE:
        return own
    size = [abs(h.number("half_slope") * h.number("split_slope")) for h in halves]
    if not all(size) or max(size) < limits.halves_ratio * min(size):
        return own
    stronger, weaker = (halves[k] for k in sorted((0, 1), key=lambda k: -size[k]))
    times = max(size) / min(size)
    apart = stronger.loop, weaker.loop, times, 100.0 * times / (1.0 + times)
    text = sentences("settings")["halves_apart"].format(*apart)
    return replace(own, remedy=Remedy(Action.NEEDS_DATA, text), lack=MissingData.NEIGHBOUR)


def _send_on(done: dict[str, Finding], led: Sequence[str], above: str, root: SourceLoop) -> None:
    """Let the loops that a master moves follow the loop that the master follows."""
    sent = []
    for k in led:
        old = done[k].follows
        if old is not None and old.loop == above:
            level, sure = min(old.coherence, root.coherence), min(old.confidence_pct, root.confidence_pct)
            done[k] = replace(done[k], follows=SourceLoop(root.loop, level, None, sure))
            sent.append(k)
    done[above] = replace(done[above], moves=())
    done[root.loop] = replace(done[root.loop], moves=_moves_with(done[root.loop], *sent))


def reassign_sources(rows: Sequence[Mapping[str, Any]], loops: Mapping[str, Finding]) -> list[dict[str, Any]]:
    """The rows of groups; if the leader is a master that follows its slave, the slave becomes the leader.

    A loop that leads one group and follows another loop's in a second one still leads the first.
    """
    out = [dict(r) for r in rows]
    by_place = {(r["group"], r["loop"]): r for r in out}
    for row in [r for r in out if r["role"] == GroupRole.SOURCE]:
        root = loops[row["loop"]].follows
        if root is None or loops[root.loop].text("master") != row["loop"]:
            continue
        row["role"] = GroupRole.FOLLOWER
        slave = by_place.get((row["group"], root.loop))
        if slave is not None:
            slave["role"] = GroupRole.SOURCE
            slave["source_pct"], row["source_pct"] = row["source_pct"], slave["source_pct"]
    return out


def _built(own: Finding, link: Link | None) -> Finding:
    """A loop with its link."""
    if link is None or any(own.text(column) for column in COLUMN.values()):
        return own
    return replace(own, known={**own.known, COLUMN[link.tie]: link.loop, "link_agreement": link.agreement})


def _judged_together(
    above: Finding, below: Finding, tie: Tie, link: Link | None, limits: PlantLimits
) -> tuple[Finding, Finding]:
    """A loop and the one linked to it; unchanged if either already follows another loop."""
    if {above.status, below.status} != {Status.OK} or above.follows is not None or below.follows is not None:
        return above, below
    level = 1.0 if link is None else min(link.agreement, 1.0)
    faulty = below.cause is Cause.VALVE if tie is Tie.SPLIT else below.cause in OWN
    blamed = {Tie.MASTER: faulty or above.cause is Cause.VALVE, Tie.SPLIT: faulty, Tie.RATIO: False}[tie]
    if blamed and (above.oscillates or above.cause in OWN):
        cause = Cause.TUNING if below.cause is Cause.TUNING else Cause.VALVE
        root = SourceLoop(below.loop, level, None, max(f.confidence.get(cause, 0.0) for f in (above, below)))
        if above.cause is Cause.VALVE or _alike(above, below, limits) or not below.oscillates:
            seen = SignKind.OF_BELOW, (below.loop, below.cause, tie)
            # the repair could wait for a single loop, but the master cycles because of it
            waits = below.remedy.due is Due.SHUTDOWN
            remedy = Remedy(below.remedy.action, due=Due.NOW) if waits else below.remedy
            moved = replace(below, moves=_moves_with(below, above.loop), remedy=remedy)
            return following(above, root, above.swing, seen, limits), moved
        if above.remedy.action in ACTING:
            remedy = Remedy(Action.NEEDS_DATA, below_first(below, tie))
            return replace(above, remedy=remedy, lack=MissingData.NEIGHBOUR), below
        return above, below
    if not faulty and below.oscillates and above.oscillates and _alike(above, below, limits):
        root = SourceLoop(above.loop, level, None, max(above.confidence.values(), default=0.0))
        hangs = SignKind.OF_ABOVE, (above.loop, tie)
        leads = replace(above, moves=_moves_with(above, below.loop))
        return leads, following(below, root, below.swing, hangs, limits)
    return above, below


def _moves_with(own: Finding, *loops: str) -> tuple[str, ...]:
    return tuple(sorted({*own.moves, *loops}))


def _alike(above: Finding, below: Finding, limits: PlantLimits) -> bool:
    """Whether both cycle with one period, or the lower loop with an integer fraction of the upper one's."""
    periods = [f.swing.period_s if f.swing is not None else None for f in (above, below)]
    if None in periods or not all(periods):
        return False
    ratio = math.log(periods[0] / periods[1])  # type: ignore[operator]
    return min(abs(ratio - math.log(m)) for m in HARMONICS) <= limits.cascade_period
