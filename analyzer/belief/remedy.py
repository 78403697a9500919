"""What to do, night after night the same until something changes: votes of the nights, and one pair of settings held.

Every pair that a night advises was proven on that night's model and load. The pair that lies amid those of all nights
is told, and held until their middle has moved away from it by more than they scatter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from analyzer.config import BeliefLimits
from analyzer.loop.decisions import Action

Row = Mapping[str, Any]
WITH_PAIR = ("kp_new", "ti_new", "advice", "expected_period_s", "expected_pv_amplitude_pct")
"""What a night says of a pair of settings that it advises."""
CHOICES = (Action.RETUNE, Action.REPAIR_VALVE, Action.CHECK_SETTINGS)
"""Actions between which nights choose."""
TOLD_AGAIN = (*CHOICES, Action.NEEDS_DATA, Action.UNDECIDED)
"""Actions of a loop that oscillates on which nights vote; the others follow from cause and lanes."""

TWO_SIGMA = 2.0 * 1.4826
"""Two standard deviations of a normal error in terms of its median absolute deviation."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Settings that a night advised, in the units of loops.csv, and what it said of them."""

    night: str
    kp: float
    ti: float
    advice: str = ""
    period_s: float | None = None
    amplitude_pct: float | None = None

    @property
    def at(self) -> tuple[float, float]:
        """Its place, where distances are ratios."""
        return math.log(abs(self.kp)), math.log(abs(self.ti))


@dataclass(frozen=True, slots=True)
class RemedyBelief:
    """Votes by action, older nights counting less; the pairs advised of late; the action and the pair that are
    held."""

    votes: Mapping[Action, float] = field(default_factory=dict)
    pairs: tuple[Pair, ...] = ()
    action: Action | None = None
    held: Pair | None = None
    advised: int = 0
    settled: int = 0

    @property
    def abstaining(self) -> Action:
        """What is told where no cause is: that which most nights lacked something, or that their signs disagree."""
        lacking, disagreeing = (self.votes.get(a, 0.0) for a in (Action.NEEDS_DATA, Action.UNDECIDED))
        return Action.NEEDS_DATA if lacking > disagreeing else Action.UNDECIDED


def remedy_with_night(before: RemedyBelief, share: float, row: Row, limits: BeliefLimits) -> RemedyBelief:
    """The belief with one night more, of which what came before counts for a share."""
    votes = {a: share * v for a, v in before.votes.items()}
    action = row["action"]
    if action in TOLD_AGAIN:
        votes[Action(action)] = votes.get(Action(action), 0.0) + 1.0
    pairs, advised = before.pairs, before.advised
    if action == Action.RETUNE and row["kp_new"] and row["ti_new"]:
        pairs = (*pairs, Pair(row["night"], *(row[c] for c in WITH_PAIR)))[-limits.pairs :]
        advised += 1
    now = _settled_pair(replace(before, votes=votes, pairs=pairs, advised=advised), limits)
    return replace(now, action=_voted(now, limits))


def _voted(now: RemedyBelief, limits: BeliefLimits) -> Action | None:
    """The action that is held, or one for which clearly more nights speak. A night that lacked something for settings
    says nothing against those of others."""
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
    """The belief with the pair that is told: the first until enough nights have advised, then that amid theirs; and
    again where twice as many have and their middle lies elsewhere by more than a ratio and twice its own error."""
    if now.held is None:
        return replace(now, held=now.pairs[-1] if now.pairs else None)
    if now.advised < max(limits.settle_nights, 2 * now.settled):
        return now
    places = np.array([p.at for p in now.pairs])
    middle = np.median(places, axis=0)
    scatter = TWO_SIGMA * np.median(np.abs(places - middle), axis=0) / math.sqrt(len(places))
    near = np.maximum(math.log(limits.settle_ratio), scatter)
    if now.settled and (np.abs(np.array(now.held.at) - middle) <= near).all():
        return now
    held = now.pairs[int(np.argmin(np.abs(places - middle).max(axis=1)))]
    return replace(now, held=held, settled=now.advised)
