"""Limits of what is said of a valve whose loop does not oscillate, or not regularly."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit


@dataclass(frozen=True, slots=True)
class CalmLoopLimits:
    """When a valve is at fault in a loop that does not oscillate by itself."""

    near_evidence: float = limit(
        5.0,
        "nat",
        (0.0, 1000.0),
        "Gain in log likelihood of a valve's fault in a loop that does not oscillate from which the valve is asked "
        "whether it makes a cycle that is not regular",
        "ours: of 747 such loops (untidy, seeds 1502500 to 1504499) 38 have it, and 21 of the 23 that are convicted",
    )
    near_size: float = limit(
        1.0,
        "-",
        (0.0, 10.0),
        "Stickband over the range of OP beyond which it makes no such cycle: OP does not swing far enough to move it",
        "by definition; of 1,920 healthy untidy loops (seeds 1500000 to 1504999) one is convicted without it",
    )
    near_pct: float = limit(
        75.0,
        "%",
        (0.0, 100.0),
        "Confidence from which the valve is convicted of such a cycle",
        "ours: two of 24 valves convicted on untidy loops (seeds 1502000 to 1504999) are below, and so is a level "
        "whose noise swings (59 %, ../shared/recordings/refinery, 2411LIC30102-N39)",
    )
    size: float = limit(
        0.45,
        "-",
        (0.0, 1.0),
        "Stickband over the range of OP from which a valve is at fault in a loop that does not cycle",
        "below it the describing function of play is within 15 degrees of a gain",
    )
    grid_covered: float = limit(
        6.0,
        "-",
        (0.0, 100.0),
        "Steps of PV's grid that PV of a loop that does not oscillate must cover for its valve to be told",
        "ours: of seven healthy valves told on calm untidy loops (draws 1507000 to 1510999, seeds 16 to 20) four "
        "cover 1 to 5; of ten faulty ones of those draws none covers under 8",
    )
