"""Every threshold of the nightly batch, with unit and source, in one place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class OscillationLimits:
    """When a peak of the spectrum is an oscillation.

    Where no source is named the value is ours, set by tests/proofs/negative_controls.py (false alarms at most
    0.5 % in each family) and tests/proofs/sensitivity.py.
    """

    periods: float = 3.0
    """Periods that a record must hold [-]; below it neither peak nor correlation can be told from drift."""
    prominence: float = 8.0
    """Power in the peak over the power that its surroundings lead to expect [-]; coloured noise through a well
    tuned loop reaches 4."""
    prominence_few: float = 8.0
    """Added to the prominence [-] times (6 - periods)/3 for records of fewer than 6 periods."""
    correlation: float = 0.25
    """First peak of the autocorrelation about the period [-]; the published rhythm of loops that show is 0.3."""
    correlation_few: float = 1.5
    """Added to the correlation, over the square root of the periods seen [-]: the scatter of noise."""
    correlation_most: float = 0.70
    """Correlation asked at most [-]."""
    trade: float = 0.12
    """Correlation that weighs as much as a doubling of the prominence [-]: the two are independent signs of one
    line, noise that has much of one has little of the other, so an excess of one makes up for some of the other."""
    least: float = 0.75
    """Prominence that no correlation makes up for, as a share of the asked [-]."""
    share: float = 0.2
    """Share of the error's variance, slower drift apart, within a factor of 2.5 of the period [-]: below it
    something else moves the loop."""
    samples: float = 5.0
    """Samples per period [-]: below it the clock, not the loop, may make the pattern."""
    envelope: float = 0.4
    """The loop oscillates where the envelope exceeds this share of its own upper level [-]."""


@dataclass(frozen=True, slots=True)
class QualityLimits:
    """When samples or trends are unfit."""

    gap_factor: float = 5.0
    """A gap is a spacing of more than this many sample intervals [-]; ours."""
    usable_share: float = 0.3
    """Share of usable automatic samples that an assessment needs [-]; ours."""
    samples: int = 200
    """Samples that an assessment needs [-]; ours: 3 periods of 60 samples fit into it."""
    run_samples: int = 20
    """Good samples in a row from which a run tells how PV follows OP [-]; ours: twice what the noise model sees."""
    run_share: float = 0.6
    """Share of the time that such runs must cover for a cause to be told [-]; ours: with half of a record missing in
    blocks of three periods, play passes for tight tuning."""
    unread_share: float = 0.02
    """Share of a tag's values that may be no numbers though they look like some [-]; ours: more is a way of writing
    that was not understood."""
    ticks_per_sample: float = 20.0
    """Ticks of a uniform clock per sample [-] beyond which a record is all gaps; ours: it bounds memory, and such a
    record would fail usable_share by far."""
    stale_s: float = 3600.0
    """An unchanged PV for this long [s] and for stale_samples is stale while OP moves; ours."""
    stale_samples: int = 300
    """See stale_s."""
    straight_share: float = 0.6
    """Share of samples on straight, sloping segments from which a trend is compressed [-] (Thornhill, Choudhury,
    Shah 2004 find nonlinearity tests spoilt from a compression factor of 3)."""
    coarse: float = 0.5
    """A resolution above this many standard deviations of PV is too coarse for waveforms [-]; ours."""
    limit_pct: float = 2.0
    """OP within this distance of a limit is at the limit [% of span]; FACTS: time at limits."""
    outside_pct: float = 5.0
    """OP beyond its range by this [% of span] shows that the range is not known; ours."""
    saturated_share: float = 0.6
    """Share of time at a limit of OP from which no cause is told [-]; ours: a loop that runs from limit to limit is
    there for half of it."""
    manual_s: float = 1800.0
    """OP unchanged for this long [s] and for manual_samples, while the error moves, is a loop in manual; ours."""
    manual_samples: int = 180
    """See manual_s."""


@dataclass(frozen=True, slots=True)
class CauseLimits:
    """When a cause is named.

    Where no source is named the value is ours: tests/proofs/negative_controls.py and the healthy loops of a
    simulated plant set it.
    """

    judged: int = 60
    """Blocks that follow on as many good ones as the noise model looks back, that a fit needs [-]; ours: six for each
    constant fitted."""
    window: int = 1800
    """Blocks of the record that are fitted [-]; more cost time and change no verdict."""
    blocks_per_period: float = 30.0
    """Blocks per period [-]."""
    fast_process: tuple[tuple[str, float, float], ...] = (("flow", 60.0, 30.0),)
    """Types with largest time constant and dead time [s] of loops whose process is fast: a flow answers its valve
    within seconds (Seborg, Edgar, Mellichamp 2011, ch. 12); a longer wait is the valve's."""
    evidence: float = 10.0
    """Gain in log likelihood that a play needs over an ideal valve [nat]."""
    evidence_unexcited: float = 20.0
    """The same in a loop that neither oscillates nor has its set point moved [nat]: OP then moves for the load alone,
    and what moves with the load tells little of the valve."""
    evidence_per_sample: float = 0.005
    """The same as a share of the samples judged [nat]: no model is exact, and what it lacks grows with them."""
    quiet_factor: float = 2.5
    """What the share is multiplied with in loops that do not oscillate [-]."""
    evidence_jump: float = 5.0
    """Further gain that a slip jump needs, for its two more constants and wider search [nat]."""
    open_size: float = 0.35
    """Stickband over the range of OP from which it can drive a cycle where simulation of the identified loop shows
    that it does [-]; ours: below it a loop that a neighbour swings passes the simulation too, for its feedback was
    identified with the rest."""
    moves: int = 3
    """How often the stem must set out [-]: one or two moves can be steps of the load as well, unless
    the set point called for them; ours."""
    jump_share: float = 0.04
    """Gain of the jump over that of the play from which the fault is stiction [-]."""
    least_jump: float = 0.08
    """Slip jump over stickband below which the fault is a play [-]."""
    consistent: float = 0.35
    """Gain outside the period's band over gain with it, from which both see one process [-]."""
    wound_pct: float = 20.0
    """Travel of OP without any answer of PV from which the valve is dead [% of span]."""
    size: float = 0.45
    """Stickband over the range of OP from which it can drive a cycle [-]: below it the describing function of
    play is within 15 degrees of a gain."""
    line: float = 6.0
    """Prominence of the reconstructed load's spectrum at the period from which the load itself oscillates [-]."""
    resonance: float = 2.0
    """Amplification of load by the loop at its period, |S|, from which the tuning is to blame [-]; Ms of 2 is the
    usual upper bound of good tuning (Astrom, Hagglund 2006)."""
    narrow: float = 0.93
    """Correlation after three periods from which a period is kept as by a clock [-]."""
    fairly_narrow: float = 0.85
    """The same where it also exceeds by `steadier` what the identified resonance would give [-]."""
    steadier: float = 0.3
    """The same above what the loop's own resonance would give [-]; ours: the scatter over 50 periods is 0.1."""
    at_limits: float = 0.02
    """Share of time at a limit of OP from which a loop may run from limit to limit [-]."""
    left: float = 0.75
    """Prominence of the load that a valve model leaves over that of the error, from which it explains nothing."""
    harmonic: float = 0.08
    """Phase-locked third harmonic over the fundamental from which a wave is not a sine [-]; a triangle has 0.11."""
    named_pct: float = 50.0
    """Confidence from which a cause is named [%]."""
    signs: int = 2
    """Independent signs that a named cause needs [-]."""
    coherent: float = 0.6
    """Coherence at the period from which one loop follows another [-]."""
    follows: float = 0.8
    """Coherence from which even a loop whose own valve seems at fault follows another [-]; ours."""
    outweighs: float = 4.0
    """Evidence of the other valve over its own from which it does [-]; ours."""
    one_wave: float = 0.98
    """Coherence from which two loops share one wave, so that the valve with more evidence leads [-]; ours."""
    outweighs_wave: float = 1.5
    """Evidence of the other valve over its own from which it leads then [-]; ours."""
    follow_cycles: float = 30.0
    """Periods that a record must hold for loops to be told apart from others that happen to cycle alike [-]; ours: in
    fewer, periods a few percent apart are coherent."""
    same_period: float = 0.06
    """Largest relative difference of periods that count as one [-]."""
    follower_most_pct: float = 25.0
    """Confidence at most in a follower's own valve or tuning [%]; ours: what they show comes from the source."""
    follower_sign: float = 0.9
    """Strength of the sign that a loop follows another [-]; ours: as strong as a valve's that is dead."""


@dataclass(frozen=True, slots=True)
class SettingsLimits:
    """When the settings that OP follows are not the stated ones.

    Ours: set on simulated loops whose settings are stated truly (none called), proved on others of another make
    (tests/proofs/settings.py).
    """

    explained: float = 0.4
    """Share of the variance of OP's increments that the recovered settings must explain [-]."""
    gain: float = 0.04
    """Share that they must explain beyond the stated ones [-]."""
    left: float = 2.0
    """What the stated ones leave unexplained over what the recovered ones leave [-]."""
    factor: float = 1.3
    """Factor between stated and recovered gain, or integral time, from which they are others [-]; sampling every
    tenth of a period takes off 10 %."""
    straight_share: float = 0.3
    """Share of samples on straight segments from which a compressed trend does not tell the law [-]."""
    ti_samples: float = 4.0
    """Integral time that can be recovered [samples]: within fewer, OP moves between the samples."""


@dataclass(frozen=True, slots=True)
class AdviceLimits:
    """What new settings and firm verdicts rest on at least; ours."""

    least_h: float = 2.0
    """Good hours in automatic that new settings need [h]: the load of less than that is not the plant's."""
    hint_pct: float = 75.0
    """Confidence at most in a cause that rests on fewer hours [%]."""
    cycle_per_ti: float = 4.0
    """Period of a PI loop's cycle over its integral time [-], for what a sampling must be able to show: 1 to 7 on the
    study's and the sample mill's loops."""


@dataclass(frozen=True, slots=True)
class WorkerLimits:
    """What one loop may cost before it is given up, so that the night goes on."""

    memory_mb: float = 4096.0
    """Memory that a worker may take beyond what it holds when it starts [MB]; ours: a day of a loop at 1 s takes 0.1,
    a text export of under 64 MB that is kept whole 0.6; what asks for more is a fault."""
    processor_s: float = 300.0
    """Processor time that one loop may take, all its nights together [s]; ours: two weeks at 1 s take 30."""
    wall_s: float = 1800.0
    """The same by the clock [s], for what hangs without computing; ours: six times, for machines are busy."""


@dataclass(frozen=True, slots=True)
class Config:
    """All thresholds of a night."""

    oscillation: OscillationLimits = OscillationLimits()
    quality: QualityLimits = QualityLimits()
    cause: CauseLimits = CauseLimits()
    settings: SettingsLimits = SettingsLimits()
    advice: AdviceLimits = AdviceLimits()
    workers: WorkerLimits = WorkerLimits()
    opening: WorkerLimits = WorkerLimits(memory_mb=65_536.0, processor_s=3600.0, wall_s=7200.0)
    """The same for finding out about an export, which reads its clocks and tags once; ours: ten times what 3 GB of
    text take. Memory ends where the machine's does, and that ends this process alone."""
