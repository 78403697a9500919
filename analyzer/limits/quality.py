"""Limits of what samples and trends are fit for."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit


@dataclass(frozen=True, slots=True)
class QualityLimits:
    """When samples or trends are unfit."""

    gap_factor: float = limit(
        5.0,
        "-",
        (1.5, 1000.0),
        "A gap is a spacing of more than this many sample intervals",
        "ours",
    )
    usable_share: float = limit(
        0.3,
        "-",
        (0.0, 1.0),
        "Share of usable automatic samples that an assessment needs",
        "ours",
    )
    samples: int = limit(
        200,
        "-",
        (20, 1000000),
        "Samples that an assessment needs",
        "ours: 3 periods of 60 samples fit into it",
    )
    run_samples: int = limit(
        20,
        "-",
        (2, 10000),
        "Good samples in a row from which a run tells how PV follows OP",
        "ours: twice what the noise model sees",
    )
    run_share: float = limit(
        0.6,
        "-",
        (0.0, 1.0),
        "Share of the time that such runs must cover for a cause to be told",
        "ours: with half of a record missing in blocks of three periods, play passes for tight tuning",
    )
    unread_share: float = limit(
        0.02,
        "-",
        (0.0, 1.0),
        "Share of a tag's values that may be no numbers though they look like some",
        "ours: more is a way of writing that was not understood",
    )
    ticks_per_sample: float = limit(
        20.0,
        "-",
        (1.0, 10000.0),
        "Ticks of a uniform clock per sample beyond which a record is all gaps",
        "ours: it bounds memory, and such a record would fail usable_share by far",
    )
    stale_s: float = limit(
        3600.0,
        "s",
        (1.0, 10000000.0),
        "An unchanged PV for this long and for stale_samples is stale while OP moves",
        "ours",
    )
    stale_samples: int = limit(
        300,
        "-",
        (2, 1000000),
        "See stale_s",
        "ours",
    )
    straight_share: float = limit(
        0.6,
        "-",
        (0.0, 1.0),
        "Share of samples on straight, sloping segments from which a trend is compressed",
        "Thornhill, Choudhury, Shah 2004 find nonlinearity tests spoilt from a compression factor of 3",
    )
    archived_points: float = limit(
        7.0,
        "-",
        (2.0, 1000.0),
        "Samples a cycle that compression kept, of PV and of OP, from which a cause is told from compressed trends",
        "ours: of loops of tests/untidy behind a swinging door (seeds 60100 to 64599) that many tell 34 of 42 "
        "causes right and 6 wrong; with five to seven 26 of 32 and 5, a load on four valves",
    )
    limit_pct: float = limit(
        2.0,
        "% of span",
        (0.0, 50.0),
        "OP within this distance of a limit is at the limit",
        "the study's assessment of time at limits",
    )
    on_limit_pct: float = limit(
        0.05,
        "% of span",
        (0.0, 5.0),
        "OP within this distance of a limit stands on it",
        "ours: half a step of what controllers export",
    )
    resting_share: float = limit(
        0.2,
        "-",
        (0.0, 1.0),
        "Share of the time on the limit itself from which an OP that never leaves its neighbourhood is believed",
        "ours: a closed valve rests there; what was recorded from 0 to 1 runs freely",
    )
    outside_pct: float = limit(
        5.0,
        "% of span",
        (0.0, 100.0),
        "OP beyond its range by this shows that the range is not known",
        "ours",
    )
    saturated_share: float = limit(
        0.6,
        "-",
        (0.0, 1.0),
        "Share of time at a limit of OP from which no cause is told",
        "ours: a loop that runs from limit to limit is there for half of it",
    )
    manual_s: float = limit(
        1800.0,
        "s",
        (1.0, 10000000.0),
        "OP unchanged for this long and for manual_samples, while the error moves, is a loop in manual",
        "ours",
    )
    manual_samples: int = limit(
        180,
        "-",
        (2, 1000000),
        "See manual_s",
        "ours",
    )
    automatic_share: float = limit(
        0.5,
        "-",
        (0.0, 1.0),
        "Share of the time in automatic that a stretch between long spans in manual must hold to be judged by itself",
        "ours: of shorter ones none stands for the record",
    )
