"""Limits of what trials of the valve, turn by turn of OP, and the size and form of the cycles say about a cause."""

from __future__ import annotations

from dataclasses import dataclass

from tuning.declare import limit

UNTIDY = "ours: tests/proofs/untidy.py and tests/proofs/negative_controls.py"


@dataclass(frozen=True, slots=True)
class TrialLimits:
    """When trials, sizes and forms of cycles speak for a cause or against it."""

    plain_size: float = limit(
        0.2,
        "-",
        (0.0, 1.0),
        "The same where nearly every stretch between OP's turns shows it",
        "ours: integrating processes under PI of little damping cycle with a play of 0.2 to 0.35 of OP's range",
    )
    plain_agreeing: float = limit(
        0.95,
        "-",
        (0.0, 1.0),
        "Share of the stretches that this takes",
        "ours: loads and neighbours, on simulated plants, show it in 0.9 at most",
    )
    plain_steadiness: float = limit(
        12.5,
        "-",
        (0.0, 125.0),
        "Mean gain of the stretches over its standard error that this takes",
        "ours: loads and neighbours, on simulated plants, have 9.5 at most, such valves 20 and more",
    )
    steadiness: float = limit(
        2.5,
        "-",
        (0.0, 25.0),
        "Mean gain of the trials over its standard error from which they agree: chance in fewer "
        "than one of 100",
        UNTIDY,
    )
    grid_steps: float = limit(
        3.0,
        "-",
        (0.0, 100.0),
        "Steps of PV's grid that a stickband must move PV by: a grid holds PV still for one of them",
        UNTIDY,
    )
    denied: float = limit(
        1.5,
        "-",
        (0.0, 15.0),
        "Steadiness below which, with fewer than `agreeing` in favour, the trials deny the fault",
        UNTIDY,
    )
    agreeing: float = limit(
        0.6,
        "-",
        (0.0, 1.0),
        "Share of the trials that must show the fault",
        UNTIDY,
    )
    trial_size: float = limit(
        0.2,
        "-",
        (0.0, 10.0),
        "Stickband over OP's range from which agreeing trials show a fault",
        "ours: between 0.2 and 0.25 tests/proofs/untidy.py shows no difference",
    )
    trial_evidence: float = limit(
        25.0,
        "nat",
        (0.0, 250.0),
        "Evidence that this takes",
        UNTIDY,
    )
    trial_kurtosis: float = limit(
        1.8,
        "-",
        (0.0, 18.0),
        "Kurtosis at the period that it takes: what repeats itself exactly lets any model explain it",
        UNTIDY,
    )
    trial_harmonic: float = limit(
        0.3,
        "-",
        (0.0, 10.0),
        "Locked third harmonic that it allows; a square load has 1/3",
        UNTIDY,
    )
    edged: float = limit(
        0.15,
        "-",
        (0.0, 10.0),
        "Locked third harmonic from which a wave is none of a linear loop; a triangle has 0.11",
        UNTIDY,
    )
    same_process: float = limit(
        0.75,
        "-",
        (0.0, 10.0),
        "Gain outside the period's band over gain with it below which two processes are seen; ours:"
        " loops that their tuning swings have 0.79 and more, those with a load 0.6 to 1",
        UNTIDY,
    )
    clock_kurtosis: float = limit(
        2.6,
        "-",
        (0.0, 26.0),
        "Kurtosis above which a period is none of a machine, however narrow",
        UNTIDY,
    )
    trial_gain: float = limit(
        5.0,
        "nat",
        (0.0, 50.0),
        "Gain of a trial that is plain by itself, asked, or repeated_steadiness, where every cycle repeats the last",
        UNTIDY
        + "; at twice both limits half of the loads taken for valves go, and the sample mill's TIC2106 with them",
    )
    repeated_steadiness: float = limit(
        7.5,
        "-",
        (0.0, 75.0),
        "Steadiness that is plain where every cycle repeats the last",
        UNTIDY + "; see trial_gain",
    )
    kept_size: float = limit(
        1.7,
        "-",
        (0.0, 17.0),
        "Kurtosis at the period up to which the size is kept; a sine has 1.5, noise 3",
        UNTIDY,
    )
    kept_size_clock: float = limit(
        1.9,
        "-",
        (0.0, 19.0),
        "The same where the period is kept as by a clock",
        UNTIDY,
    )
    kept_size_trade: float = limit(
        0.15,
        "-",
        (0.0, 10.0),
        "Added to it for each independent size that the record would hold",
        UNTIDY,
    )
    kept_size_most: float = limit(
        2.15,
        "-",
        (0.0, 21.5),
        "Kurtosis up to which the size is kept however long the record",
        UNTIDY,
    )
