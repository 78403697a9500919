"""The limits of a run together, section by section as `triage config` prints them; limits.toml states the values."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from identification.limits import (
    TOML,
    ControllerLimits,
    ExplainLimits,
    ProofLimits,
    RecorderLimits,
    SearchLimits,
    stated_in,
)
from tuning.limits import TuningLimits


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "oscillation")
class OscillationLimits:
    """When a peak of the spectrum is an oscillation."""

    periods: float = TOML
    prominence: float = TOML
    prominence_few: float = TOML
    correlation: float = TOML
    correlation_few: float = TOML
    correlation_most: float = TOML
    trade: float = TOML
    least: float = TOML
    share: float = TOML
    samples: float = TOML
    envelope: float = TOML
    samples_few: float = TOML
    shape: float = TOML
    shape_few: float = TOML
    shape_least: float = TOML
    shape_trade: float = TOML
    shape_correlation: float = TOML
    shape_correlation_few: float = TOML
    shape_prominence: float = TOML
    swing: float = TOML
    swing_trade: float = TOML
    swing_least: float = TOML
    swing_cycles: float = TOML
    swing_spread: float = TOML
    swing_share: float = TOML
    near: float = TOML
    near_share: float = TOML
    near_prominence: float = TOML
    programme_moves: float = TOML
    rest_stretches: int = TOML
    moved_cycles: float = TOML
    rest_share: float = TOML

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


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "quality")
class QualityLimits:
    """When samples or trends are unfit."""

    gap_factor: float = TOML
    usable_share: float = TOML
    samples: int = TOML
    run_samples: int = TOML
    run_share: float = TOML
    unread_share: float = TOML
    ticks_per_sample: float = TOML
    stale_s: float = TOML
    stale_samples: int = TOML
    straight_share: float = TOML
    archived_points: float = TOML
    limit_pct: float = TOML
    on_limit_pct: float = TOML
    resting_share: float = TOML
    outside_pct: float = TOML
    saturated_share: float = TOML
    manual_s: float = TOML
    manual_samples: int = TOML
    automatic_share: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "cause")
class CauseLimits:
    """When a cause is named."""

    near_evidence: float = TOML
    near_size: float = TOML
    near_pct: float = TOML
    size: float = TOML
    grid_covered: float = TOML
    judged: int = TOML
    window: int = TOML
    blocks_per_period: float = TOML
    fast_process: tuple[tuple[str, float, float], ...] = TOML
    evidence: float = TOML
    evidence_unexcited: float = TOML
    evidence_per_sample: float = TOML
    quiet_factor: float = TOML
    hopeless: float = TOML
    steady: float = TOML
    steady_alone: float = TOML
    plain_width: float = TOML
    evidence_jump: float = TOML
    moves: int = TOML
    few_moves: int = TOML
    jump_share: float = TOML
    least_jump: float = TOML
    beside_pct: float = TOML
    beside_share: float = TOML
    beside_agreeing: float = TOML
    samples_told: float = TOML
    steps_told: float = TOML
    steps_tuning: float = TOML
    wound_pct: float = TOML
    least_size: float = TOML
    small_size: float = TOML
    small_pct: float = TOML
    changing_pct: float = TOML
    changing: float = TOML
    square: float = TOML
    valve_pct: float = TOML
    compressed_pct: float = TOML
    named_pct: float = TOML
    signs: int = TOML
    grid_steps: float = TOML
    noise_widths: float = TOML

    def needed(self, count: int, excited: bool, oscillating: bool) -> float:
        """Evidence that a valve's fault needs [nat]: a floor, and a share of the samples judged, for no model is
        exact."""
        per_sample = self.evidence_per_sample * (1.0 if oscillating else self.quiet_factor)
        least = self.evidence if excited or oscillating else self.evidence_unexcited
        return max(least, per_sample * count)


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "plant")
class PlantLimits:
    """When loops share an oscillation, and where it starts."""

    waves: int = TOML
    weak_prominence: float = TOML
    locked_harmonic: float = TOML
    over_chance: float = TOML
    chance: float = TOML
    chance_in_step: float = TOML
    over_chance_in_step: float = TOML
    drift_in_step: float = TOML
    lost: float = TOML
    lost_to_noise: float = TOML
    hints: int = TOML
    hint_prominence: float = TOML
    coherent: float = TOML
    follow_cycles: float = TOML
    same_period: float = TOML
    foresight: float = TOML
    near_period: float = TOML
    drift: float = TOML
    follower_most_pct: float = TOML
    follower_sign: float = TOML
    sign_valve: float = TOML
    sign_best_valve: float = TOML
    sign_tuning: float = TOML
    sign_oscillates: float = TOML
    sign_first: float = TOML
    sign_foresees: float = TOML
    sign_central: float = TOML
    sign_clear: float = TOML
    sign_share: float = TOML
    sign_nonlinear: float = TOML
    unseen_pct: float = TOML
    unseen_beside_valve_pct: float = TOML
    source_pct: float = TOML
    weak_share: float = TOML
    sure_pct: float = TOML
    linked: float = TOML
    in_ratio: float = TOML
    cascade_period: float = TOML
    halves_apart: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "settings")
class SettingsLimits:
    """When the settings that OP follows are not the stated ones."""

    explained: float = TOML
    gain: float = TOML
    left: float = TOML
    factor: float = TOML
    straight_share: float = TOML
    ti_samples: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "advice")
class AdviceLimits:
    """What new settings and firm verdicts rest on at least."""

    least_h: float = TOML
    hint_pct: float = TOML
    cycle_per_ti: float = TOML
    longest_share: float = TOML
    most_factor: float = TOML
    beyond_record: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "figures")
class FigureLimits:
    """What the assessments of a span leave out."""

    travel_grid_s: float = TOML
    travel_deadband_pct: float = TOML
    small_error_pct: float = TOML
    least_share: float = TOML
    move_noise: float = TOML
    move_spread: float = TOML
    move_stands: int = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "lanes")
class LaneLimits:
    """From where on a loop stands in a lane."""

    manual_pct: float = TOML
    at_limits_pct: float = TOML
    lasting_error_pct: float = TOML
    hour_share: float = TOML
    frozen_pct: float = TOML
    error_memory_ti: float = TOML
    small_gain_memory_ti: float = TOML
    small_gain_room: float = TOML
    at_set_point: float = TOML
    noise: float = TOML
    straight_share: float = TOML
    travel_pct_per_h: float = TOML
    winds_up_pct: float = TOML
    programme: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "nights")
class NightLimits:
    """How an export becomes nights, and which of two records of a loop is kept."""

    whole_h: float = TOML
    least_piece_h: float = TOML
    most: int = TOML
    fuller_share: float = TOML
    fuller_h: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "belief")
class BeliefLimits:
    """What nights together say of a loop, and from when on it is told."""

    half_life: float = TOML
    doubt: float = TOML
    doubt_alone: float = TOML
    doubt_small: float = TOML
    doubt_beside: float = TOML
    doubt_against: float = TOML
    small: float = TOML
    conviction: float = TOML
    most: float = TOML
    worn_before: float = TOML
    worn_pct: float = TOML
    still_worn_pct: float = TOML
    beside_pct: float = TOML
    change: float = TOML
    recent: int = TOML
    least_deviation: float = TOML
    between: float = TOML
    named_pct: float = TOML
    held_pct: float = TOML
    comes_back: float = TOML
    dies_away: float = TOML
    seldom_pct: float = TOML
    calmed: float = TOML
    another_size: float = TOML
    confirmed: int = TOML
    vote_lead: float = TOML
    recorder: float = TOML
    advised_share: float = TOML
    pairs: int = TOML
    settle_nights: int = TOML
    settle_ratio: float = TOML
    remembered: int = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "wear")
class WearLimits:
    """When a valve wears, and how far that is carried on."""

    nights: int = TOML
    growing_nights: int = TOML
    least_deviation: float = TOML
    scale: float = TOML
    sure: float = TOML
    least_growth: float = TOML
    ahead_d: float = TOML
    size: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "before_after")
class ComparisonLimits:
    """When the spans before and after a change can be compared, and how sure a verdict is."""

    confidence: float = TOML
    least_days: float = TOML
    usable_share: float = TOML
    least_pct: float = TOML
    modest_pct: float = TOML
    set_point_pct: float = TOML
    load_pct: float = TOML
    sp_travel_ratio: float = TOML
    sp_travel_floor: float = TOML
    mode_points: float = TOML
    limit_points: float = TOML
    source_share: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "changes")
class ChangeLimits:
    """When a change of a controller that nobody stated is offered."""

    least_days: float = TOML
    least_step: float = TOML
    least_ratio: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("analyzer", "workers")
class WorkerLimits:
    """What one loop may cost before it is given up, so that the night goes on."""

    memory_mb: float = TOML
    processor_s: float = TOML
    wall_s: float = TOML


@dataclass(frozen=True, slots=True)
class Config:
    """All limits of a run.

    opening : what finding out about an export may cost, which reads its clocks and tags once; ours: ten times what
    3 GB of text take. Memory ends where the machine's does, and that ends this process alone.
    """

    oscillation: OscillationLimits = field(default_factory=OscillationLimits)
    quality: QualityLimits = field(default_factory=QualityLimits)
    cause: CauseLimits = field(default_factory=CauseLimits)
    plant: PlantLimits = field(default_factory=PlantLimits)
    settings: SettingsLimits = field(default_factory=SettingsLimits)
    advice: AdviceLimits = field(default_factory=AdviceLimits)
    tuning: TuningLimits = field(default_factory=TuningLimits)
    figures: FigureLimits = field(default_factory=FigureLimits)
    lanes: LaneLimits = field(default_factory=LaneLimits)
    nights: NightLimits = field(default_factory=NightLimits)
    belief: BeliefLimits = field(default_factory=BeliefLimits)
    wear: WearLimits = field(default_factory=WearLimits)
    before_after: ComparisonLimits = field(default_factory=ComparisonLimits)
    changes: ChangeLimits = field(default_factory=ChangeLimits)
    explain_recorder: RecorderLimits = field(default_factory=RecorderLimits)
    explain_controller: ControllerLimits = field(default_factory=ControllerLimits)
    explain_search: SearchLimits = field(default_factory=SearchLimits)
    explain_proof: ProofLimits = field(default_factory=ProofLimits)
    workers: WorkerLimits = field(default_factory=WorkerLimits)
    opening: WorkerLimits = field(default_factory=lambda: WorkerLimits(65_536.0, 60.0, 360.0))

    @property
    def explain(self) -> ExplainLimits:
        """What decides about the explanation of one recording."""
        return ExplainLimits(
            self.explain_recorder, self.explain_controller, self.explain_search, self.explain_proof
        )
