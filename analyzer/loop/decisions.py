"""Findings and decisions of one loop in one night, as values for programs; rows and words are made of them.

The values are those of the store and of `triage rank`. A worker finds the results of a loop by itself; the night adds
the loop that it follows or those that it moves, and its lanes. Each step makes a new Finding, and contradictory
findings are refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum, auto

from analyzer.words import sentences
from identification.errors import NotAssessedError
from tuning import Action as Action
from tuning import Cause as Cause

Cell = str | float | None
Figures = tuple[Cell, ...]
"""Inputs of a sentence of words/: numbers, and names of loops and tags."""
CAUSES = (Cause.VALVE, Cause.TUNING, Cause.LOAD)
"""Causes with their own confidence."""


class SignKind(StrEnum):
    """Kinds of signs of a cause."""

    EVIDENCE = "evidence"
    WIDTH = "size"
    AMPLIFICATION = "amplification"
    REGULARITY = "kurtosis"
    RINGING = "ringing"
    SMOOTH_LOAD = "smooth load"
    PERIODIC_LOAD = "periodic load"
    KEPT_PHASE = "kept phase"
    LIKELIER = "likelier model"
    CALM_EVIDENCE = "evidence of a calm loop"
    CALM_WIDTH = "size in a calm loop"
    AGAIN = "stretch after stretch of a calm loop"
    DEAD_VALVE = "dead valve"
    FOLLOWS = "follows"
    OF_BELOW = "loop below at fault"
    OF_ABOVE = "loop above cycles"


COUNTS_PCT = 20.0
"""Share of the time from which a loop counts as oscillating [%]; contract of the ranking."""


class Fault(StrEnum):
    """Fault of a valve."""

    BACKLASH = "backlash"
    STICTION = "stiction"
    NONE = "none"
    UNDECIDED = "undecided"


class GroupRole(StrEnum):
    """Role of a loop in a group with a common oscillation."""

    SOURCE = "source"
    CANDIDATE = "candidate"
    FOLLOWER = "follower"
    SHARES = "shares"


class Status(StrEnum):
    """Result of a loop's night."""

    OK = "ok"
    NOT_ASSESSED = "not assessed"
    FAILED = "failed"


class Lane(StrEnum):
    """Reason to check a loop, its oscillation or another; in the order of the report."""

    OSCILLATION = "oscillation"
    MANUAL = "manual"
    AT_LIMIT = "at limit"
    LASTING_ERROR = "lasting error"
    FROZEN = "frozen"
    SLUGGISH = "sluggish"
    TRAVEL = "valve travel"
    WEAR = "wear"
    WINDUP = "windup"


class Due(StrEnum):
    """Due time of a valve's repair: at once, or at the next shutdown if its effect costs little until then."""

    NOW = "now"
    SHUTDOWN = "next shutdown"


class MissingData(StrEnum):
    """Missing data of a record for an answer."""

    PV = "PV"
    SAMPLES = "samples"
    READABLE = "readable values"
    AUTOMATIC = "time in automatic"
    OP = "OP"
    MOVING_OP = "moving OP"
    OP_RANGE = "OP's range"
    OP_OFF_LIMITS = "OP off its limits"
    SWITCHES = "OP of more than two values"
    UNCOMPRESSED = "uncompressed trends"
    UNBROKEN = "unbroken samples"
    FASTER = "faster samples"
    FINER = "finer values"
    LONGER = "longer record"
    MANUAL_TEST = "some periods in manual"
    STEP_TEST = "a step test"
    NEIGHBOUR = "a night after another loop is mended"


class RequirementKind(StrEnum):
    """Requirement for an answer, each a sentence of words/texts.toml."""

    PV_TAG = auto()
    GOOD_PV = auto()
    MORE_PV = auto()
    STAMPS = auto()
    IN_A_ROW = auto()
    NUMBERS = auto()
    SAMPLES = auto()
    SAMPLES_IN_TURN = auto()
    AUTOMATIC = auto()
    OP = auto()
    OP_RANGE = auto()
    MOVING_OP = auto()
    MOVING_PV = auto()
    PV_AS_MEASURED = auto()
    UNCOMPRESSED = auto()
    ARCHIVED = auto()
    OFF_LIMITS = auto()
    SWITCHES = auto()
    MODEL = auto()
    OF_A_CYCLE = auto()
    UNFOLDED = auto()
    OF_A_CAUSE = auto()
    OF_SETTINGS = auto()
    FINER = auto()
    HOURS = auto()
    STEP_TEST = auto()
    CAUSE_IN_MANUAL = auto()
    AS_TOLD = auto()


@dataclass(frozen=True, slots=True)
class Requirement:
    """Missing data of a record, None if an error ended the loop; its requirement, and the figures of that."""

    lack: MissingData | None
    need: RequirementKind
    figures: Figures = ()

    def __str__(self) -> str:
        """Requirement and available data, in words."""
        return sentences("needs")[self.need].format(*self.figures)


class LacksError(NotAssessedError):
    """A record is not sufficient for an answer, and its missing data are known."""

    def __init__(self, needs: Requirement) -> None:
        self.needs = needs
        super().__init__(str(needs))

    def __reduce__(self) -> tuple[type[LacksError], tuple[Requirement]]:
        """Form for transfer between processes: the constructor's argument."""
        return type(self), (self.needs,)


def counts(oscillating_pct: float | None) -> bool:
    """Whether a loop that oscillates for this share of the time [%] counts as oscillating."""
    return oscillating_pct is not None and oscillating_pct >= COUNTS_PCT


def decided_fault(row: Mapping[str, object] | None) -> Fault | None:
    """Fault of the valve in a night's row; None if there is no row, or the loop was not assessed."""
    fault = None if row is None or row["status"] != Status.OK else row.get("valve_fault")
    return None if fault is None else Fault(str(fault))


@dataclass(frozen=True, slots=True)
class Sign:
    """One sign: its cause, its strength (0 to 1), its kind, and its figures and loops, in the form for
    words/reason.py."""

    points_to: Cause
    strength: float
    kind: SignKind
    figures: Figures = ()


@dataclass(frozen=True, slots=True)
class OscillationFigures:
    """The oscillation: significance [% h], share of the time [%], period [s] and amplitude of PV [% of span]."""

    significance: float = 0.0
    oscillating_pct: float = 0.0
    period_s: float | None = None
    amplitude_pct: float | None = None


@dataclass(frozen=True, slots=True)
class Remedy:
    """Remedy: the action, None if none was searched for; its text; new settings in the units of loops.csv, and the
    due time of a valve's repair."""

    action: Action | None = None
    text: str = ""
    kp_new: float | None = None
    ti_new: float | None = None
    due: Due | None = None

    def __post_init__(self) -> None:
        """Refuse settings without a retune, and a due time without a repair."""
        if self.action is not Action.RETUNE and (self.kp_new, self.ti_new) != (None, None):
            raise ValueError(f"new settings with the action {self.action}")
        if self.action is not Action.REPAIR_VALVE and self.due is not None:
            raise ValueError(f"a repair is due with the action {self.action}")


@dataclass(frozen=True, slots=True)
class SourceLoop:
    """The loop that another one follows: coherence of the two [-], delay of the follower [s], None if unknown, and
    confidence that the oscillation starts there [%]."""

    loop: str
    coherence: float
    lag_s: float | None
    confidence_pct: float


@dataclass(frozen=True, slots=True)
class Finding:
    """One loop in one night.

    swing, None if the record cannot show whether the loop oscillates; confidence [%] of each cause, none if no
    verdict was searched for; lacking, the reason for missing results, or the missing data for a cause; lack, the
    missing data for an answer or for new settings; remedy, the action; known, all other columns of the loop's row by
    their names; follows, the loop that moves it; moves, those that it moves; lanes, reasons to check it; group, the
    number of the oscillation that it shares.
    """

    loop: str
    night: str
    status: Status
    lacking: Requirement | None = None
    lack: MissingData | None = None
    swing: OscillationFigures | None = None
    cause: Cause | None = None
    fault: Fault | None = None
    confidence: Mapping[Cause, float] = field(default_factory=dict)
    signs: tuple[Sign, ...] = ()
    remedy: Remedy = Remedy()
    known: Mapping[str, Cell] = field(default_factory=dict)
    follows: SourceLoop | None = None
    moves: tuple[str, ...] = ()
    lanes: tuple[Lane, ...] = ()
    group: str | None = None

    def __post_init__(self) -> None:
        """Refuse an own action of a loop that follows another one."""
        if self.follows is not None and self.remedy.action is not Action.SEE_SOURCE_LOOP:
            raise ValueError(f"{self.loop} follows {self.follows.loop} and is to {self.remedy.action}")

    @property
    def oscillates(self) -> bool:
        """Whether the loop counts as oscillating."""
        return self.swing is not None and counts(self.swing.oscillating_pct)

    @property
    def width_pct(self) -> float | None:
        """Backlash or stickband of a faulty valve [% of OP], None if unknown."""
        return self.number("stickband_pct") or self.number("backlash_pct") or None

    def number(self, column: str) -> float:
        """A column's number, 0 if unknown."""
        value = self.known.get(column)
        return value if isinstance(value, (int, float)) else 0.0

    def text(self, column: str) -> str:
        """A column's text, '' if unknown."""
        value = self.known.get(column)
        return value if isinstance(value, str) else ""
