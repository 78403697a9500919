"""What is known of one loop in one night, as values that programs test; rows and words are made of it alone.

A worker finds it of the loop by itself; the night completes it: whom the loop follows or moves, and its lanes.
Each step makes a new Finding, and what would contradict itself is not made.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from analyzer.config import LaneLimits
from analyzer.lanes.lanes import action_of, lanes_of
from analyzer.loop.decisions import (
    CAUSES,
    Action,
    Cause,
    Cell,
    Due,
    Fault,
    Figures,
    Lack,
    Lane,
    Needs,
    SignKind,
    Status,
    counts,
)


@dataclass(frozen=True, slots=True)
class Sign:
    """One sign: which cause it points to, how strongly (0 to 1), what it shows, and the figures and loops that say
    so, as words/signs.py takes them."""

    points_to: Cause
    strength: float
    kind: SignKind
    figures: Figures = ()


@dataclass(frozen=True, slots=True)
class Swing:
    """What oscillates: significance [% h], share of the time [%], period [s] and amplitude of PV [% of span]."""

    significance: float = 0.0
    oscillating_pct: float = 0.0
    period_s: float | None = None
    amplitude_pct: float | None = None


@dataclass(frozen=True, slots=True)
class Remedy:
    """What to do: the action, None where none was sought; what there is to say of it; new settings in the units of
    loops.csv, and when a valve's repair is due."""

    action: Action | None = None
    text: str = ""
    kp_new: float | None = None
    ti_new: float | None = None
    due: Due | None = None

    def __post_init__(self) -> None:
        """Refuse settings without a retune, and a time for a repair that is none."""
        if self.action is not Action.RETUNE and (self.kp_new, self.ti_new) != (None, None):
            raise ValueError(f"new settings with the action {self.action}")
        if self.action is not Action.REPAIR_VALVE and self.due is not None:
            raise ValueError(f"a repair is due with the action {self.action}")


@dataclass(frozen=True, slots=True)
class Root:
    """The loop that another one follows: coherence of the two [-], how much later the follower is [s], None where
    that cannot be told, and how sure the oscillation starts there [%]."""

    loop: str
    coherence: float
    lag_s: float | None
    confidence_pct: float


@dataclass(frozen=True, slots=True)
class Finding:
    """One loop in one night.

    swing, None where the record cannot show whether the loop oscillates; confidence [%] of each cause, none
    where no verdict was sought; lacking, why there are no results, or what the record lacks for a cause; lack, what
    it lacks for an answer or for new settings; remedy, what to do; known, all other columns of the loop's row by
    their names; follows, the loop that moves it; moves, those that it moves; lanes, why it is worth a look; group,
    the number of the oscillation that it shares.
    """

    loop: str
    night: str
    status: Status
    lacking: Needs | None = None
    lack: Lack | None = None
    swing: Swing | None = None
    cause: Cause | None = None
    fault: Fault | None = None
    confidence: Mapping[Cause, float] = field(default_factory=dict)
    signs: tuple[Sign, ...] = ()
    remedy: Remedy = Remedy()
    known: Mapping[str, Cell] = field(default_factory=dict)
    follows: Root | None = None
    moves: tuple[str, ...] = ()
    lanes: tuple[Lane, ...] = ()
    group: str | None = None

    def __post_init__(self) -> None:
        """Refuse a loop that follows another one and is to do something of its own."""
        if self.follows is not None and self.remedy.action is not Action.SEE_SOURCE_LOOP:
            raise ValueError(f"{self.loop} follows {self.follows.loop} and is to {self.remedy.action}")

    @property
    def action(self) -> Action | None:
        """What to do, with what the lanes ask for where nothing else is to be done."""
        return action_of(self.status, self.remedy.action, self.lanes)

    @property
    def oscillates(self) -> bool:
        """Whether the loop counts as oscillating."""
        return self.swing is not None and counts(self.swing.oscillating_pct)

    @property
    def width_pct(self) -> float | None:
        """Play or stickband of a faulty valve [% of OP], None where it is not known."""
        return self.number("stickband_pct") or self.number("backlash_pct") or None

    def number(self, column: str) -> float:
        """A column's number, 0 where it is not known."""
        value = self.known.get(column)
        return value if isinstance(value, (int, float)) else 0.0

    def text(self, column: str) -> str:
        """A column's text, '' where it is not known."""
        value = self.known.get(column)
        return value if isinstance(value, str) else ""


def following(
    own: Finding, root: Root, swing: Swing | None, confidence: Mapping[Cause, float], sign: Sign
) -> Finding:
    """A loop that follows another one: a load from outside moves it, and its own valve and settings are left alone.

    own, of the loop alone; swing, its part in what is shared where that is no oscillation by itself; confidence of
    each cause [%]; sign, that it follows.
    """
    return replace(
        own,
        swing=swing,
        cause=Cause.LOAD,
        fault=Fault.NONE,
        confidence={c: confidence[c] for c in CAUSES},
        signs=(sign, *own.signs),
        remedy=Remedy(Action.SEE_SOURCE_LOOP, f"Look at {root.loop} first."),
        follows=root,
    )


def in_lanes(own: Finding, limits: LaneLimits) -> Finding:
    """A loop with its lanes."""
    return replace(own, lanes=lanes_of(own, limits))
