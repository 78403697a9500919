"""Is the valve worn, and how widely: evidence of all nights since its last repair, added up width by width.

Each night says of every width how much better a play of it explains PV than an ideal valve (witness.py). The nights
are added up with forgetting, so that a fault too small for one night is found by several that agree on its width, and
what one night mistakes for a play of some width the others do not bear out: the best of them is left out, unless it
would be believed by itself. Where a night and those after it say
another thing than those before by more than chance (generalized likelihood ratio: Willsky, Jones 1976) the belief
begins anew there, as it does after a repair.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from typing import Any

import numpy as np

from analyzer.config import BeliefLimits, Config
from analyzer.loop.decisions import Cause, Fault
from identification.estimation.backlash_stiction import WIDTHS
from identification.record import Floats

Witness = Mapping[str, Any]
"""What a night says, as analyzer/loop/witness.py puts it."""
Doubt = tuple[float, float, float]
"""What a night may be wrong by: as one of several, by itself, and in what it says against a width."""
Recent = tuple[str, tuple[float, ...]]
"""A night and what it said of each width, as it counts today [nat]."""


@dataclass(frozen=True, slots=True)
class ValveBelief:
    """What is believed of a valve.

    since, the first night that counts; nights, how many told something; alone, evidence for each of WIDTHS
    beyond what a night may be wrong by [nat]; summed, evidence of all nights, and best, that of the best of
    them; recent, what the last of them said; jump and clear, evidence for a slip jump and what it takes [nat];
    certain, the night from which on it was believed worn without a break, '' where it is not.
    """

    since: str = ""
    nights: int = 0
    alone: tuple[float, ...] = ()
    summed: tuple[float, ...] = ()
    best: tuple[float, ...] = ()
    recent: tuple[Recent, ...] = ()
    jump: float = 0.0
    clear: float = 0.0
    certain: str = ""

    @property
    def profile(self) -> Floats:
        """Evidence for each of WIDTHS [nat], shape of WIDTHS: of all nights but the best, or beyond all doubt."""
        if not self.summed:
            return np.zeros(WIDTHS.size)
        return np.maximum(np.subtract(self.summed, self.best), self.alone)

    @property
    def width(self) -> float:
        """The likeliest width [% OP], 0 where none is."""
        found = self.profile
        return float(WIDTHS[int(np.argmax(found))]) if found.max() > 0.0 else 0.0

    def worn_pct(self, limits: BeliefLimits) -> float:
        """Probability that the valve is worn [%]."""
        found = self.profile
        odds = limits.worn_before / (1.0 - limits.worn_before) / found.size
        top = max(float(found.max()), 0.0)
        worn = odds * float(np.exp(found - top).sum())
        return 100.0 * worn / (worn + float(np.exp(-top)))

    def is_worn(self, limits: BeliefLimits) -> bool:
        """Whether it is believed to be worn; one that was stays so until it is no longer likely."""
        return self.worn_pct(limits) >= (limits.still_worn_pct if self.certain else limits.worn_pct)

    def fault(self, before: Fault | None) -> Fault:
        """Backlash or stiction by what a slip jump adds, as before where that is not clear."""
        if self.jump > self.clear:
            return Fault.STICTION
        if self.clear == 0.0 or self.jump < 0.5 * self.clear:
            return Fault.BACKLASH
        return before if before in (Fault.BACKLASH, Fault.STICTION) else Fault.UNDECIDED


def recorded_otherwise(before: ValveBelief) -> ValveBelief:
    """The belief as another recorder may bear it out: it sees the same valve up to a quarter wider or narrower."""

    def widened(x: tuple[float, ...]) -> tuple[float, ...]:
        beside = np.pad(np.asarray(x), 1, mode="edge")
        return tuple(np.max([beside[:-2], beside[1:-1], beside[2:]], axis=0).tolist()) if x else x

    alone, summed, best = map(widened, (before.alone, before.summed, before.best))
    return replace(before, recent=(), alone=alone, summed=summed, best=best)


def faded_over(before: str, night: str, limits: BeliefLimits) -> float:
    """How much of what was known in one night counts in a later one [-]."""
    gap = (date.fromisoformat(night) - date.fromisoformat(before)).days
    return float(0.5 ** (max(gap, 0) / limits.half_life))


def doubt(said: Witness, cause: Cause, oscillates: bool, config: Config) -> Doubt:
    """What a night's likelihood may be wrong by, in the evidence that a verdict of one night needs [-]: as one of
    several nights, by itself, and in what it says against a width.

    No model is exact, and what it lacks it lacks every night. In a cycle which another cause makes, by all nights, a
    play is mimicked every night; one that is narrow beside OP's range, in a night now and then.
    """
    limits = config.belief
    if oscillates and cause is not Cause.VALVE:
        beside = limits.doubt_beside if cause is Cause.LOAD else limits.doubt_small
        return beside, beside, beside
    width = float(WIDTHS[int(np.argmax(said["profile"]))])
    narrow = oscillates or width < config.cause.size * said["op_range"]
    alone = limits.doubt_small if narrow else limits.doubt_alone
    return limits.doubt, alone, limits.doubt_alone if oscillates else limits.doubt_against


def weighed(said: Witness, wrong_by: float, against: float, limits: BeliefLimits) -> Floats:
    """What a night says of each width [nat]: beyond what it may be wrong by, what it takes to tell a fault counts
    `conviction`, and no night counts for more than `most`."""
    found = np.asarray(said["profile"], dtype=np.float64) / max(said["needed"], 1e-9)
    found = np.maximum(found - wrong_by, 0.0) + np.minimum(found + against, 0.0)
    found *= limits.conviction
    top = float(found.max())
    if top > limits.most:
        found = np.where(found > 0.0, found * limits.most / top, found)
    return np.maximum(found, -limits.most)


def valve_with_night(
    before: ValveBelief, share: float, night: str, said: Witness, wrong: Doubt, limits: BeliefLimits
) -> ValveBelief:
    """The belief with one night more, what it was before counting for a share [-].

    said : the night's witness; wrong : what it may be wrong by, as `doubt` gives it.
    """
    *each, against = wrong
    own, alone = (weighed(said, x, against, limits) for x in each)
    faded = [(n, share * np.asarray(p)) for n, p in before.recent]
    recent = [*faded, (night, own)][-limits.recent :]
    summed = share * np.asarray(before.summed) + own if before.summed else own
    at = changed_at(summed, [p for _, p in recent], limits.change, limits.confirmed)
    if at is not None:
        return _begun_anew(recent[at:], said)
    jump, clear = said["jump"]
    return replace(
        before,
        since=before.since or night,
        nights=before.nights + 1,
        alone=_kept(share * np.asarray(before.alone) + alone if before.alone else alone),
        summed=_kept(summed),
        best=_kept(np.maximum(share * np.asarray(before.best), own) if before.best else np.maximum(own, 0.0)),
        recent=_nights_kept(recent),
        jump=share * before.jump + jump,
        clear=share * before.clear + clear,
    )


def _begun_anew(recent: Sequence[tuple[str, Floats]], said: Witness) -> ValveBelief:
    """The belief in another valve, which the recent nights are of."""
    each = np.array([p for _, p in recent])
    summed, best = each.sum(axis=0), np.maximum(each.max(axis=0), 0.0)
    alone, summed, best = map(_kept, (np.minimum(summed, 0.0), summed, best))
    return ValveBelief(recent[0][0], len(recent), alone, summed, best, _nights_kept(recent), *said["jump"])


def _kept(x: Floats) -> tuple[float, ...]:
    """As the store keeps it."""
    return tuple(np.round(x, 3).tolist())


def _nights_kept(recent: Sequence[tuple[str, Floats]]) -> tuple[Recent, ...]:
    return tuple((night, _kept(p)) for night, p in recent)


def changed_at(summed: Floats, recent: Sequence[Floats], least: float, nights: int) -> int | None:
    """The first of the recent nights from which on the valve is another one; None where all nights agree.

    summed : evidence of all nights together [nat], shape (w,); recent : of the last of them, as they count in it,
    shape (w,) each; least : gain in log likelihood [nat] of two valves over one from which it is told; nights : how
    many of them that takes at least: one can be odd.
    """
    together = max(float(summed.max()), 0.0)
    after, best, gain = np.zeros(summed.size), None, least
    for k in range(len(recent) - 1, -1, -1):
        after = after + recent[k]
        apart = max(float((summed - after).max()), 0.0) + max(float(after.max()), 0.0)
        if apart - together > gain and len(recent) - k >= nights:
            best, gain = k, apart - together
    return best
