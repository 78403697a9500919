"""Tuning advice: describing functions, limit cycles, rules, recommendations; the names of causes and actions."""

from __future__ import annotations

from enum import StrEnum


class Cause(StrEnum):
    """Why a loop oscillates, or has a problem without an oscillation."""

    VALVE = "valve"
    TUNING = "tuning"
    LOAD = "load"
    NONE = "none"
    UNDECIDED = "undecided"


class Action(StrEnum):
    """What to do about a loop."""

    RETUNE = "retune"
    REPAIR_VALVE = "repair valve"
    SEE_SOURCE_LOOP = "see source loop"
    FIND_DISTURBANCE = "find disturbance"
    CHECK_LIMIT = "check limit"
    CHECK_SETTINGS = "check settings"
    CHECK_MEASUREMENT = "check measurement"
    NEEDS_DATA = "needs data"
    NONE = "none"
    UNDECIDED = "undecided"
