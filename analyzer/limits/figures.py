"""Limits of figures, nights and workers."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit


@dataclass(frozen=True, slots=True)
class FigureLimits:
    """What the assessments of a span leave out."""

    travel_grid_s: float = limit(
        10.0,
        "s",
        (0.1, 3600.0),
        "Travel is summed on this grid, or on the record's own where that is coarser",
        "ours",
    )
    travel_deadband_pct: float = limit(
        0.1,
        "% of OP",
        (0.0, 10.0),
        "Moves within this band are not travel",
        "ours: the resolution of common historians and outputs",
    )
    small_error_pct: float = limit(
        5.0,
        "% of span",
        (0.0, 100.0),
        "A loop serves while the size of its error is below this",
        "the study's effective service factor",
    )
    least_share: float = limit(
        0.1,
        "-",
        (0.0, 1.0),
        "Share of an hour that must be usable for its figures",
        "ours",
    )


@dataclass(frozen=True, slots=True)
class NightLimits:
    """How an export becomes nights, and which of two records of a loop is kept."""

    whole_h: float = limit(
        36.0,
        "h",
        (1.0, 10000.0),
        "Records up to this long are one night; longer ones are cut at the plant's midnights",
        "ours",
    )
    least_piece_h: float = limit(
        6.0,
        "h",
        (0.0, 24.0),
        "A first or last piece shorter than this joins its neighbour",
        "ours",
    )
    most: int = limit(
        2000,
        "-",
        (1, 100000),
        "Nights of one run at most",
        "ours: five years of them",
    )
    fuller_share: float = limit(
        1.02,
        "-",
        (1.0, 100.0),
        "A record is fuller than another where it has this factor, and fuller_h, more of good samples",
        "ours: less is the edge of an export",
    )
    fuller_h: float = limit(
        0.1,
        "h",
        (0.0, 1000.0),
        "See fuller_share",
        "ours: less is the edge of an export",
    )


@dataclass(frozen=True, slots=True)
class WorkerLimits:
    """What one loop may cost before it is given up, so that the night goes on."""

    memory_mb: float = limit(
        4096.0,
        "MB",
        (64.0, 100000000.0),
        "Memory that a worker may take beyond what it holds when it starts",
        "ours: a day of a loop at 1 s takes 0.1, a text export of under 64 MB that is kept whole 0.6; "
        "what asks for more is a fault",
    )
    processor_s: float = limit(
        300.0,
        "s",
        (1.0, 10000000.0),
        "Processor time that one loop may take, all its nights together",
        "ours: two weeks at 1 s take 30",
    )
    wall_s: float = limit(
        1800.0,
        "s",
        (1.0, 10000000.0),
        "The same by the clock, for what hangs without computing",
        "ours: six times, for machines are busy",
    )
