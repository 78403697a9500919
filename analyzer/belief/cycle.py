"""Joint result of the nights under one pair of settings: the cause of the cycle, the loop's source, and the action.

A night's log odds have two errors: one varies from night to night (variance n), the other is the same every
night (variance b). The mean over m nights reduces only the first. The pooled log odds are therefore this mean
times k = (b + n) / (b + n / m), which has a limit.

The action is constant until something changes: by votes of the nights, and one fixed pair of settings. Every pair
advised by a night was tested on that night's model and load. The pair nearest to the median of all nights is
reported, and kept until the median has moved away from it by more than the scatter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from analyzer.columns import Row
from analyzer.config import BeliefLimits
from analyzer.loop.decisions import CAUSES, Action, Cause, counts

PAIRS = 15  # Number of pairs of settings that are stored: two weeks
LEAST_PCT = 0.5  # Least confidence that a night counts for a cause [%]
SETTLE_NIGHTS = 3
"""Number of nights with advised settings from which the median pair is kept [nights]; a median needs
three."""
SETTLE_RATIO = 1.2
"""Least ratio between the median of the pairs and the reported pair for a replacement. No engineer changes
a setting for a smaller one."""
RECENT = 8  # Nights in which a change is searched for: a week

WITH_PAIR = ("kp_new", "ti_new", "advice", "expected_period_s", "expected_pv_amplitude_pct")
"""Columns of a night for an advised pair of settings."""
CHOICES = (Action.RETUNE, Action.REPAIR_VALVE, Action.CHECK_SETTINGS)
"""Actions on which nights vote."""
VOTED_ACTIONS = (*CHOICES, Action.NEEDS_DATA, Action.UNDECIDED)
"""Actions of an oscillating loop on which nights vote; the others follow from cause and lanes."""
TWO_SIGMA = 2.0 * 1.4826
"""Two standard deviations of a normal error relative to its median absolute deviation."""


@dataclass(frozen=True, slots=True)
class CycleBelief:
    """The belief about a loop's oscillation under the settings in force.

    since, the first night under them; nights, those that were assessed; weight, nights that oscillated, older ones
    with lower weight; odds, sums of the log confidence of the causes in the order of CAUSES; cause, the decided one;
    sources, nights in which it followed each of other loops; loud, whether it oscillates by all nights; top,
    the largest significance [% h]; usual, log of the usual significance.

    off is the number of consecutive nights far above (positive) or below (negative) the usual significance.
    shift is the ratio of a new usual significance to the old one in the night that confirms it, otherwise 0.
    """

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
        """Confidence in each cause [%]; empty without a night that oscillated."""
        if self.weight <= 0.0:
            return dict.fromkeys(CAUSES, 0.0)
        further = (1.0 + between) / (1.0 + between / max(self.weight, 1.0))
        score = [further * x / self.weight for x in self.odds]
        odds = [math.exp(s - max(score)) for s in score]
        return {c: 100.0 * o / sum(odds) for c, o in zip(CAUSES, odds, strict=True)}

    @property
    def source(self) -> str | None:
        """The loop that it follows in at least half of the nights that oscillated; otherwise None."""
        if not self.sources or sum(self.sources.values()) < 0.5 * self.weight:
            return None
        return max(self.sources, key=lambda loop: (self.sources[loop], loop))


def oscillation_state(before: CycleBelief, row: Row, limits: BeliefLimits) -> tuple[bool, float]:
    """Whether a loop oscillates, with hysteresis, and the largest significance [% h]: a change that is small relative
    to it neither ends nor starts an oscillation."""
    now = float(row["oscillation_significance"] or 0.0)
    top = max(before.top, now)
    loud = counts(row["oscillating_pct"]) and now >= limits.comes_back * top
    quiet = row["oscillating_pct"] < limits.seldom_pct or now < limits.dies_away * top
    return (loud if loud or quiet or not before.nights else before.loud), top


def cycle_with_night(before: CycleBelief, share: float, row: Row, limits: BeliefLimits) -> CycleBelief:
    """The belief with one more night; earlier ones count for a share."""
    loud, top = oscillation_state(before, row, limits)
    begun = _usual_size(before, float(row["oscillation_significance"] or 0.0) if loud else 0.0, limits)
    updated = replace(begun, since=before.since or row["night"], nights=before.nights + 1, loud=loud, top=top)
    if not counts(row["oscillating_pct"]):
        return updated
    weight, odds = share * before.weight + 1.0, _log_confidence(row, limits)
    sources = {k: share * v for k, v in before.sources.items()}
    if row["source_loop"]:
        sources[row["source_loop"]] = sources.get(row["source_loop"], 0.0) + 1.0
        odds = tuple(x / before.weight for x in before.odds) if before.weight else odds
    summed = tuple(share * a + b for a, b in zip(before.odds, odds, strict=True))
    updated = replace(updated, weight=weight, odds=summed, sources=sources)
    return replace(updated, cause=_cause_named(updated, row, limits))


def _usual_size(before: CycleBelief, significance: float, limits: BeliefLimits) -> CycleBelief:
    """The belief with the usual significance after a night [% h]: a new level counts from the second consecutive
    night on."""
    if significance <= 0.0:
        return replace(before, shift=0.0)
    now = math.log(significance)
    if before.usual is None:
        return replace(before, usual=now, shift=0.0)
    beyond = now - before.usual
    direction = 0 if abs(beyond) < math.log(limits.another_size) else int(math.copysign(1.0, beyond))
    off = direction if direction * before.off <= 0 else before.off + direction
    if abs(off) >= limits.confirmed:
        return replace(before, usual=now, off=0, shift=math.exp(beyond))
    usual = before.usual if direction else before.usual + beyond / min(before.nights + 1, RECENT)
    return replace(before, usual=usual, off=off, shift=0.0)


def _log_confidence(row: Row, limits: BeliefLimits) -> tuple[float, ...]:
    """Log confidence of the causes by one night. If its record lacks data, no cause is preferred, because the next
    record lacks the same."""
    found = [max(row[f"osc_{c}_pct"] or 0.0, LEAST_PCT) for c in CAUSES]
    if row["lack"] and row["cause"] not in CAUSES:
        second = sorted(found)[-2]
        found = [min(x, second) for x in found]
    return tuple(math.log(x) for x in found)


def _cause_named(now: CycleBelief, row: Row, limits: BeliefLimits) -> Cause:
    """The decided cause: first that of the first night, later the cause that the nights make likely, as
    long as they do."""
    if now.nights == 1:
        return Cause(row["cause"])
    found = now.chances(limits.between)
    first = max(found, key=lambda c: found[c])
    if found[first] >= limits.named_pct:
        return first
    held = now.cause
    return held if held in found and found[held] >= limits.keep_pct else Cause.UNDECIDED


@dataclass(frozen=True, slots=True)
class Pair:
    """Settings advised by a night, in the units of loops.csv, with their expected results."""

    night: str
    kp: float
    ti: float
    advice: str = ""
    period_s: float | None = None
    amplitude_pct: float | None = None

    @property
    def at(self) -> tuple[float, float]:
        """Coordinates in which distances are ratios; 0 without proportional or integral action, stated as 0."""
        return math.log(abs(self.kp) or 1.0), math.log(abs(self.ti)) if self.ti else 0.0


def advised_pair(row: Row) -> Pair | None:
    """The pair that a night advises, if any."""
    advises = row["action"] == Action.RETUNE and row["kp_new"] is not None and row["ti_new"] is not None
    return Pair(row["night"], *(row[c] for c in WITH_PAIR)) if advises else None


@dataclass(frozen=True, slots=True)
class RemedyBelief:
    """Votes by action, with lower weight for older nights; recently advised pairs; the current action and pair."""

    votes: Mapping[Action, float] = field(default_factory=dict)
    pairs: tuple[Pair, ...] = ()
    action: Action | None = None
    held: Pair | None = None
    advised: int = 0
    settled: int = 0


def remedy_with_night(before: RemedyBelief, share: float, row: Row, limits: BeliefLimits) -> RemedyBelief:
    """The belief with one more night; earlier ones count for a share."""
    votes = {a: share * v for a, v in before.votes.items()}
    action = row["action"]
    if action in VOTED_ACTIONS:
        votes[Action(action)] = votes.get(Action(action), 0.0) + 1.0
    pairs, advised, pair = before.pairs, before.advised, advised_pair(row)
    if pair is not None:
        pairs, advised = (*pairs, pair)[-PAIRS:], advised + 1
    now = _settled_pair(replace(before, votes=votes, pairs=pairs, advised=advised), limits)
    return replace(now, action=_voted(now, limits))


def _voted(now: RemedyBelief, limits: BeliefLimits) -> Action | None:
    """The current action, or one with clearly more votes. A night that lacked data for settings does not vote against
    those of others."""
    lacking = sum(now.votes.get(a, 0.0) for a in (Action.NEEDS_DATA, Action.UNDECIDED))
    known = {a: now.votes.get(a, 0.0) for a in CHOICES}
    if known[Action.RETUNE] < limits.advised_share * (known[Action.RETUNE] + lacking):
        known[Action.RETUNE] = 0.0
    total = sum(known.values())
    if total == 0.0:
        return max(now.votes, key=lambda a: now.votes[a]) if now.votes else now.action
    first = max(known, key=lambda a: (known[a], a == now.action))
    held = known.get(now.action, 0.0) if now.action else 0.0
    return first if not held or known[first] - held > limits.vote_lead * math.sqrt(total) else now.action


def _settled_pair(now: RemedyBelief, limits: BeliefLimits) -> RemedyBelief:
    """The belief with the reported pair: the first until enough nights have advised, then the one nearest to their
    median. It is replaced if twice as many have and their median differs by a ratio and twice its standard error."""
    if now.held is None:
        return replace(now, held=now.pairs[-1] if now.pairs else None)
    if now.advised < max(SETTLE_NIGHTS, 2 * now.settled):
        return now
    places = np.array([p.at for p in now.pairs])
    middle = np.median(places, axis=0)
    scatter = TWO_SIGMA * np.median(np.abs(places - middle), axis=0) / math.sqrt(len(places))
    near = np.maximum(math.log(SETTLE_RATIO), scatter)
    if now.settled and (np.abs(np.array(now.held.at) - middle) <= near).all():
        return now
    held = now.pairs[int(np.argmin(np.abs(places - middle).max(axis=1)))]
    return replace(now, held=held, settled=now.advised)
