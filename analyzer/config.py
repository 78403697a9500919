"""The limits of a run together, section by section as `triage config` prints them."""

from __future__ import annotations

from dataclasses import dataclass, field

from analyzer.limits.advice import AdviceLimits, SettingsLimits
from analyzer.limits.cause import CauseLimits
from analyzer.limits.comparison import ChangeLimits, ComparisonLimits
from analyzer.limits.figures import FigureLimits, NightLimits, WorkerLimits
from analyzer.limits.lanes import LaneLimits
from analyzer.limits.oscillation import OscillationLimits
from analyzer.limits.plant import PlantLimits
from analyzer.limits.quality import QualityLimits
from identification.limits.controller import ControllerLimits
from identification.limits.explain import ExplainLimits
from identification.limits.proof import ProofLimits
from identification.limits.recorder import RecorderLimits
from identification.limits.search import SearchLimits
from tuning.limits import TuningLimits

__all__ = [
    "AdviceLimits",
    "CauseLimits",
    "ChangeLimits",
    "ComparisonLimits",
    "Config",
    "ControllerLimits",
    "FigureLimits",
    "LaneLimits",
    "NightLimits",
    "OscillationLimits",
    "PlantLimits",
    "ProofLimits",
    "QualityLimits",
    "RecorderLimits",
    "SearchLimits",
    "SettingsLimits",
    "TuningLimits",
    "WorkerLimits",
]


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
