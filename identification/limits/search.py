"""Limits of the search for what a plain loop leaves unexplained. Gains are of log likelihood [nat]."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit


@dataclass(frozen=True, slots=True)
class SearchLimits:
    """Which effects explain a recording: what one has to gain, and how far candidates are followed."""

    parameter_penalty: float = limit(
        3.0,
        "nat",
        (0.0, 1e3),
        "Gain that one more constant has to bring",
        "ours: half of log(n) would be 4.5, chance brings a half",
    )
    hidden_penalty: float = limit(
        1.0,
        "nat",
        (0.0, 1e3),
        "The same in an experiment, of a constant not told by itself: a knot of a course, where a record began",
        "Akaike 1974: what chance brings on average",
    )
    search_penalty: float = limit(
        6.0,
        "nat",
        (0.0, 1e3),
        "Gain that the choice among some forty candidates and their starts costs",
        "ours: the largest of forty by chance",
    )
    rounds: int = limit(3, "-", (1, 10), "Effects named at most", "ours: a record seldom tells more")
    followed: int = limit(
        6,
        "-",
        (1, 100),
        "Candidates that are followed to the end from several starts",
        "ours: bounds the time",
    )
    screen_steps: int = limit(
        5, "-", (1, 1000), "Gauss-Newton steps in the first round", "ours: bounds the time"
    )
    full_steps: int = limit(
        20, "-", (1, 1000), "Gauss-Newton steps of the candidates that are followed", "ours: bounds the time"
    )
    settled: float = limit(0.025, "nat", (0.0, 10.0), "Gain of a step below which the descent ends", "ours")
    promises: float = limit(
        5.0,
        "-",
        (0.0, 1e6),
        "Times what its next step promises that a candidate of the first round may lack of what is worth following, "
        "else it ends",
        "ours: of 2,727 descents on 40 cases of another seed two would have come there, of valves that are scanned "
        "anyway",
    )
    worth_following: float = limit(
        -6.0,
        "nat",
        (-1e3, 1e3),
        "Gain less its price from which a candidate of the first round is followed",
        "ours: of 242 below it on the same cases one came to anything, 0.6",
    )
    may_come_to: float = limit(
        0.5,
        "-",
        (0.0, 1.0),
        "Share of what a candidate has to come to from which it is followed, where that is known",
        "ours: 83 sealed cases and seven rigs are answered as where all are followed",
    )
    tie: float = limit(
        2.0,
        "nat",
        (0.0, 1e3),
        "Candidates within this gain of the winner cannot be told from it and are its alternatives",
        "ours: odds of seven to one",
    )
    same: float = limit(
        1.0,
        "nat",
        (0.0, 1e3),
        "Gain that a model may lack beside one with a constant more and still count as good as that",
        "ours: twice what chance brings",
    )
    sticking_hint: float = limit(
        6.0,
        "nat",
        (0.0, 1e6),
        "Gain of a play, or of a sticking valve started coarsely, from which stiction is scanned finely",
        "ours: bounds the time",
    )
    settles: float = limit(
        0.1,
        "-",
        (0.0, 10.0),
        "Share of the record that a time constant may take if the loop is to be seen to settle",
        "ours",
    )
    start_scatter: float = limit(
        1.0,
        "% PV",
        (1e-3, 1e3),
        "Standard deviation of the model's first value about the recorded one, which short time constants need",
        "ours",
    )
    bias_scatter: float = limit(
        20.0, "% PV", (1e-3, 1e4), "Standard deviation of the model's bias about the record's mean", "ours"
    )
    ceiling_penalty: float = limit(
        22.5,
        "nat",
        (0.0, 1e4),
        "Gain beyond half the number of its weights that the flexible model needs over the last fit before something "
        "is said to be left",
        "ours: with nothing hidden the largest of thirty was 18",
    )
    ceiling_share: float = limit(
        0.3,
        "-",
        (0.0, 10.0),
        "The same in terms of what the named effects gain: a name stands if little is left beside it",
        "ours",
    )
    experiment_samples: int = limit(
        4000,
        "-",
        (100, 10000000),
        "Samples of an experiment beyond which it is judged at a coarser step, where its time constant bears it",
        "ours: bounds the time",
    )
    samples_a_lag: float = limit(
        5.0,
        "-",
        (1.0, 1e4),
        "Samples that a time constant and dead time keep at the coarser step",
        "ours: OP's mean drives a step exactly, and a move is placed to a tenth of the lag",
    )
