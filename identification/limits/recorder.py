"""Limits of what a recorder did to the trends."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit


@dataclass(frozen=True, slots=True)
class RecorderLimits:
    """What a recorder did to the trends before anyone saw them: lines, steps, ends, stamps."""

    straight: float = limit(
        0.3,
        "-",
        (0.0, 1.0),
        "Share of samples on straight slopes from which a trend counts as compressed",
        "ours: rounding alone leaves under 0.27",
    )
    straight_law: float = limit(
        0.1,
        "-",
        (0.0, 1.0),
        "The same from which the controller is not judged: its law acted on what was not stored",
        "ours: trends on a grid have no such lines, and a law found on drawn ones was off by half in Ti",
    )
    grid_step: float = limit(
        0.06,
        "% PV",
        (0.0, 100.0),
        "Step of values from which it is the sensor's and not the historian's",
        "ours: a historian keeps 0.05 or finer",
    )
    grid_step_of_range: float = limit(
        2.0, "% PV", (0.0, 100.0), "The same where percent is of the recorded range", "ours"
    )
    grid_mark: float = limit(
        1.0,
        "steps",
        (0.0, 1e3),
        "Standard deviation of what an effect changes in PV from which PV's grid does not hide it",
        "ours: rounding has 0.29, and healthy untidy loops with effects that are not there had 0.13",
    )
    clip_samples: int = limit(
        15, "-", (2, 1000000), "Fewest samples at one extreme that count as clipped", "ours"
    )
    clip_ratio: float = limit(
        4.0, "-", (1.0, 1e6), "Times that the extreme is commoner than each of its six neighbours", "ours"
    )
    jitter: float = limit(
        0.02,
        "samples",
        (0.0, 10.0),
        "Scatter of stamps from which it is the polling",
        "ours: logging alone scatters by 0.01",
    )
    missed: float = limit(
        1.8,
        "samples",
        (1.0, 1e3),
        "Spacing of stamps from which a sample is missing",
        "ours: polling scatters by less",
    )
    stands: float = limit(
        0.4,
        "-",
        (0.0, 1.0),
        "Share of samples at which PV stands from which it may be one that stands and jumps",
        "ours: sensors that stick by 1 to 3 % stand for 96 to 99 % of sealed cases",
    )
    jumps: int = limit(20, "-", (1, 1000000), "Moves that such a PV makes at least", "ours: fewer are steps")
    jump_steps: float = limit(
        4.0,
        "-",
        (1.0, 1e6),
        "Its least move over the steps in which it is recorded",
        "ours: sealed sensors that stick 24 to 150; none of 371 recordings of ../shared passes the three",
    )
    jump_share: float = limit(
        0.03,
        "-",
        (0.0, 1.0),
        "Its least move over PV's range",
        "ours: sealed sensors that stick .11 and more",
    )
