"""Definition of a loop model: parameters, each with one index and a neutral value, and the additions of an effect:
its free parameters, their starts, and its own acts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum

import numpy as np

from identification.record import Floats

Start = Mapping[int, float]
KNOTS = 12
"""Knots of a slow supply; ours: they follow a change over a twelfth of the record, but not loop dynamics."""
STEPS = 3
"""Largest number of load steps in one model."""


class Slot(IntEnum):
    """Index of a constant. Seconds, % of span; gains % PV / % OP."""

    T = 0
    L = 1
    K = 2
    BIAS = 3
    START = 4
    STICKBAND = 5
    JUMP = 6
    COAST = 7
    RATE = 8
    STOP_HI = 9
    STOP_LO = 10
    BEND = 11
    SERVO = 12
    DAMPING = 13
    DEADBAND = 14
    SPLIT = 15
    RATIO = 16
    SPLIT_DEAD = 17
    SPLIT_LAG = 18
    T2 = 19
    SHARE = 20
    MODE_T = 21
    ASYMMETRY = 22
    SLOPE = 23
    ROOT = 24
    CAP = 25
    LEAK = 26
    PIPE = 27
    DRIFT = 28
    CLIP_HI = 29
    CLIP_LO = 30
    SINE = 31
    COSINE = 32
    OMEGA = 33
    NEIGHBOUR = 34
    NEIGHBOUR_T = 35
    HEAD_BIAS = 36
    T3 = 37
    STEP = 38
    GAIN_SLOPE = 41
    SPEED = 42
    PLACE = 43
    UPPER_CAP = 44
    PASSED = 45
    BEGUN = 46
    RECALL = 47
    RECALL_T = 48
    SWITCH = 49
    SWITCH_AT = 50
    SWITCH_BAND = 51
    RETURNED = 52
    RETURNS_S = 53
    STEM_T = 54
    HEAD = 55


SIZE = int(Slot.HEAD) + KNOTS
_OWN: dict[str, float] = {}
"""Parameters defined by effects, by name, with their neutral values; their indices follow those of Slot."""


def own_slot(name: str, neutral_value: float = 0.0) -> int:
    """An index for a parameter that no kernel uses, but an effect's own act.

    name : its name in saved models, upper case, unique; neutral_value : its value at which the effect does not act.
    """
    if name in Slot.__members__ or name in _OWN:
        raise ValueError(f"a parameter {name} is there already; expected a name of its own; choose another")
    _OWN[name] = neutral_value
    return SIZE + len(_OWN) - 1


def places() -> dict[str, int]:
    """Name and index of every parameter; of an array the first index."""
    return {s.name: int(s) for s in Slot} | {name: SIZE + i for i, name in enumerate(_OWN)}


def neutral() -> Floats:
    """Parameters of the baseline model, shape (SIZE + own,): unit gain and a time constant of one second."""
    c = np.concatenate((np.zeros(SIZE), np.fromiter(_OWN.values(), dtype=np.float64)))
    c[Slot.T], c[Slot.K], c[Slot.LEAK], c[Slot.RATIO] = 1.0, 1.0, 1.0, 1.0
    c[Slot.COAST] = -1.0
    c[Slot.MODE_T], c[Slot.NEIGHBOUR_T], c[Slot.OMEGA], c[Slot.RECALL_T] = 1.0, 1.0, 1.0, 1.0
    c[Slot.DAMPING] = 0.5
    for slot in (Slot.RATE, Slot.STOP_HI, Slot.SPLIT, Slot.CAP, Slot.UPPER_CAP, Slot.CLIP_HI):
        c[slot] = math.inf
    for slot in (Slot.STOP_LO, Slot.CLIP_LO):
        c[slot] = -math.inf
    return c


def alone(c: Floats, slots: Iterable[int]) -> Floats:
    """Some of a model's parameters, shape (SIZE + own,), with all others neutral."""
    out, kept = neutral(), list(slots)
    out[kept] = c[kept]
    return out


@dataclass(frozen=True, slots=True)
class Param:
    """A free parameter of an effect.

    slot : its index among the model's parameters; name, unit : as in the answer; low, high : bounds in its own unit,
    times the scale named by `scale` (scales() in prediction_error.py); log : searched by its logarithm; title : its
    name on pages, its name where empty; hidden : whether another number, derived from it, is shown instead.
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
    """One form of an effect, as a candidate: its parameters, and starts in units of their scales.

    delays : parameters whose start is subtracted from the dead time, which replaced them in the baseline model;
    replaces : baseline parameters that lose their meaning; fixed : parameters set, not searched; needs : requirement
    of the recording, or of the model, before it is tried (steps, line, neighbour, every scan of the controller,
    experiment, moves); modes : candidate time constants of a second mode, relative to that of the baseline model, and
    the share of its gain; label : distinguishes variants; penalty : added to that of the parameters; enter : converts
    the baseline parameters, in place, if they change their meaning; opponent : the unnamed load that it must
    outperform in an experiment; linear : the parameter on which PV depends linearly, None for most: its start follows
    from those of the others.
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

    def set_in(self, c: Floats) -> Floats:
        """A model's parameters, shape (SIZE + own,), with the fixed ones set."""
        out = c.copy()
        for slot, value in self.fixed.items():
            out[slot] = value
        return out


def each(slot: int, *values: float) -> tuple[Start, ...]:
    """Starts that differ in one parameter."""
    return tuple({int(slot): v} for v in values)


class Signal(StrEnum):
    """The signal changed by an act, in the order of the loop."""

    OP = "op"
    FLOW = "flow"
    PV = "pv"


@dataclass(frozen=True, slots=True)
class Act:
    """A simulation step defined by an effect.

    slot : the parameter without which it has no effect; neutral : its value then; signal : the signal that it
    changes; work : that signal, shape (n,) [% of span], from the signal, the model's parameters and the sample
    interval [s]. PV is given as its deviation from the level that counts as zero.
    """

    slot: int
    neutral: float
    signal: Signal
    work: Callable[[Floats, Floats, float], Floats]


_ACTS: list[Act] = []


def bring(acts: tuple[Act, ...]) -> None:
    """Register acts in the simulator; the catalogue does so when it is read."""
    _ACTS.extend(acts)


def acting(c: Floats) -> bool:
    """Whether any act is active in a model."""
    return any(act.slot < c.size and c[act.slot] != act.neutral for act in _ACTS)


def acted(signal: Signal, x: Floats, c: Floats, dt_s: float) -> Floats:
    """The signal, shape (n,), after every act on it with a parameter that is not neutral."""
    for act in _ACTS:
        if act.signal is signal and act.slot < c.size and c[act.slot] != act.neutral:
            x = act.work(x, c, dt_s)
    return x
