"""An effect of the catalogue, whole: what it frees in the model, how it is proven, drawn and said.

A file of the catalogue takes all that it declares an effect with from here.
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

__all__ = ["Act", "Block", "Effect", "Ends", "Estimate", "Fault", "Finding", "Floats", "Friction"]
__all__ += ["Param", "Parameters", "Recording", "Signal", "Slot", "Start", "Variant"]
__all__ += ["each", "exact", "own_slot", "within"]
Parameters = Mapping[str, Estimate]


class Block(StrEnum):
    """Where in the loop an effect sits."""

    RECORDER = "recorder"
    SENSOR = "sensor"
    CONTROLLER = "controller"
    VALVE = "valve"
    PROCESS = "process"
    LOAD = "load"
    NONE = "none"


class Friction(StrEnum):
    """What an effect has to do with the search for a sticking valve."""

    PLAY = "play"
    """Its best fit is where the fine scan of stick-slip begins."""
    STICKS = "sticks"
    """It is scanned finely where a hint is found."""
    HINT = "hint"
    """A gain of it is a hint that a valve sticks."""


class Ends(StrEnum):
    """What a finding about the recorder leaves to be asked."""

    ALL = "all"
    """Neither controller nor physics is judged after it."""
    SMALLER = "smaller"
    """Both are judged; an effect smaller than what the finding leaves is not told."""
    NOTHING = "nothing"
    """Both are judged."""


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect that a plain loop lacks.

    name, block : as answered, contract; sentence : what a shift supervisor reads, with the parameters in braces;
    check : what to look at; caption : what its picture shows, where the picture's kind does not say it; tests : for
    each name that it can be taken for, the experiment or signal that tells the two apart; indistinguishable : names
    that the same data would bear as well; types : loop types that can have it, any where empty or the type is not
    known; needs : see Variant; variants : how it may act; timed : bound to a time, so that nothing follows for data
    held out; local : its gain may lie in one part of the recording; friction : see Friction; derived : further
    numbers from its parameters; spoken : names in the sentence that stand for the first of several parameters; titles
    : what pages call numbers that no Param has; acts : what it does to a signal of the loop in its own file, where
    the simulator has no lines for it; curve : its picture.
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
        """What pages call each of its numbers; nothing for those that another number stands for."""
        params = [p for v in self.variants for p in v.params if p.title or p.hidden]
        return {p.name: "" if p.hidden else p.title for p in params} | dict(self.titles)


@dataclass(frozen=True, slots=True)
class Fault(Effect):
    """An effect of recorder or controller: it is found in the trends themselves, before any physics is fitted.

    order : place among the questions; find : the finding in a recording, None of what the controller's check finds
    (check.py); ends : what is asked after it; censors : whether samples where it is tell no more than that PV is
    beyond; numbers : what is answered of a finding in a recording; drawn : its picture, from the finding, the
    recording and the plain model's PV.
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
    """An estimate that is known within a share of itself."""
    return exact(value, unit, share * abs(value))
