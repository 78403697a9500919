"""Limits of what is said about changes of settings."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit

STUDY = "ours: set on plants in which nothing was changed (tests/proofs/honesty.py)"


@dataclass(frozen=True, slots=True)
class ComparisonLimits:
    """When the spans before and after a change can be compared, and how sure a verdict is."""

    confidence: float = limit(
        0.95,
        "-",
        (0.5, 0.9999),
        "That none of the four (or of the others) is called better or worse where nothing changed",
        STUDY,
    )
    least_days: float = limit(
        3.0,
        "d",
        (0.1, 1000.0),
        "Usable time each side: fewer days do not show how days differ",
        STUDY,
    )
    usable_share: float = limit(
        0.5,
        "-",
        (0.0, 1.0),
        "Share of a span's hours that must be usable",
        STUDY,
    )
    least_pct: float = limit(
        3.0,
        "% of before",
        (0.0, 100.0),
        "A smaller change is not called better or worse",
        STUDY,
    )
    modest_pct: float = limit(
        15.0,
        "% of before",
        (0.0, 100.0),
        "A loop whose smallest improvement is below this is called modestly improved",
        STUDY,
    )
    set_point_pct: float = limit(
        5.0,
        "% of span",
        (0.0, 100.0),
        "Largest difference of mean SP or PV",
        STUDY,
    )
    load_pct: float = limit(
        10.0,
        "% of OP",
        (0.0, 100.0),
        "Largest difference of mean OP: the load and the valve's working point",
        STUDY,
    )
    sp_travel_ratio: float = limit(
        3.0,
        "-",
        (1.0, 1000.0),
        "Largest ratio of set point travel, where it is over sp_travel_floor",
        STUDY,
    )
    sp_travel_floor: float = limit(
        1.0,
        "% of span per h",
        (0.0, 1000.0),
        "See sp_travel_ratio",
        STUDY,
    )
    mode_points: float = limit(
        20.0,
        "points",
        (0.0, 100.0),
        "Largest difference of the share of time in automatic",
        STUDY,
    )
    limit_points: float = limit(
        10.0,
        "%",
        (0.0, 100.0),
        "Largest share of time at a limit",
        STUDY,
    )
    source_share: float = limit(
        0.5,
        "-",
        (0.0, 1.0),
        "A loop follows another one where this share of its oscillating nights names a source",
        STUDY,
    )


@dataclass(frozen=True, slots=True)
class ChangeLimits:
    """When a change of a controller that nobody stated is offered."""

    least_days: float = limit(
        3.0,
        "d",
        (1.0, 1000.0),
        "Days that must stand on each side of it",
        "ours",
    )
    least_step: float = limit(
        0.3,
        "-",
        (0.0, 10.0),
        "Smallest step of the logarithm of travel over variability",
        "ours: a third",
    )
    least_ratio: float = limit(
        4.0,
        "-",
        (0.0, 1000.0),
        "Smallest ratio of that step to the standard deviation of days within the sides",
        "ours",
    )
