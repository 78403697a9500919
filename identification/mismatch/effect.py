"""One effect of the catalogue, complete: what it frees in the model, its proof, its picture and its texts.

A file of the catalogue imports from here all that it needs to declare an effect.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from identification.controller.check import Finding
from identification.mismatch.pictures import Drawing, Picture
from identification.mismatch.recording import Recording
from identification.models import Estimate
from identification.record import Floats
from identification.simulation.parameters import Act, Param, Signal, Slot, Start, Variant, each, own_slot

PARAMETER_PENALTY = 3.0
"""Gain that one more constant has to bring [nat]: half of log(n) would be 4.5, chance brings a half."""

SEARCH_PENALTY = 6.0
"""Gain that the choice among some forty candidates and their starts costs, or that of a load step's place
[nat]: the largest of forty by chance."""

ONE_CONSTANT = SEARCH_PENALTY + PARAMETER_PENALTY  # Required gain of an effect with one constant [nat]

TIE = 2.0
"""Candidates within this gain of the winner are indistinguishable from it and are its alternatives; a square-
root outflow, the commoner, is reported before a nonlinear gain [nat]: odds of seven to one."""

__all__ = ["Act", "Block", "Effect", "Ends", "Estimate", "Fault", "Finding", "Floats", "Friction"]
__all__ += ["Param", "Parameters", "Recording", "Signal", "Slot", "Start", "Variant"]
__all__ += ["each", "exact", "own_slot", "within"]
Parameters = Mapping[str, Estimate]


class Block(StrEnum):
    """Location of an effect in the loop."""

    RECORDER = "recorder"
    SENSOR = "sensor"
    CONTROLLER = "controller"
    VALVE = "valve"
    PROCESS = "process"
    LOAD = "load"
    NONE = "none"


class Friction(StrEnum):
    """Role of an effect in the search for a sticking valve."""

    BACKLASH = "backlash"
    """The fine scan of stick-slip starts at its best fit."""
    STICKS = "sticks"
    """It is scanned finely where a hint is found."""
    HINT = "hint"
    """A gain of it is a hint of a sticking valve."""


class Ends(StrEnum):
    """Which further tests a recorder finding allows."""

    ALL = "all"
    """Neither controller nor physics is tested after it."""
    SMALLER = "smaller"
    """Both are tested; an effect smaller than the finding's resolution is not reported."""
    NOTHING = "nothing"
    """Both are tested."""


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect that a baseline model does not include.

    name, block : as in the answer, contract; sentence : text for a shift supervisor, with the parameters in braces;
    check : what to inspect; caption : meaning of its picture, if the picture's kind does not show it; tests : for
    each name that can be confused with it, the experiment or signal that distinguishes the two; indistinguishable :
    names that fit the same data equally well; types : loop types that can have it, any if empty or if the type is
    unknown; needs : see Variant; variants : forms of the effect; timed : bound to a time, so that it predicts nothing
    for held-out data; local : its gain may be in one part of the recording; friction : see Friction; derived :
    further numbers from its parameters; spoken : names in the sentence that refer to the first of several parameters;
    titles : page titles of numbers without a Param; acts : its effect on a signal of the loop, in its own file, if
    the simulator has no code for it; curve : its picture.
    """

    name: str
    block: Block
    sentence: str
    check: str
    caption: str = ""
    tests: Mapping[str, str] = field(default_factory=dict)
    indistinguishable: tuple[str, ...] = ()
    types: tuple[str, ...] = ()
    needs: str = ""
    variants: tuple[Variant, ...] = ()
    timed: bool = False
    local: bool = False
    friction: Friction | None = None
    derived: Callable[[Parameters], dict[str, Estimate]] | None = None
    spoken: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    titles: Mapping[str, str] = field(default_factory=dict)
    acts: tuple[Act, ...] = ()
    curve: Callable[[Drawing], Picture] | None = None

    @property
    def candidates(self) -> tuple[Variant, ...]:
        """Its variants, each with the effect's name, block and needs."""
        name, block = self.name, str(self.block)
        return tuple(replace(v, needs=v.needs or self.needs, name=name, block=block) for v in self.variants)

    @property
    def called(self) -> dict[str, str]:
        """Page titles of its numbers, except those represented by another number."""
        params = [p for v in self.variants for p in v.params if p.title or p.hidden]
        return {p.name: "" if p.hidden else p.title for p in params} | dict(self.titles)


@dataclass(frozen=True, slots=True)
class Fault(Effect):
    """An effect of recorder or controller, found in the trends before any physics is fitted.

    order : position in the sequence of tests; find : the finding in a recording, None for findings of the controller
    check (check.py); ends : which tests follow; censors : whether affected samples only show that PV is beyond a
    limit; numbers : numbers reported for a finding; drawn : its picture, from the finding, the recording and the PV
    of the baseline model.
    """

    order: int = 0
    find: Callable[[Recording], Finding | None] | None = None
    ends: Ends = Ends.NOTHING
    censors: bool = False
    numbers: Callable[[Finding, Recording], dict[str, Estimate]] = lambda found, s: {}
    drawn: Callable[[Finding, Recording, Floats], Picture | None] | None = None


def exact(value: float, unit: str, half: float = 0.0) -> Estimate:
    """An estimate with a symmetric interval."""
    return Estimate(value, value - half, value + half, unit)


def within(share: float, value: float, unit: str) -> Estimate:
    """An estimate with an interval of plus or minus a share of its value."""
    return exact(value, unit, share * abs(value))
