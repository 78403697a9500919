"""Limits of what is called an oscillation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from identification.limits.declare import limit

STUDY = (
    "ours: tests/proofs/negative_controls.py and tests/proofs/sensitivity.py, false alarms at most 0.5 % "
    "in each family"
)

UNTIDY = "ours: tests/proofs/untidy.py and tests/proofs/negative_controls.py"


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
        0.3,
        "-",
        (0.0, 1.0),
        "The loop oscillates where the envelope exceeds this share of its own upper level",
        STUDY,
    )
    samples_few: float = limit(
        3.0,
        "-",
        (0.0, 30.0),
        "Samples per period from which halves that come back plainly (shape_correlation_few) are a cycle",
        UNTIDY,
    )
    shape: float = limit(
        1.4,
        "-",
        (0.0, 14.0),
        "Prominence in doublings and shape_trade times the levelled correlation, added, of a cycle "
        "that is regular only in shape; with shape_few above all of 1,500 noises of "
        "tests/proofs/nulls and 265 healthy untidy loops",
        UNTIDY,
    )
    shape_few: float = limit(
        12.5,
        "-",
        (0.0, 125.0),
        "Added to shape, over the square root of the cycles: the scatter of both signs in noise",
        UNTIDY,
    )
    shape_least: float = limit(
        3.6,
        "-",
        (0.0, 36.0),
        "What they must add up to at least: a well tuned loop resonates a little however long it is watched",
        UNTIDY,
    )
    shape_trade: float = limit(
        4.0,
        "-",
        (0.0, 40.0),
        "Doublings of the prominence that a levelled correlation of 1 is worth",
        UNTIDY,
    )
    shape_correlation: float = limit(
        0.08,
        "-",
        (0.0, 1.0),
        "Levelled correlation that no prominence makes up for",
        UNTIDY,
    )
    shape_correlation_few: float = limit(
        0.45,
        "-",
        (0.0, 10.0),
        "The same with fewer than `samples` a period: beside the edge of the spectrum every noise stands out",
        UNTIDY,
    )
    shape_prominence: float = limit(
        3.0,
        "-",
        (0.0, 30.0),
        "Prominence from which a peak is looked at for its shape",
        UNTIDY,
    )
    swing: float = limit(
        1.75,
        "-",
        (0.0, 17.5),
        "As shape, with swing_trade times what the kurtosis of the wide band lacks to 3 added; of "
        "squares with halves of half to twice their length a quarter is found without it, four "
        "fifths with it",
        UNTIDY,
    )
    swing_trade: float = limit(
        2.0,
        "-",
        (0.0, 20.0),
        "Doublings of the prominence that a kurtosis less by 1 is worth",
        UNTIDY,
    )
    swing_least: float = limit(
        4.6,
        "-",
        (0.0, 46.0),
        "What they must add up to at least",
        UNTIDY,
    )
    swing_cycles: float = limit(
        7.0,
        "-",
        (0.0, 70.0),
        "Cycles from which a kurtosis tells anything",
        UNTIDY,
    )
    swing_spread: float = limit(
        0.62,
        "-",
        (0.0, 10.0),
        "Standard deviation of the logarithm of the halves' lengths at most; halves from half to "
        "twice have 0.4, what flips at random 1.28",
        UNTIDY,
    )
    swing_share: float = limit(
        0.3,
        "-",
        (0.0, 1.0),
        "Share of the record's variance, drift included, in the wide band at least",
        UNTIDY,
    )
    near: float = limit(
        2.5,
        "doublings",
        (0.0, 10.0),
        "How far short of the evidence of its shape a cycle may fall that counts where PV convicts the valve of "
        "making it",
        "ours: of 209 untidy loops that do not oscillate though their cause shows (seeds 1500000 to 1504999) it "
        "convicts 44 valves, all of them at fault, and none of 1,920 healthy loops; at 3 six more",
    )
    near_share: float = limit(
        0.1,
        "-",
        (0.0, 1.0),
        "Share of the error's variance that such a cycle has at least",
        "ours: as near",
    )
    near_prominence: float = limit(
        2.0,
        "-",
        (1.0, 100.0),
        "Prominence from which such a cycle is looked at; at 3 a third of them is missed",
        "ours: as near",
    )

    def nearly(self) -> OscillationLimits:
        """The limits of a cycle that another sign must confirm: half-cycles need not be like one another, for a valve
        slips when OP has come far enough, whatever the time."""
        asked = ("shape", "shape_least", "swing", "swing_least")
        return replace(
            self,
            **{name: getattr(self, name) - self.near for name in asked},
            shape_prominence=self.near_prominence,
            share=self.near_share,
            shape_correlation=-1.0,
            swing_cycles=self.periods,
            swing_spread=math.inf,
            swing_share=0.0,
        )

    programme_moves: float = limit(
        0.5,
        "-",
        (0.0, 1.0),
        "Share of the samples in which the set point moves up to which a cycle must be seen where it rests",
        "ours: a master's output moves in nearly all, a programme's in less than half",
    )
    rest_stretches: int = limit(
        6,
        "-",
        (1, 1000),
        "Stretches of a period in which the set point has rested from which they tell whether a cycle lasts",
        "ours: three periods, as an oscillation needs",
    )
    moved_cycles: float = limit(
        0.5,
        "-",
        (0.0, 100.0),
        "Moves of the set point a cycle from which, without such stretches, the cycle is the set point's",
        "ours: steps up and down each hour and a half leave a slow loop that answers them a cycle of 47 min",
    )
    rest_share: float = limit(
        0.5,
        "-",
        (0.0, 1.0),
        "Amplitude at rest over that of the cycle below which it is the set point's response",
        "ours: of 13 batch loops of an hour's programme (healthy and tight) it is 0.01 to 0.3, of loops with a limit "
        "cycle 0.9 and more",
    )
