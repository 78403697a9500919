"""What is known and decided of one loop in one night, as values that programs test; rows and words are made of them.

The values are those of the store and of `triage rank`. A worker finds of a loop what it is by itself; the night
completes it: whom the loop follows or moves, and its lanes. Each step makes a new Finding, and what would contradict
itself is not made.
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
"""What a sentence of words/ is made of: numbers, and names of loops and tags."""
CAUSES = (Cause.VALVE, Cause.TUNING, Cause.LOAD)
"""Causes that have a confidence of their own."""


class SignKind(StrEnum):
    """What a sign of a cause shows; those of a loop that oscillates are named for the first measure they rest on."""

    EVIDENCE = "evidence"
    WIDTH = "size"
    LOAD_LEFT = "line_linear"
    AMPLIFICATION = "amplification"
    LOOP_GAIN = "loop_gain"
    PROCESS = "consistency"
    HARMONIC = "harmonic"
    WAVE_LEFT = "wave_left"
    REGULARITY = "kurtosis"
    RINGING = "ringing"
    SMOOTH_LOAD = "smooth load"
    LIKELIER = "likelier model"
    LIMITS = "saturated"
    DEAD_TIME = "dead_time_share"
    CALM_EVIDENCE = "evidence of a calm loop"
    CALM_WIDTH = "size in a calm loop"
    AGAIN = "stretch after stretch of a calm loop"
    DEAD_VALVE = "dead valve"
    FOLLOWS = "follows"
    OF_BELOW = "loop below at fault"
    OF_ABOVE = "loop above cycles"


OF_LOAD = (SignKind.LOAD_LEFT, SignKind.PROCESS, SignKind.WAVE_LEFT, SignKind.REGULARITY)
"""Signs that a load itself leaves: a peak in what the model leaves, another process away from the period, harmonics
that no faulty valve makes, a size and rhythm kept; that a valve or a limit is not seen at work is none of them."""
COUNTS_PCT = 20.0
"""A loop counts as oscillating from this share of the time on [%]; contract of the ranking."""


class Fault(StrEnum):
    """What is wrong with a valve."""

    BACKLASH = "backlash"
    STICTION = "stiction"
    NONE = "none"
    UNDECIDED = "undecided"


class GroupRole(StrEnum):
    """What a loop is in a group that shares an oscillation."""

    SOURCE = "source"
    CANDIDATE = "candidate"
    FOLLOWER = "follower"
    SHARES = "shares"


class Status(StrEnum):
    """What became of a loop in a night."""

    OK = "ok"
    NOT_ASSESSED = "not assessed"
    FAILED = "failed"


class Lane(StrEnum):
    """Why a loop is worth a look, beside its oscillation too; in the order in which lanes are told."""

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
    """When a valve's repair is due: at once, or at the next shutdown, for what it does costs little meanwhile."""

    NOW = "now"
    SHUTDOWN = "next shutdown"


class MissingData(StrEnum):
    """What a record lacks for an answer."""

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
    """What is needed for an answer, each of them a sentence of words/texts.toml."""

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
    OF_A_LOAD = auto()
    OF_SETTINGS = auto()
    FINER = auto()
    HOURS = auto()
    STEP_TEST = auto()
    LOAD_IN_MANUAL = auto()
    TUNING_IN_MANUAL = auto()
    AS_TOLD = auto()


@dataclass(frozen=True, slots=True)
class Requirement:
    """What a record lacks, None where it is an error that ended the loop; what it needs, and the figures of that."""

    lack: MissingData | None
    need: RequirementKind
    figures: Figures = ()

    def __str__(self) -> str:
        """What it needs and what it has, in words."""
        return sentences("needs")[self.need].format(*self.figures)


class LacksError(NotAssessedError):
    """A question cannot be answered from a record, and it is known what the record lacks."""

    def __init__(self, needs: Requirement) -> None:
        self.needs = needs
        super().__init__(str(needs))

    def __reduce__(self) -> tuple[type[LacksError], tuple[Requirement]]:
        """How it travels between processes: by what it was made of."""
        return type(self), (self.needs,)


def counts(oscillating_pct: float | None) -> bool:
    """Whether a loop that oscillates for so much of the time [%] counts as oscillating."""
    return oscillating_pct is not None and oscillating_pct >= COUNTS_PCT


def decided_fault(row: Mapping[str, object] | None) -> Fault | None:
    """What a night's row says of the valve; None where there is no row, or the loop was not assessed."""
    told = None if row is None or row["status"] != Status.OK else row.get("valve_fault")
    return None if told is None else Fault(str(told))


@dataclass(frozen=True, slots=True)
class Sign:
    """One sign: which cause it points to, how strongly (0 to 1), what it shows, and the figures and loops that say
    so, as words/reason.py takes them."""

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
    lacking: Requirement | None = None
    lack: MissingData | None = None
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
