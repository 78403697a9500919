"""The limits that no plant changes: limits.toml states them beside those of a run (analyzer/config.py)."""

from __future__ import annotations

from identification.limits import Limits


class HistoryLimits(Limits, section="history"):
    """How exports are read: what their columns, clocks and names are known by, and what is too much to read."""


class FinderLimits(Limits, section="finder"):
    """What tags must show before they are taken as a loop (analyzer/finder)."""


class WaveLimits(Limits, section="waves"):
    """What is kept of a loop's waves and moves, and when those of two loops can be compared: alike in all nights."""


class LoopLimits(Limits, section="loop"):
    """How the record of one loop is read, and which of its signs are told."""


class ExplainingLimits(Limits, section="explain"):
    """Which part of a recording is explained, and which models are tried on it."""


class StoreLimits(Limits, section="store"):
    """When another run is at work on a store, and when what it left is dead."""


class ClusterLimits(Limits, section="cluster"):
    """How long a run waits for a cluster."""


class StorageLimits(Limits, section="storage"):
    """How long shared storage may fail."""


class PageLimits(Limits, section="pages"):
    """How much pages tell."""


HISTORY, FINDER, WAVES, LOOP = HistoryLimits(), FinderLimits(), WaveLimits(), LoopLimits()
EXPLAIN, STORE, PAGES = ExplainingLimits(), StoreLimits(), PageLimits()
CLUSTER, STORAGE = ClusterLimits(), StorageLimits()
