"""What the analysis decides, as values that programs test; sentences about them are for people alone.

The values are those of the store and of `triage rank`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum, auto

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
COUNTS_PCT = 50.0
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


class Lack(StrEnum):
    """What a record lacks for an answer."""

    PV = "PV"
    SAMPLES = "samples"
    READABLE = "readable values"
    AUTOMATIC = "time in automatic"
    OP = "OP"
    MOVING_OP = "moving OP"
    OP_RANGE = "OP's range"
    OP_OFF_LIMITS = "OP off its limits"
    UNCOMPRESSED = "uncompressed trends"
    UNBROKEN = "unbroken samples"
    FASTER = "faster samples"
    FINER = "finer values"
    LONGER = "longer record"
    MANUAL_TEST = "some periods in manual"


class Need(StrEnum):
    """What is needed for an answer, each of them a sentence of words/needs.py."""

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
    MODEL = auto()
    OF_A_CYCLE = auto()
    UNFOLDED = auto()
    OF_A_LOAD = auto()
    OF_SETTINGS = auto()
    FINER = auto()
    HOURS = auto()
    LONGER = auto()
    LOAD_IN_MANUAL = auto()
    TUNING_IN_MANUAL = auto()
    AS_TOLD = auto()


@dataclass(frozen=True, slots=True)
class Needs:
    """What a record lacks, None where it is an error that ended the loop; what it needs, and the figures of that."""

    lack: Lack | None
    need: Need
    figures: Figures = ()

    def __str__(self) -> str:
        """What it needs and what it has, in words."""
        from analyzer.words.needs import said  # which tells what stands here

        return said(self)


class LacksError(NotAssessedError):
    """A question cannot be answered from a record, and it is known what the record lacks."""

    def __init__(self, needs: Needs) -> None:
        self.needs = needs
        super().__init__(str(needs))

    def __reduce__(self) -> tuple[type[LacksError], tuple[Needs]]:
        """How it travels between processes: by what it was made of."""
        return type(self), (self.needs,)


def counts(oscillating_pct: float | None) -> bool:
    """Whether a loop that oscillates for so much of the time [%] counts as oscillating."""
    return oscillating_pct is not None and oscillating_pct >= COUNTS_PCT
