"""The limits that no plant changes: limits.toml states them beside those of a run (analyzer/config.py)."""

from __future__ import annotations

from identification.limits import Limits


class WaveLimits(Limits, section="waves"):
    """What is kept of a loop's waves and moves, and when those of two loops can be compared: alike in all nights."""


class LoopLimits(Limits, section="loop"):
    """How the record of one loop is read, and which of its signs are told."""


WAVES, LOOP = WaveLimits(), LoopLimits()
