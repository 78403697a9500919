"""Valve wear and its width: evidence of all nights since the last repair, added up for each backlash width.

For every width each night gives the gain of backlash of that width over an ideal valve in explaining PV (witness.py).
The nights are added with forgetting, so that a fault too small for one night is found by several that agree on its
width. A spurious result of one night is not confirmed by the others: the best one is left out, unless it is
sufficient alone. If a night and those after it differ significantly from those before (generalized likelihood ratio:
Willsky, Jones 1976), the belief restarts there, as it does after a repair.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from typing import Any

import numpy as np

from analyzer.belief.cycle import RECENT
from analyzer.config import BeliefLimits, Config
from analyzer.loop.decisions import Cause, Fault
from identification.estimation.backlash_stiction import WIDTHS
from identification.record import Floats

Witness = Mapping[str, Any]
"""Result of a night, from analyzer/loop/witness.py."""
Doubt = tuple[float, float, float]
"""Possible error of a night: as one of several, alone, and as evidence against a width."""
Recent = tuple[str, tuple[float, ...]]
"""A night and its evidence for each width, with its present weight [nat]."""


@dataclass(frozen=True, slots=True)
class ValveBelief:
    """The belief about a valve.

    since, the first night that counts; nights, number with a result; alone, evidence for each of WIDTHS beyond the
    possible error of a night [nat]; summed, evidence of all nights, and best, that of the best of them; recent,
    evidence of the last of them; jump and clear, evidence for a slip jump and its threshold [nat]; certain, the night
    since which it is continuously believed worn, '' if it is not.
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
        """Evidence for each of WIDTHS [nat], shape of WIDTHS: of all nights without the best one, or of a
        single night that is sufficient alone."""
        if not self.summed:
            return np.zeros(WIDTHS.size)
        return np.maximum(np.subtract(self.summed, self.best), self.alone)

    @property
    def width(self) -> float:
        """The most likely width [% OP], 0 if there is none."""
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
        """Whether it is believed to be worn, with hysteresis: until it is no longer likely."""
        return self.worn_pct(limits) >= (limits.still_worn_pct if self.certain else limits.worn_pct)

    def fault(self, before: Fault | None) -> Fault:
        """Backlash or stiction by the gain of a slip jump, as before if that is not clear."""
        if self.jump > self.clear:
            return Fault.STICTION
        if self.clear == 0.0 or self.jump < 0.5 * self.clear:
            return Fault.BACKLASH
        return before if before in (Fault.BACKLASH, Fault.STICTION) else Fault.UNDECIDED


def after_recorder_change(before: ValveBelief) -> ValveBelief:
    """The belief after a change of recorder: the same valve may appear up to a quarter wider or narrower."""

    def widened(x: tuple[float, ...]) -> tuple[float, ...]:
        padded = np.pad(np.asarray(x), 1, mode="edge")
        return tuple(np.max([padded[:-2], padded[1:-1], padded[2:]], axis=0).tolist()) if x else x

    alone, summed, best = map(widened, (before.alone, before.summed, before.best))
    return replace(before, recent=(), alone=alone, summed=summed, best=best)


def faded_over(before: str, night: str, limits: BeliefLimits) -> float:
    """Weight in a later night of the evidence of an earlier one [-]."""
    gap = (date.fromisoformat(night) - date.fromisoformat(before)).days
    return float(0.5 ** (max(gap, 0) / limits.half_life))


def doubt(evidence: Witness, cause: Cause, oscillates: bool, config: Config) -> Doubt:
    """Possible error of a night's likelihood, in units of the evidence required for a verdict of one night [-]: as
    one of several nights, alone, and as evidence against a width.

    No model is exact, and its error is the same every night. A cycle with another cause, by all nights, imitates
    backlash every night; backlash that is narrow relative to OP's range is imitated in a night now and then.
    """
    limits = config.belief
    if oscillates and cause is not Cause.VALVE:
        error = limits.doubt_load if cause is Cause.LOAD else limits.doubt_small
        return error, error, error
    width = float(WIDTHS[int(np.argmax(evidence["profile"]))])
    narrow = oscillates or width < config.cause.size * evidence["op_range"]
    alone = limits.doubt_small if narrow else limits.doubt_alone
    return limits.doubt, alone, limits.doubt_alone if oscillates else limits.doubt_against


def weighed(evidence: Witness, wrong_by: float, against: float, limits: BeliefLimits) -> Floats:
    """Evidence of a night for each width [nat], beyond its possible error. Evidence at the threshold of a
    fault counts as `clear_night`; no night counts for more than `most`."""
    found = np.asarray(evidence["profile"], dtype=np.float64) / max(evidence["needed"], 1e-9)
    found = np.maximum(found - wrong_by, 0.0) + np.minimum(found + against, 0.0)
    found *= limits.clear_night
    top = float(found.max())
    if top > limits.most:
        found = np.where(found > 0.0, found * limits.most / top, found)
    return np.maximum(found, -limits.most)


def valve_with_night(
    before: ValveBelief, share: float, night: str, evidence: Witness, wrong: Doubt, limits: BeliefLimits
) -> ValveBelief:
    """The belief with one more night; the earlier belief counts for a share [-].

    evidence : the night's witness; wrong : its possible error, from `doubt`.
    """
    *each, against = wrong
    own, alone = (weighed(evidence, x, against, limits) for x in each)
    faded = [(n, share * np.asarray(p)) for n, p in before.recent]
    recent = [*faded, (night, own)][-RECENT:]
    summed = share * np.asarray(before.summed) + own if before.summed else own
    at = changed_at(summed, [p for _, p in recent], limits.change, limits.confirmed)
    if at is not None:
        return _different_valve(recent[at:], evidence)
    jump, clear = evidence["jump"]
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


def _different_valve(recent: Sequence[tuple[str, Floats]], evidence: Witness) -> ValveBelief:
    """The belief about a different valve, from the recent nights."""
    each = np.array([p for _, p in recent])
    summed, best = each.sum(axis=0), np.maximum(each.max(axis=0), 0.0)
    alone, summed, best = map(_kept, (np.minimum(summed, 0.0), summed, best))
    return ValveBelief(
        recent[0][0], len(recent), alone, summed, best, _nights_kept(recent), *evidence["jump"]
    )


def _kept(x: Floats) -> tuple[float, ...]:
    """As stored."""
    return tuple(np.round(x, 3).tolist())


def _nights_kept(recent: Sequence[tuple[str, Floats]]) -> tuple[Recent, ...]:
    return tuple((night, _kept(p)) for night, p in recent)


def changed_at(summed: Floats, recent: Sequence[Floats], least: float, nights: int) -> int | None:
    """The first of the recent nights since which the valve is a different one; None if all nights agree.

    summed : evidence of all nights together [nat], shape (w,); recent : that of the last of them, with their weight
    in it, shape (w,) each; least : required gain in log likelihood [nat] of two valves over one; nights : minimum
    number of nights for it: one can be an outlier.
    """
    together = max(float(summed.max()), 0.0)
    after, best, gain = np.zeros(summed.size), None, least
    for k in range(len(recent) - 1, -1, -1):
        after = after + recent[k]
        separate = max(float((summed - after).max()), 0.0) + max(float(after.max()), 0.0)
        if separate - together > gain and len(recent) - k >= nights:
            best, gain = k, separate - together
    return best
