"""The limits that no plant changes: in limits.toml together with those of a run (analyzer/config.py)."""

from __future__ import annotations

from identification.limits import Limits


class HistoryLimits(Limits, section="history"):
    """Reading of exports: recognition of columns, clocks and names, and limits of size."""


class FinderLimits(Limits, section="finder"):
    """Criteria of the data for a loop found among tags (analyzer/finder)."""


class WaveLimits(Limits, section="waves"):
    """Stored oscillations and moves of a loop, and comparability of two loops: the same in all nights."""


class LoopLimits(Limits, section="loop"):
    """Reading of one loop's record, and which of its signs are reported."""


class ExplainingLimits(Limits, section="explain"):
    """Which part of a recording is explained, and which models are tried."""


class StoreLimits(Limits, section="store"):
    """When another run on a store is active, and when its leftovers are dead."""


class ClusterLimits(Limits, section="cluster"):
    """How long a run waits for a cluster."""


class StorageLimits(Limits, section="storage"):
    """How long shared storage may fail."""


class PageLimits(Limits, section="pages"):
    """Amount of information on pages."""


HISTORY, FINDER, WAVES, LOOP = HistoryLimits(), FinderLimits(), WaveLimits(), LoopLimits()
EXPLAIN, STORE, PAGES = ExplainingLimits(), StoreLimits(), PageLimits()
CLUSTER, STORAGE = ClusterLimits(), StorageLimits()
