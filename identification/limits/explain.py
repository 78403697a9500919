"""All limits of explaining one recording together."""

from __future__ import annotations

from dataclasses import dataclass, field

from identification.limits.controller import ControllerLimits
from identification.limits.proof import ProofLimits
from identification.limits.recorder import RecorderLimits
from identification.limits.search import SearchLimits


@dataclass(frozen=True, slots=True)
class ExplainLimits:
    """What decides about recorder, controller, effects and their proof."""

    recorder: RecorderLimits = field(default_factory=RecorderLimits)
    controller: ControllerLimits = field(default_factory=ControllerLimits)
    search: SearchLimits = field(default_factory=SearchLimits)
    proof: ProofLimits = field(default_factory=ProofLimits)


LIMITS = ExplainLimits()
"""The limits where none are given."""
