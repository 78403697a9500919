"""Reasons why a loop needs a look: oscillating, in manual, at a limit, off its set point, frozen, sluggish, with high
valve travel, or with valve wear, found over several nights (analyzer/belief/wear.py). Each lane is one object: its
figure and limit, the lanes that hide it, its text, and its action.

A loop may be in several. Nothing of the analysis is imported, so that a list is fast.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from analyzer.loop.action import decided
from analyzer.loop.decisions import Action, Cause, Finding, Lane, MissingData
from analyzer.words.units import duration

if TYPE_CHECKING:
    from analyzer.config import LaneLimits


@dataclass(frozen=True, slots=True)
class Rule:
    """One lane.

    figure : the column of its ranking, largest first; clause : its clause of the reason, None if the reason includes
    it anyway; limit : the limit above which the figure puts a loop in, of the same name if ''; judged : condition for
    the lane if that is more complex; hidden_by : lanes with which it gives no additional information; of_measurement
    : whether the measurement must be checked.
    """

    lane: Lane
    figure: str
    clause: Callable[[Finding], str] | None = None
    limit: str = ""
    judged: Callable[[Finding, LaneLimits], bool] | None = None
    hidden_by: frozenset[Lane] = frozenset()
    of_measurement: bool = False

    def applies(self, found: Finding, limits: LaneLimits) -> bool:
        """Whether a loop is in the lane, even if hidden."""
        if self.judged is not None:
            return self.judged(found, limits)
        return found.number(self.figure) > float(getattr(limits, self.limit or self.figure))


def _is_at_limit(found: Finding, limits: LaneLimits) -> bool:
    """Whether OP is at a limit permanently; a switching OP always is."""
    return found.lack is not MissingData.SWITCHES and found.number("at_limits_pct") > limits.at_limits_pct


def _offset(found: Finding) -> bool:
    """Whether the controller itself leaves a lasting error: proportional only, or switching."""
    return found.known.get("ti") == 0.0 or found.lack is MissingData.SWITCHES


def _at_limit(found: Finding) -> str:
    mean = found.known.get("op_mean_pct")
    side = "" if not isinstance(mean, float) else " lower" if mean < 50 else " upper"
    text = f"OP is at its{side} limit for {found.number('at_limits_pct'):.0f} % of the time"
    from_end_to_end = found.cause is Cause.TUNING  # then the valve is not undersized
    return text if from_end_to_end else f"{text}; check the valve's size and its supply"


def _side(found: Finding) -> str:
    """Side of SP on which PV stays; 'off' if the means are unknown."""
    sp, pv = found.known.get("sp_mean_pct"), found.known.get("pv_mean_pct")
    if not isinstance(sp, float) or not isinstance(pv, float):
        return "off"
    return "below" if pv < sp else "above"


def _lasting(found: Finding) -> str:
    text = f"PV stays {found.number('lasting_error_pct'):.3g} % of span {_side(found)} SP"
    if _offset(found):
        return f"{text}, as expected without integral action"
    odd = "although the loop is in automatic and OP off its limits; check tags and ranges"
    return text if Lane.AT_LIMIT in found.lanes else f"{text} {odd}"


def _slow(found: Finding, limits: LaneLimits) -> bool:
    """Whether errors last long; the limit is shorter where the process allows more gain."""
    if found.remedy.action is Action.RETUNE and found.cause is Cause.NONE:
        return True
    memory, room = found.number("error_memory_ti"), found.number("gain_room")
    small = memory > limits.small_gain_memory_ti and room > limits.small_gain_room
    return memory > limits.error_memory_ti or small


def _sluggish(found: Finding) -> str:
    if found.remedy.action is Action.RETUNE:
        return found.remedy.text
    text = f"sluggish: errors last {found.number('error_memory_ti'):.2g} integral times, the gain is small"
    room = found.number("gain_room")
    return text if room < 2.0 else f"{text}; the gain could be about {room:.1g} times higher"


def _winds_up(found: Finding) -> str:
    late = found.number("takeover_s")
    back = f", takes it back {duration(late)} late" if late else ""
    return f"winds up while {found.text('override_with')} has the valve{back}: use external reset"


def _frozen(found: Finding) -> str:
    return f"PV is constant for {found.number('frozen_pct'):.0f} % of the time while OP moves: frozen"


def _travels(found: Finding) -> str:
    return f"{found.text('travel_of') or 'OP'} travels {found.number('valve_travel_pct_per_h'):.0f} %/h"


HIDE_SLOW = frozenset({Lane.OSCILLATION, Lane.AT_LIMIT, Lane.FROZEN})
RULES = (
    Rule(Lane.OSCILLATION, "oscillation_significance", judged=lambda f, limits: f.oscillates),
    Rule(Lane.MANUAL, "manual_pct", lambda f: f"in manual for {f.number('manual_pct'):.0f} % of the time"),
    Rule(Lane.AT_LIMIT, "at_limits_pct", _at_limit, judged=_is_at_limit),
    Rule(Lane.LASTING_ERROR, "lasting_error_pct", _lasting, of_measurement=True),
    Rule(Lane.FROZEN, "frozen_pct", _frozen, of_measurement=True),
    Rule(Lane.SLUGGISH, "error_memory_ti", _sluggish, judged=_slow, hidden_by=HIDE_SLOW),
    Rule(Lane.TRAVEL, "valve_travel_pct_per_h", _travels, "travel_pct_per_h"),
    Rule(Lane.WEAR, "wear_pct_per_month", judged=lambda f, limits: f.number("wear_pct_per_month") > 0.0),
    Rule(Lane.WINDUP, "winds_up_pct", _winds_up),
)
"""All lanes in reporting order."""
FIGURE: Mapping[Lane, str] = {r.lane: r.figure for r in RULES}
"""The column of each lane's ranking, largest first."""
LANE_TEXTS: Mapping[Lane, Callable[[Finding], str]] = {
    r.lane: r.clause for r in RULES if r.clause is not None
}
"""One clause per lane."""


def in_lanes(found: Finding, limits: LaneLimits) -> Finding:
    """A loop with its lanes by figures, and their effect on its action."""
    standing = {r.lane for r in RULES if r.applies(found, limits)}
    lanes = tuple(r.lane for r in RULES if r.lane in standing and not r.hidden_by & standing)
    placed = replace(found, lanes=lanes)
    return decided(placed, is_doubtful(placed))


def is_doubtful(found: Finding) -> bool:
    """Whether a loop's lanes require a check of its measurement."""
    doubted = [r.lane for r in RULES if r.of_measurement and r.lane in found.lanes]
    explained = Lane.AT_LIMIT in found.lanes or _offset(found)
    return bool(doubted) and not (doubted == [Lane.LASTING_ERROR] and explained)


def lanes_in(row: Mapping[str, Any]) -> tuple[str, ...]:
    """The lanes of a row, from its column `lanes`."""
    return tuple(name for name in (row["lanes"] or "").split(", ") if name)
