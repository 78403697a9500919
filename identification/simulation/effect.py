"""What an effect adds to the loop model: parameters that it frees, starts, what it replaces, and acts of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from identification.record import Floats

Start = Mapping[int, float]


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter that an effect frees.

    slot : its place among the model's parameters; name, unit : as answered; low, high : bounds in its own unit, times
    the scale named by `scale` (scales() in prediction_error.py); log : searched by its logarithm; title : what pages
    call it, its name where empty; hidden : whether another number, derived from it, is shown in its place.
    """

    slot: int
    name: str
    unit: str
    low: float
    high: float
    scale: str = "1"
    log: bool = False
    title: str = ""
    hidden: bool = False


@dataclass(frozen=True, slots=True)
class Variant:
    """One way in which an effect may act, as a candidate: its parameters, and starts in units of their scales.

    delays : parameters whose start is taken off the dead time, which stood for them in the plain loop; replaces :
    parameters of the plain loop that the effect makes meaningless; fixed : parameters set, not searched; needs : what
    has to be in the recording, or in the model, before it can be tried (steps, line, neighbour, every scan of the
    controller, experiment, moves); types :
    loop types that can have it, any where empty or the type is not known; modes : time constants tried for a second
    mode, in that of the plain loop, and the share that its gain may have; label : told apart by; penalty : added to
    that of the parameters;
    enter : turns the plain loop's parameters, in place, where they change their meaning; opponent : what it has to
    do better than in an experiment, of no name and a part of the plain loop's load; linear : the parameter that PV
    goes with in a straight line, None of most: its start follows from those of the others.
    """

    params: tuple[Param, ...]
    starts: tuple[Start, ...]
    fixed: Start = field(default_factory=dict)
    label: str = ""
    delays: tuple[int, ...] = ()
    replaces: tuple[int, ...] = ()
    modes: tuple[float, ...] = ()
    mode_share: tuple[float, float] = (0.0, 0.0)
    penalty: float = 0.0
    enter: Callable[[Floats], None] | None = None
    opponent: Variant | None = None
    linear: int | None = None
    name: str = ""
    block: str = ""
    needs: str = ""
    types: tuple[str, ...] = ()

    def set_in(self, c: Floats) -> Floats:
        """A model's parameters, shape (SIZE + own,), with those set that are not searched."""
        out = c.copy()
        for slot, value in self.fixed.items():
            out[slot] = value
        return out


def each(slot: int, *values: float) -> tuple[Start, ...]:
    """Starts that differ in one parameter."""
    return tuple({int(slot): v} for v in values)


class Signal(StrEnum):
    """The signal that an act changes, in the order of the loop."""

    OP = "op"
    FLOW = "flow"
    PV = "pv"


@dataclass(frozen=True, slots=True)
class Act:
    """A step of the simulation that an effect brings along.

    slot : the parameter without which it does nothing; neutral : its value then; signal : what it changes; work :
    that signal, shape (n,) [% of span], from the signal, the model's parameters and the sample interval [s]. PV is
    given as its deviation from the level that counts as zero.
    """

    slot: int
    neutral: float
    signal: Signal
    work: Callable[[Floats, Floats, float], Floats]


_ACTS: list[Act] = []


def bring(acts: tuple[Act, ...]) -> None:
    """Take acts into the simulator; the catalogue does so as it is read."""
    _ACTS.extend(acts)


def acting(c: Floats) -> bool:
    """Whether any act is at work in a model."""
    return any(act.slot < c.size and c[act.slot] != act.neutral for act in _ACTS)


def acted(signal: Signal, x: Floats, c: Floats, dt_s: float) -> Floats:
    """The signal, shape (n,), after every act on it whose parameter is not neutral."""
    for act in _ACTS:
        if act.signal is signal and act.slot < c.size and c[act.slot] != act.neutral:
            x = act.work(x, c, dt_s)
    return x
