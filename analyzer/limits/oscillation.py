"""Limits of what is called an oscillation."""

from __future__ import annotations

from dataclasses import dataclass

from tuning.declare import limit

STUDY = (
    "ours: tests/proofs/negative_controls.py and tests/proofs/sensitivity.py, false alarms at most 0.5 % "
    "in each family"
)


@dataclass(frozen=True, slots=True)
class OscillationLimits:
    """When a peak of the spectrum is an oscillation."""

    periods: float = limit(
        3.0,
        "-",
        (1.0, 100.0),
        "Periods that a record must hold; below it neither peak nor correlation can be told from drift",
        STUDY,
    )
    prominence: float = limit(
        8.0,
        "-",
        (1.0, 1000.0),
        "Power in the peak over the power that its surroundings lead to expect; coloured noise through a "
        "well tuned loop reaches 4",
        STUDY,
    )
    prominence_few: float = limit(
        8.0,
        "-",
        (0.0, 1000.0),
        "Added to the prominence times (6 - periods)/3 for records of fewer than 6 periods",
        STUDY,
    )
    correlation: float = limit(
        0.25,
        "-",
        (0.0, 1.0),
        "First peak of the autocorrelation about the period; the published rhythm of loops that show is 0.3",
        STUDY,
    )
    correlation_few: float = limit(
        1.5,
        "-",
        (0.0, 10.0),
        "Added to the correlation, over the square root of the periods seen: the scatter of noise",
        STUDY,
    )
    correlation_most: float = limit(
        0.7,
        "-",
        (0.0, 1.0),
        "Correlation asked at most",
        STUDY,
    )
    trade: float = limit(
        0.12,
        "-",
        (0.0, 1.0),
        "Correlation that weighs as much as a doubling of the prominence: the two are independent signs "
        "of one line, noise that has much of one has little of the other, so an excess of one makes up "
        "for some of the other",
        STUDY,
    )
    least: float = limit(
        0.75,
        "-",
        (0.0, 1.0),
        "Prominence that no correlation makes up for, as a share of the asked",
        STUDY,
    )
    share: float = limit(
        0.2,
        "-",
        (0.0, 1.0),
        "Share of the error's variance, slower drift apart, within a factor of 2.5 of the period: below "
        "it something else moves the loop",
        STUDY,
    )
    samples: float = limit(
        5.0,
        "-",
        (2.2, 100.0),
        "Samples per period: below it the clock, not the loop, may make the pattern",
        STUDY,
    )
    envelope: float = limit(
        0.4,
        "-",
        (0.0, 1.0),
        "The loop oscillates where the envelope exceeds this share of its own upper level",
        STUDY,
    )
