"""Limits of the lanes: from where on a figure is worth a look."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit


@dataclass(frozen=True, slots=True)
class LaneLimits:
    """From where on a loop stands in a lane."""

    manual_pct: float = limit(
        10.0,
        "%",
        (0.0, 100.0),
        "Share of the good time in manual above which a loop stands in that lane",
        "ours: two and a half hours of a day",
    )
    at_limits_pct: float = limit(
        25.0,
        "%",
        (0.0, 100.0),
        "Share of the time with OP at a limit above which a loop stands in that lane",
        "ours: a quarter of a day without control",
    )
    lasting_error_pct: float = limit(
        5.0,
        "% of span",
        (0.0, 1000.0),
        "Typical hour's mean error above which it is called lasting",
        "the study's effective service factor: a loop serves within 5 %",
    )
    hour_share: float = limit(
        0.5,
        "-",
        (0.0, 1.0),
        "Share of an hour that must be good and in automatic for its mean error",
        "ours",
    )
    frozen_pct: float = limit(
        5.0,
        "%",
        (0.0, 100.0),
        "Share of the time in which PV stands while OP moves above which the measurement is called frozen",
        "ours: an hour of a day",
    )
    error_memory_ti: float = limit(
        2.5,
        "Ti",
        (0.0, 1000.0),
        "Correlation time of the error, in integral times, above which a loop is sluggish",
        "ours: Kp times gain of 1.2 and more gives 0.5 to 2.4, of 0.45 and less 2 to 12 (test_correlation_time.py)",
    )
    small_gain_memory_ti: float = limit(
        0.6,
        "Ti",
        (0.0, 1000.0),
        "Correlation time from which it is where the process bears far more gain too",
        "ours: of 10 loops at a tenth of SIMC's gain whose set point steps 0.8 to 2.8, of 10 at SIMC's own 0.2 to "
        "0.4 (test_lanes.py)",
    )
    small_gain_room: float = limit(
        4.0,
        "-",
        (1.0, 1000.0),
        "SIMC's gain over the present one from which the process bears far more",
        "ours: of the same loops 3.4 to 9, and 0.8 to 0.9",
    )
    at_set_point: float = limit(
        0.05,
        "% of span",
        (0.0, 100.0),
        "Median error up to which a loop is at its set point and not sluggish; a step of PV's grid where it is more",
        "ours: half of the accuracy of industrial transmitters, 0.1 %",
    )
    straight_share: float = limit(
        0.1,
        "-",
        (0.0, 1.0),
        "Share of PV on straight segments of compression from which nothing is called sluggish",
        "ours: compression makes noise slow",
    )
    travel_pct_per_h: float = limit(
        200.0,
        "%/h",
        (0.0, 1000000.0),
        "Valve travel above which a loop stands in that lane",
        "ours: 24 full strokes from end to end and back a day, 9,000 a year",
    )
