"""Limits of the cause; what its signs weigh is a table of its own (analyzer/loop/cause_weights.py)."""

from __future__ import annotations

from dataclasses import dataclass

from analyzer.limits.calm_loop import CalmLoopLimits
from identification.limits.declare import limit

CHOSEN = (
    "ours: chosen on tests/untidy (seeds 5 to 7), tests/coupled and ../shared/wild, which prove nothing of it; "
    "proved on other seeds (tests/proofs/untidy.py)"
)
UNTIDY = "ours: tests/proofs/untidy.py and tests/proofs/negative_controls.py"
BESIDE = (
    "ours: of the loads of tests/proofs/cause_weights.py, its folders and untidy draws 1502500 to 1504499 18 of 708 "
    "are told no more, and 15 of 61 valves called loads; with noise of a tenth to two thirds of the cycle 4 of 142, "
    "and 5 of 35"
)
STUDY = "ours: tests/proofs/negative_controls.py and the healthy loops of a simulated plant"


@dataclass(frozen=True, slots=True)
class CauseLimits(CalmLoopLimits):
    """When a cause is named."""

    judged: int = limit(
        60,
        "blocks",
        (10, 100000),
        "Blocks that follow on as many good ones as the noise model looks back, that a fit needs",
        "ours: six for each constant fitted",
    )
    window: int = limit(
        1800,
        "blocks",
        (200, 100000),
        "Blocks of the record that are fitted; more cost time and change no verdict",
        STUDY,
    )
    blocks_per_period: float = limit(
        30.0,
        "-",
        (4.0, 1000.0),
        "Blocks per period",
        STUDY,
    )
    fast_process: tuple[tuple[str, float, float], ...] = limit(
        (("flow", 60.0, 30.0),),
        "type, s, s",
        (0.0, 1000000.0),
        "Types with largest time constant and dead time of loops whose process is fast: a longer wait is "
        "the valve's",
        "a flow answers its valve within seconds (Seborg, Edgar, Mellichamp 2011, ch. 12)",
    )
    evidence: float = limit(
        10.0,
        "nat",
        (0.0, 1000000.0),
        "Gain in log likelihood that a play needs over an ideal valve",
        STUDY,
    )
    evidence_unexcited: float = limit(
        20.0,
        "nat",
        (0.0, 1000000.0),
        "The same in a loop that neither oscillates nor has its set point moved: OP then moves for the "
        "load alone, and what moves with the load tells little of the valve",
        STUDY,
    )
    evidence_per_sample: float = limit(
        0.005,
        "nat",
        (0.0, 1.0),
        "The same for each sample judged: no model is exact, and what it lacks grows with them",
        STUDY,
    )
    quiet_factor: float = limit(
        2.5,
        "-",
        (0.0, 100.0),
        "What the share is multiplied with in loops that do not oscillate",
        STUDY,
    )
    hopeless: float = limit(
        0.4,
        "-",
        (0.0, 1.0),
        "Share of the evidence needed below which, in a loop that does not oscillate, a first look at a few "
        "plays ends the search for a valve's fault",
        "ours: of 122 such loops (untidy, seeds 60300 to 60499) the whole search added 6.7 nat at most, where "
        "10 to 22 are needed",
    )
    evidence_jump: float = limit(
        5.0,
        "nat",
        (0.0, 1000000.0),
        "Further gain that a slip jump needs, for its two more constants and wider search",
        STUDY,
    )
    moves: int = limit(
        3,
        "-",
        (0, 1000),
        "How often the stem must set out: one or two moves can be steps of the load as well, unless the "
        "set point called for them",
        "ours",
    )
    few_moves: int = limit(
        6,
        "-",
        (0, 1000),
        "Moves of a stem in a loop that does not oscillate below which they need quiet_factor times the evidence, "
        "unless the set point called for them",
        "ours: ramps with a step in noise had 34 to 39 nat with three; of 42 valves told without a cycle (untidy, "
        "wild, recorded) one has so few and so little",
    )
    jump_share: float = limit(
        0.04,
        "-",
        (0.0, 1.0),
        "Gain of the jump over that of the play from which the fault is stiction",
        STUDY,
    )
    least_jump: float = limit(
        0.08,
        "-",
        (0.0, 1.0),
        "Slip jump over stickband below which the fault is a play",
        STUDY,
    )
    beside_pct: float = limit(
        80.0,
        "%",
        (0.0, 100.0),
        "Confidence below which no load is told where a play in the valve shows all the same",
        BESIDE,
    )
    beside_share: float = limit(
        0.2,
        "-",
        (0.0, 10.0),
        "Part of the evidence that such a play would bring in such a recording, `evidence` added to it, from which "
        "it shows",
        BESIDE,
    )
    beside_agreeing: float = limit(
        0.6,
        "-",
        (0.5, 1.0),
        "Share of the stretches between OP's turns that agree on it",
        BESIDE,
    )
    samples_told: float = limit(
        8.0,
        "-",
        (2.0, 1000.0),
        "Samples a cycle below which no load is told: what is fast in a valve's cycle or a resonance is not seen",
        "ours: of 36 loads told with 8 to 10 on untidy loops (seeds 1500000 to 1504499) 31 are, of 46 with 3 to 8 36",
    )
    steps_told: float = limit(
        3.0,
        "-",
        (0.0, 1000.0),
        "Steps of PV's grid in an amplitude below which no load is told",
        "ours: at 2.5 steps a play is called a load (tests/proofs/recorded.md)",
    )
    steps_tuning: float = limit(
        1.0,
        "-",
        (0.0, 1000.0),
        "The same for tuning",
        "ours: all of 17 told with 1 to 3 steps on untidy loops (seeds 1500000 to 1504499) are; below it only one is "
        "told",
    )
    wound_pct: float = limit(
        20.0,
        "% of span",
        (1.0, 100.0),
        "Travel of OP without any answer of PV from which the valve is dead",
        STUDY,
    )
    least_size: float = limit(
        0.2,
        "-",
        (0.0, 1.0),
        "Stickband over the range of OP below which the valve is not named in a loop that cycles",
        "ours: integrating processes under PI of little damping cycle with a play of 0.2 to 0.35 of OP's range",
    )
    small_size: float = limit(
        0.35,
        "-",
        (0.0, 1.0),
        "The same below which it must be likelier, small_pct",
        "ours: a neighbour's cycle through a free valve looks like a play of up to a third of OP's range",
    )
    small_pct: float = limit(
        78.0,
        "%",
        (0.0, 100.0),
        "Confidence from which a valve with so small a stickband is named",
        "ours: loops that a tank with play feeds reach 73, plays of tests/analyzer/test_small_play.py 79 and more",
    )
    changing_pct: float = limit(
        65.0,
        "%",
        (0.0, 100.0),
        "The same where the cycle changes its size, as none does that a machine brings",
        CHOSEN,
    )
    changing: float = limit(
        1.7,
        "-",
        (0.0, 17.0),
        "Kurtosis at the period from which the size changes; a sine has 1.5, noise 3",
        CHOSEN,
    )
    square: float = limit(
        0.15,
        "-",
        (0.0, 10.0),
        "Locked third harmonic above which a small stickband is never named: a square has 1/3, a triangle 1/9",
        CHOSEN,
    )
    valve_pct: float = limit(
        55.0,
        "%",
        (0.0, 100.0),
        "The same for the valve, for one that is blamed is taken out",
        CHOSEN + "; at 60 one of four sticking valves of ../shared/recordings/isdb is undecided",
    )
    compressed_pct: float = limit(
        80.0,
        "%",
        (0.0, 100.0),
        "The same for the valve where trends are compressed",
        "ours: straight segments of PV and OP make a likely valve of a load (of 30 cycles of another cause on seeds "
        "60100 to 64599 of tests/untidy 2 above 55 %, none above 77 %; 8 of 11 valves are above 80 %)",
    )
    named_pct: float = limit(
        50.0,
        "%",
        (0.0, 100.0),
        "Confidence from which a cause is named",
        STUDY,
    )
    signs: int = limit(
        2,
        "-",
        (1, 10),
        "Independent signs that a named cause needs",
        STUDY,
    )
    grid_steps: float = limit(
        3.0,
        "-",
        (0.0, 100.0),
        "Steps of PV's grid that a stickband must move PV by: a grid holds PV still for one of them",
        UNTIDY,
    )

    def needed(self, count: int, excited: bool, oscillating: bool) -> float:
        """Evidence that a valve's fault needs [nat]: a floor, and a share of the samples judged, for no model is
        exact."""
        per_sample = self.evidence_per_sample * (1.0 if oscillating else self.quiet_factor)
        least = self.evidence if excited or oscillating else self.evidence_unexcited
        return max(least, per_sample * count)
