"""What makes the cycle: odds of the causes over the nights under one pair of settings, and whom the loop follows.

A night's odds err in two ways: by what differs from night to night, and by what the loop does to them every
night. The mean over nights keeps the second alone, so the pooled odds may go further than one night's, but not on
and on: k = (b + n) / (b + n / m) of m nights, with b and n the variances of both."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from analyzer.config import BeliefLimits
from analyzer.loop.decisions import CAUSES, Cause, counts

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class CycleBelief:
    """What is believed of a loop's oscillation under the settings in force.

    since, the first night under them; nights, those that were assessed; weight, nights that oscillated, older
    ones counting less; odds, sums of the log confidence of the causes in the order of CAUSES; cause, the one that
    is named; sources, nights in which it followed each of other loops; loud, whether it oscillates as far as
    nights tell; top, the largest significance [% h]."""

    since: str = ""
    nights: int = 0
    weight: float = 0.0
    odds: tuple[float, ...] = (0.0, 0.0, 0.0)
    cause: Cause = Cause.UNDECIDED
    sources: Mapping[str, float] = field(default_factory=dict)
    loud: bool = False
    top: float = 0.0
    usual: float | None = None
    off: int = 0
    shift: float = 0.0

    def chances(self, between: float) -> dict[Cause, float]:
        """Confidence in each cause [%]; none without a night that oscillated."""
        if self.weight <= 0.0:
            return dict.fromkeys(CAUSES, 0.0)
        further = (1.0 + between) / (1.0 + between / max(self.weight, 1.0))
        score = [further * x / self.weight for x in self.odds]
        odds = [math.exp(s - max(score)) for s in score]
        return {c: 100.0 * o / sum(odds) for c, o in zip(CAUSES, odds, strict=True)}

    @property
    def source(self) -> str | None:
        """The loop that it follows in at least half of the nights that oscillated; None where there is none."""
        if not self.sources or sum(self.sources.values()) < 0.5 * self.weight:
            return None
        return max(self.sources, key=lambda loop: (self.sources[loop], loop))


def loud_and_top(before: CycleBelief, row: Row, limits: BeliefLimits) -> tuple[bool, float]:
    """Whether a loop oscillates, with a memory, and the largest significance [% h]: what is small beside what
    there was neither ends nor begins an oscillation."""
    now = float(row["oscillation_significance"] or 0.0)
    top = max(before.top, now)
    loud = counts(row["oscillating_pct"]) and now >= limits.comes_back * top
    quiet = row["oscillating_pct"] < limits.seldom_pct or now < limits.dies_away * top
    return (loud if loud or quiet or not before.nights else before.loud), top


def cycle_with_night(before: CycleBelief, share: float, row: Row, limits: BeliefLimits) -> CycleBelief:
    """The belief with one night more, of which what came before counts for a share."""
    loud, top = loud_and_top(before, row, limits)
    begun = _usual_size(before, float(row["oscillation_significance"] or 0.0) if loud else 0.0, limits)
    told = replace(begun, since=before.since or row["night"], nights=before.nights + 1, loud=loud, top=top)
    if not counts(row["oscillating_pct"]):
        return told
    weight, odds = share * before.weight + 1.0, _log_confidence(row, limits)
    sources = {k: share * v for k, v in before.sources.items()}
    if row["source_loop"]:
        sources[row["source_loop"]] = sources.get(row["source_loop"], 0.0) + 1.0
        odds = tuple(x / before.weight for x in before.odds) if before.weight else odds
    summed = tuple(share * a + b for a, b in zip(before.odds, odds, strict=True))
    told = replace(told, weight=weight, odds=summed, sources=sources)
    return replace(told, cause=_cause_named(told, row, limits))


def _usual_size(before: CycleBelief, significance: float, limits: BeliefLimits) -> CycleBelief:
    """The belief with what is usual after a night of some significance [% h]: another size is told by the
    second night in a row that has it."""
    if significance <= 0.0:
        return replace(before, shift=0.0)
    now = math.log(significance)
    if before.usual is None:
        return replace(before, usual=now, shift=0.0)
    beyond = now - before.usual
    way = 0 if abs(beyond) < math.log(limits.another_size) else int(math.copysign(1.0, beyond))
    off = way if way * before.off <= 0 else before.off + way
    if abs(off) >= limits.confirmed:
        return replace(before, usual=now, off=0, shift=math.exp(beyond))
    usual = before.usual if way else before.usual + beyond / min(before.nights + 1, limits.recent)
    return replace(before, usual=usual, off=off, shift=0.0)


def _log_confidence(row: Row, limits: BeliefLimits) -> tuple[float, ...]:
    """Log confidence of the causes by one night; of one whose record lacks something, none stands out: the next
    record lacks the same."""
    found = [max(row[f"osc_{c}_pct"] or 0.0, limits.least_pct) for c in CAUSES]
    if row["lack"] and row["cause"] not in CAUSES:
        second = sorted(found)[-2]
        found = [min(x, second) for x in found]
    return tuple(math.log(x) for x in found)


def _cause_named(now: CycleBelief, row: Row, limits: BeliefLimits) -> Cause:
    """The cause that is named: the first night's own, then the one that the nights have made likely, until they no
    longer do."""
    if now.nights == 1:
        return Cause(row["cause"])
    found = now.chances(limits.between)
    first = max(found, key=lambda c: found[c])
    if found[first] >= limits.named_pct:
        return first
    held = now.cause
    return held if held in found and found[held] >= limits.held_pct else Cause.UNDECIDED
