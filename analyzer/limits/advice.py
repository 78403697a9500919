"""Limits of settings and advice."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit

STUDY = (
    "ours: set on simulated loops whose settings are stated truly (none called), proved on others "
    "(tests/proofs/settings.py)"
)


@dataclass(frozen=True, slots=True)
class SettingsLimits:
    """When the settings that OP follows are not the stated ones."""

    explained: float = limit(
        0.4,
        "-",
        (0.0, 1.0),
        "Share of the variance of OP's increments that the recovered settings must explain",
        STUDY,
    )
    gain: float = limit(
        0.04,
        "-",
        (0.0, 1.0),
        "Share that they must explain beyond the stated ones",
        STUDY,
    )
    left: float = limit(
        2.0,
        "-",
        (1.0, 1000.0),
        "What the stated ones leave unexplained over what the recovered ones leave",
        STUDY,
    )
    factor: float = limit(
        1.3,
        "-",
        (1.0, 1000.0),
        "Factor between stated and recovered gain, or integral time, from which they are others; sampling "
        "every tenth of a period takes off 10 %",
        STUDY,
    )
    straight_share: float = limit(
        0.3,
        "-",
        (0.0, 1.0),
        "Share of samples on straight segments from which a compressed trend does not tell the control law",
        STUDY,
    )
    ti_samples: float = limit(
        4.0,
        "samples",
        (1.0, 1000.0),
        "Integral time that can be recovered: within fewer, OP moves between the samples",
        STUDY,
    )


@dataclass(frozen=True, slots=True)
class AdviceLimits:
    """What new settings and firm verdicts rest on at least."""

    least_h: float = limit(
        2.0,
        "h",
        (0.0, 1000.0),
        "Good hours in automatic that new settings need",
        "ours: the load of less than that is not the plant's",
    )
    hint_pct: float = limit(
        75.0,
        "%",
        (0.0, 100.0),
        "Confidence at most in a cause that rests on fewer hours",
        "ours",
    )
    cycle_per_ti: float = limit(
        4.0,
        "-",
        (0.1, 1000.0),
        "Period of a PI loop's cycle over its integral time, for what a sampling must be able to show",
        "1 to 7 on the study's and the sample mill's loops",
    )
    longest_share: float = limit(
        0.1,
        "-",
        (0.0, 1.0),
        "Largest time constant, as a share of the window, at which it counts as known",
        "ours: beyond it a lag and an integrator explain the record alike",
    )
    most_factor: float = limit(
        2.0,
        "-",
        (1.0, 1000.0),
        "Largest factor from the time constant to its 90 % limits at which it counts as known",
        "ours: beyond it a lag and an integrator explain the record alike",
    )
    beyond_record: float = limit(
        0.25,
        "-",
        (0.0, 1.0),
        "Dead time over the length of the window from which the record does not support the model",
        "ours: four dead times hold no answer and its aftermath twice",
    )
