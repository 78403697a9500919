"""Limits of the plant-wide pass."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit

STUDY = "ours: tests/proofs/plant_wide.py"
FITTED = "ours: conditional logit over the groups of 22 plants of tests/coupled (of seeds 200 to 244)"


@dataclass(frozen=True, slots=True)
class PlantLimits:
    """When loops share an oscillation, and where it starts."""

    waves: int = limit(
        8,
        "-",
        (1, 20),
        "Periods of a loop that are compared with those of others, at most",
        "ours: more were never shared",
    )
    weak_prominence: float = limit(
        1.5,
        "-",
        (1.0, 30.0),
        "Prominence from which a peak that is no oscillation by itself is compared with other loops",
        STUDY,
    )
    locked_harmonic: float = limit(
        0.05,
        "-",
        (0.0, 1.0),
        "Size of a locked harmonic over the fundamental from which it is compared with other loops",
        "ours: the third of a triangle has 0.11",
    )
    over_chance: float = limit(
        1.5,
        "-",
        (1.0, 10.0),
        "Coherence over the largest that shifted lines show from which it is not chance",
        STUDY,
    )
    chance: float = limit(
        1e-4,
        "-",
        (1e-9, 0.1),
        "Probability with which two loops without anything in common are as coherent as they have to be",
        "ours: a loop of a large plant is compared with some hundreds of nearly its period",
    )
    chance_in_step: float = limit(
        1e-2,
        "-",
        (1e-9, 0.1),
        "The same where they keep step so well that their periods are the same beside",
        STUDY,
    )
    over_chance_in_step: float = limit(
        3.0,
        "-",
        (1.0, 30.0),
        "Coherence over that of shifted lines that this asks for",
        STUDY,
    )
    drift_in_step: float = limit(
        0.1,
        "-",
        (0.0, 1.0),
        "Turns over the record that this asks for at most",
        STUDY,
    )
    lost: float = limit(
        0.03,
        "-",
        (0.0, 1.0),
        "Coherence that two clear parts of one wave lack at most: what wanders by itself lacks more",
        STUDY,
    )
    lost_to_noise: float = limit(
        2.2,
        "-",
        (0.0, 100.0),
        "The same in terms of the sum of both prominences' inverses",
        "ours: in nine of ten pairs of tests/proofs/plant_wide.py that share a wave it is less",
    )
    hints: int = limit(
        4,
        "-",
        (2, 100),
        "Loops with a hint of a wave that make it an oscillation where none shows it by itself",
        STUDY,
    )
    hint_prominence: float = limit(
        4.0,
        "-",
        (1.0, 30.0),
        "Prominence of such a hint",
        STUDY,
    )
    coherent: float = limit(
        0.6,
        "-",
        (0.0, 1.0),
        "Coherence at the period from which one loop follows another",
        STUDY,
    )
    follow_cycles: float = limit(
        12.0,
        "-",
        (1.0, 10000.0),
        "Periods that a record must hold for loops to be told apart from others that happen to cycle alike",
        STUDY,
    )
    same_period: float = limit(
        0.18,
        "-",
        (0.0, 0.25),
        "Largest difference of the logarithms of periods that are compared: what a loop passes on of a wandering "
        "period, or adds of its own, shifts what is read",
        STUDY,
    )
    foresight: float = limit(
        3.5,
        "-",
        (1.0, 1000.0),
        "F of Granger's test with which a loop foresees a group, in the median of its loops, to belong to it",
        "ours: three of 259 loops of nearly a group's period and without part in it reach 3",
    )
    near_period: float = limit(
        0.25,
        "-",
        (0.0, 0.5),
        "Largest difference of the logarithms of periods at which this is asked",
        STUDY,
    )
    drift: float = limit(
        0.25,
        "-",
        (0.0, 3.0),
        "Turns over the record by which the phases of two loops may drift apart that share a wave",
        STUDY,
    )
    follower_most_pct: float = limit(
        25.0,
        "%",
        (0.0, 100.0),
        "Confidence at most in a follower's own valve or tuning",
        "ours: what they show comes from the source",
    )
    follower_sign: float = limit(
        0.9,
        "-",
        (0.0, 1.0),
        "Strength of the sign that a loop follows another",
        "ours: as strong as that of a dead valve",
    )
    sign_valve: float = limit(
        2.3,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that the loop's own verdict is a valve at fault, by its evidence",
        FITTED,
    )
    sign_best_valve: float = limit(
        1.3,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that its evidence over the largest of the group",
        FITTED,
    )
    sign_tuning: float = limit(
        0.7,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that the loop's own verdict is its tuning, by its confidence",
        FITTED,
    )
    sign_oscillates: float = limit(
        0.6,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that it is seen to oscillate by itself",
        FITTED,
    )
    sign_first: float = limit(
        1.5,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that it moves before the others",
        FITTED,
    )
    sign_foresees: float = limit(
        4.5,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that its past foresees the others better than theirs foresees it",
        FITTED,
    )
    sign_central: float = limit(
        0.7,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that its coherence with the others over the largest of the group",
        FITTED,
    )
    sign_clear: float = limit(
        2.4,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that its prominence over the largest of the group, as logarithms",
        FITTED,
    )
    sign_share: float = limit(
        2.7,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that the share of its error that is the wave",
        FITTED,
    )
    sign_nonlinear: float = limit(
        1.9,
        "-",
        (-100.0, 100.0),
        "Log odds of a source for the sign that its locked harmonics over the largest of the group",
        FITTED,
    )
    unseen_pct: float = limit(
        25.0,
        "%",
        (0.0, 100.0),
        "Probability that a group starts at none of its loops, where none of them has a valve at fault",
        "ours: in 111 groups of 64 plants of tests/coupled the likeliest loop was not it in 28 %",
    )
    unseen_beside_valve_pct: float = limit(
        4.0,
        "%",
        (0.0, 100.0),
        "The same where one has",
        "ours: in 80 groups of the same plants in 4 %",
    )
    source_pct: float = limit(
        50.0,
        "%",
        (0.0, 100.0),
        "Confidence in a source from which its group follows it",
        STUDY,
    )
    weak_share: float = limit(
        0.17,
        "-",
        (0.0, 1.0),
        "Share of a loop's error that a shared wave has, from which the loop oscillates with it",
        "ours: the error's spread is then a tenth larger than without it",
    )
    sure_pct: float = limit(
        90.0,
        "%",
        (50.0, 100.0),
        "Confidence that the candidates named as a set have together",
        "ours: one answer in ten may lie outside",
    )
