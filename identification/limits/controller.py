"""Limits of whether the stated controller gives OP from SP and PV."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit


@dataclass(frozen=True, slots=True)
class ControllerLimits:
    """Whether the stated controller gives OP from SP and PV: settings, clock, gap and logic."""

    span_samples: int = limit(
        40, "-", (4, 1000000), "Fewest samples in a span of the controller's regression", "ours"
    )
    spans: int = limit(12, "-", (2, 1000), "Fewest spans in it", "ours")
    filter_leaves: float = limit(
        0.9,
        "-",
        (0.0, 1.0),
        "Residual with a filter before the controller, in terms of that without, from which it is believed",
        "ours",
    )
    late: float = limit(
        1.4,
        "samples",
        (0.0, 1e3),
        "Lateness of PV's clock from which it is named",
        "ours: jitter and filters stay under 0.8",
    )
    setting: float = limit(
        0.055,
        "-",
        (0.0, 10.0),
        "Logarithm of found over stated setting from which it is named",
        "ours: sound loops stay under 0.03",
    )
    law_explains: float = limit(
        0.9, "-", (0.0, 1.0), "Share of OP that a law has to give before its settings are believed", "ours"
    )
    law_gives: float = limit(
        0.5,
        "-",
        (0.0, 1.0),
        "Share of OP's motion within all spans that it has to give where no settings are stated",
        "ours: where a script holds OP still any law gives most spans",
    )
    same_law: float = limit(
        1.15,
        "-",
        (1.0, 1e3),
        "Times the residual of the law found that the stated law may leave in the median span and still be believed",
        "ours",
    )
    gap_leaves: float = limit(
        0.8,
        "-",
        (0.0, 1.0),
        "Residual of the median span under the best gap, in terms of that without one, from which a gap is named",
        "ours",
    )
    frozen: float = limit(
        0.55, "-", (0.0, 1.0), "Share of due moves of OP that do not happen within a gap", "ours"
    )
    frozen_moves: int = limit(25, "-", (1, 1000000), "Due moves within a gap before one is named", "ours")
    stuck_run: int = limit(
        20,
        "samples",
        (2, 1000000),
        "Length of a constant OP that a law would have moved before it counts as ruled by logic",
        "ours",
    )
    stuck_move: float = limit(
        6.0, "steps", (0.0, 1e6), "Moves missed in such a run, of OP's resolution", "ours"
    )
    stuck_share: float = limit(
        0.006, "-", (0.0, 1.0), "Share of the record in such runs from which logic is named", "ours"
    )
    lawless: float = limit(
        5.0,
        "-",
        (1.0, 1e6),
        "Residual of a span, in medians of all spans (plus a step of OP), from which the law does not hold there",
        "ours",
    )
    lawless_share: float = limit(
        0.03,
        "-",
        (0.0, 1.0),
        "Share of the record in such spans from which logic is named",
        "ours: gaps and single outliers stay under it",
    )
    asked: float = limit(
        0.5,
        "% PV",
        (0.0, 100.0),
        "Move of SP within a sample from which the kick of OP, not the law, is seen",
        "ours: ramps are slower",
    )
    thinned: float = limit(
        1.5, "scans", (1.0, 1e6), "Scans per sample from which a recording is thinned", "ours"
    )
    thinned_leaves: float = limit(
        0.1,
        "-",
        (0.0, 1.0),
        "Share of OP's variance that stated settings may leave on a thinned recording",
        "ours: the sum of a few values of a noisy error is not its integral, and a Kp a third off leaves that much",
    )
    setting_thinned: float = limit(
        0.3,
        "-",
        (0.0, 10.0),
        "setting on thinned recordings: values of PV that were not kept moved OP, which biases a found law",
        "ours: at ten scans a sample sound loops of the sample mill reach 0.26",
    )
    thinned_ti: float = limit(
        4.0,
        "samples",
        (0.0, 1e6),
        "Integral time from which the law is judged on a thinned recording",
        "ours: under it found settings of sound loops are off by up to half",
    )
    feedback: float = limit(
        0.15,
        "-",
        (0.0, 1.0),
        "Share of OP's moves that PV tells from which it answers PV",
        "ours: of six laboratory experiments the largest is .10, by a multisine that PV remembers",
    )
    by_hand: float = limit(
        0.05,
        "-",
        (0.0, 1.0),
        "Share of samples at which OP moves up to which a hand or a script moves it, in a loop that cycles",
        "ours: staircases move at one sample in 200",
    )
