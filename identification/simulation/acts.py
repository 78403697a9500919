"""What effects do to a signal of the loop in their own files, where no kernel knows of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from identification.record import Floats


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
