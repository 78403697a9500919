"""A step from the observed ringing alone, without a model of the process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identification.models import Loop, Pid, Process
from tuning.frequency_response import maximum_sensitivity
from tuning.limits import LIMITS, TuningLimits
from tuning.ringing import ObservedRinging, error_ratio, from_ringing, process_of
from tuning.search import rounded

SHARES_KEPT, CALM_MS = (0.5, 0.6, 0.67, 0.75, 0.8), 7.0
"""Shares of the response at the ringing period that a first step keeps; the most robust with an error within the
limit is chosen. Maximum sensitivity of the fitted process up to which it is robust: with four fifths of the response
the integrator with dead time has 5 to 7, true plants about 3.5 (benchmarks.world, seeds 1, 2, 3, 16, 61)."""


def calmer_step(old: Pid, seen: ObservedRinging, limits: TuningLimits = LIMITS) -> Step | None:
    """The step that `recommend` takes from the ringing alone, without a model. None if no step stays
    within the allowed increase in error, or if the controller has integral action alone."""
    return calmest(old, steps(old, seen, None), limits) if old.kp else None


def calmest(old: Pid, tried: Sequence[Step], limits: TuningLimits) -> Step | None:
    """The most robust step within the allowed increase in error; among equals that of least error. Its
    gain is higher only if there is no other step."""
    within = [x for x in tried if x.error <= limits.tight_error_growth]

    def rank(x: Step) -> tuple[bool, float, float]:
        return abs(x.new.kp) > abs(old.kp), max(x.ms, limits.ms_most_sample), x.error

    return min(within, key=rank, default=None)


@dataclass(frozen=True, slots=True)
class Step:
    """Settings from the ringing alone, their maximum sensitivity on the process fitted to the ringing [-], and their
    error relative to the present one by the recorded error's spectrum [-]."""

    new: Pid
    ms: float
    error: float


def steps(old: Pid, seen: ObservedRinging, known: Process | None) -> list[Step]:
    """The steps from the ringing alone that make the fitted process robust enough."""
    process, made = known or process_of(old, seen.period_s), []
    for share in SHARES_KEPT:
        for one in from_ringing(old, seen.period_s, share):
            new = replace(one, kp=rounded(one.kp), ti_s=rounded(one.ti_s))
            ms = maximum_sensitivity(Loop(process, new))
            if ms <= CALM_MS:
                made.append(Step(new, ms, error_ratio(old, new, seen, process)))
    return made
