"""Limits of the cause; what trials of the valve and the size of cycles say has a file of its own."""

from __future__ import annotations

from dataclasses import dataclass

from analyzer.limits.trials import UNTIDY, TrialLimits
from tuning.declare import limit

STUDY = "ours: tests/proofs/negative_controls.py and the healthy loops of a simulated plant"


@dataclass(frozen=True, slots=True)
class CauseLimits(TrialLimits):
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
    evidence_jump: float = limit(
        5.0,
        "nat",
        (0.0, 1000000.0),
        "Further gain that a slip jump needs, for its two more constants and wider search",
        STUDY,
    )
    open_size: float = limit(
        0.35,
        "-",
        (0.0, 1.0),
        "Stickband over the range of OP from which it can drive a cycle where simulation of the "
        "identified loop shows that it does",
        "ours: below it a loop that a neighbour swings passes the simulation too, for its feedback was "
        "identified with the rest",
    )
    moves: int = limit(
        3,
        "-",
        (0, 1000),
        "How often the stem must set out: one or two moves can be steps of the load as well, unless the "
        "set point called for them",
        "ours",
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
    consistent: float = limit(
        0.35,
        "-",
        (0.0, 1.0),
        "Gain outside the period's band over gain with it, from which both see one process",
        STUDY,
    )
    samples_told: float = limit(
        10.0,
        "-",
        (2.0, 1000.0),
        "Samples a cycle below which no load is told: what is fast in a valve's cycle or a resonance is not seen",
        "ours: below it 9 of 22 loads told on untidy loops are none (tests/proofs/recorded.md)",
    )
    steps_told: float = limit(
        3.0,
        "-",
        (0.0, 1000.0),
        "Steps of PV's grid in an amplitude below which neither load nor tuning is told",
        "ours: at 2.5 steps a play is called a load (tests/proofs/recorded.md)",
    )
    wound_pct: float = limit(
        20.0,
        "% of span",
        (1.0, 100.0),
        "Travel of OP without any answer of PV from which the valve is dead",
        STUDY,
    )
    size: float = limit(
        0.45,
        "-",
        (0.0, 1.0),
        "Stickband over the range of OP from which it can drive a cycle",
        "below it the describing function of play is within 15 degrees of a gain",
    )
    line: float = limit(
        6.0,
        "-",
        (1.0, 1000.0),
        "Prominence of the reconstructed load's spectrum at the period from which the load itself oscillates",
        STUDY,
    )
    resonance: float = limit(
        2.0,
        "-",
        (1.0, 100.0),
        "Amplification of load by the loop at its period, |S|, from which the tuning is to blame",
        "Ms of 2 is the usual upper bound of good tuning (Astrom, Hagglund 2006)",
    )
    narrow: float = limit(
        0.93,
        "-",
        (0.0, 1.0),
        "Correlation after three periods from which the frequency is constant",
        STUDY,
    )
    fairly_narrow: float = limit(
        0.85,
        "-",
        (0.0, 1.0),
        "The same where it also exceeds by steadier what the identified resonance would give",
        STUDY,
    )
    steadier: float = limit(
        0.3,
        "-",
        (0.0, 1.0),
        "The same above what the loop's own resonance would give",
        "ours: the scatter over 50 periods is 0.1",
    )
    at_limits: float = limit(
        0.02,
        "-",
        (0.0, 1.0),
        "Share of time at a limit of OP from which a loop may run from limit to limit",
        STUDY,
    )
    left: float = limit(
        0.75,
        "-",
        (0.0, 100.0),
        "Prominence of the load that a valve model leaves over that of the error, from which it explains "
        "nothing",
        STUDY,
    )
    harmonic: float = limit(
        0.08,
        "-",
        (0.0, 1.0),
        "Phase-locked third harmonic over the fundamental from which a wave is not a sine; a triangle has 0.11",
        STUDY,
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
    left_of_load: float = limit(
        0.5,
        "-",
        (0.0, 10.0),
        "The same over that of the load that an ideal valve leaves, below which it explains something",
        UNTIDY,
    )
