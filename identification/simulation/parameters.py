"""The parameters of the loop model that every candidate shares: one place each, neutral unless freed."""

from __future__ import annotations

import math
from collections.abc import Iterable
from enum import IntEnum

import numpy as np

from identification.record import Floats

KNOTS = 12
"""Knots of a slow supply; ours: a wander of a twelfth of the record is followed, loop dynamics are not."""
STEPS = 3
"""Load steps that one model may hold."""


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
"""Parameters that effects bring along, by name, with their neutral values; their places follow those of Slot."""


def own_slot(name: str, neutral_value: float = 0.0) -> int:
    """A place for a parameter that no kernel knows, which an effect's own act reads.

    name : its name in saved models, upper case, other than any in use; neutral_value : its value where the effect
    does not act.
    """
    if name in Slot.__members__ or name in _OWN:
        raise ValueError(f"a parameter {name} is there already; expected a name of its own; choose another")
    _OWN[name] = neutral_value
    return SIZE + len(_OWN) - 1


def places() -> dict[str, int]:
    """Name and place of every parameter, those in a row by their first."""
    return {s.name: int(s) for s in Slot} | {name: SIZE + i for i, name in enumerate(_OWN)}


def neutral() -> Floats:
    """Parameters of the plain loop, shape (SIZE + own,): unit gain and a time constant of one second."""
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
    """Some of a model's parameters, shape (SIZE + own,), all others neutral."""
    out, kept = neutral(), list(slots)
    out[kept] = c[kept]
    return out
