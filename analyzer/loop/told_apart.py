"""Whether a recording can tell the cause that is likeliest from the others that would look like it."""

from __future__ import annotations

from dataclasses import replace

from analyzer.config import CauseLimits, Config
from analyzer.loop.cause import Verdict, as_hint
from analyzer.loop.cause_measures import PLAIN
from analyzer.loop.decisions import CAUSES, OF_LOAD, Cause, Fault, Lack, Needs
from analyzer.loop.fit_for_cause import compressed
from analyzer.loop.measure import PLAYS
from analyzer.loop.oscillation import Oscillation
from analyzer.loop.quality import Prepared
from analyzer.loop.tight import sensitivity
from analyzer.words import settings as words


def told_apart(
    verdict: Verdict, prepared: Prepared, oscillation: Oscillation | None, config: Config
) -> Verdict:
    """The verdict, or none where so few samples a cycle, or so coarse a grid, make other causes look like it; where
    trends on straight segments make a likely valve of a load; where nothing but the want of other causes shows a
    load, or a valve's play shows beside it; and where the loop that is called too tight is robust."""
    if oscillation is None or verdict.cause not in CAUSES:
        return verdict
    lacking = _hides(verdict, prepared, oscillation, config)
    if lacking is None:
        return verdict
    fault = Fault.UNDECIDED if verdict.cause is Cause.VALVE else verdict.fault
    hint = as_hint(verdict, 0.9 * config.cause.named_pct)
    return replace(hint, cause=Cause.UNDECIDED, fault=fault, needs=lacking)


def _hides(verdict: Verdict, prepared: Prepared, oscillation: Oscillation, config: Config) -> Needs | None:
    """What the recording lacks to tell the cause that is named from others; None where it lacks nothing."""
    limits = config.cause
    if verdict.cause is Cause.VALVE:
        sure = verdict.confidence[Cause.VALVE] >= limits.compressed_pct
        return None if sure else compressed(prepared, None, config.quality)
    if verdict.cause is Cause.TUNING:
        return _robust(verdict, oscillation, config) or _rough(verdict, prepared, oscillation, limits)
    samples = oscillation.period_s / prepared.record.dt_s
    rough = _rough(verdict, prepared, oscillation, limits)
    if rough is not None:
        return rough
    if samples < limits.samples_told:
        return Needs(Lack.FASTER, words.too_few(samples, limits.samples_told))
    if not any(s.points_to == Cause.LOAD and s.name in OF_LOAD for s in verdict.signs):
        return Needs(Lack.MANUAL_TEST, words.NO_SIGN_OF_A_LOAD)
    return _beside(verdict, limits)


def _rough(
    verdict: Verdict, prepared: Prepared, oscillation: Oscillation, limits: CauseLimits
) -> Needs | None:
    """Finer values, where PV's grid has too few steps in the swing; None where it has enough."""
    steps = oscillation.amplitude_pct / max(prepared.pv_step, 1e-12)
    if steps >= (limits.steps_told if verdict.cause is Cause.LOAD else limits.steps_tuning):
        return None
    return Needs(Lack.FINER, words.too_rough(prepared.pv_step, oscillation.amplitude_pct))


def _robust(verdict: Verdict, oscillation: Oscillation, config: Config) -> Needs | None:
    """A test in manual, where signs speak for the tuning and the identified loop is robust; None where it is not."""
    ms = None if verdict.measured is None else sensitivity(verdict.measured, oscillation.period_s)
    return None if ms is None or ms > config.tuning.ms_most else Needs(Lack.MANUAL_TEST, words.robust(ms))


def _beside(verdict: Verdict, limits: CauseLimits) -> Needs | None:
    """A stroke of the valve, where a load is likely and a play shows all the same; None where it does not."""
    m = verdict.measured
    if m is None or m.trials is None or verdict.confidence[Cause.LOAD] >= limits.beside_pct:
        return None
    plain = m.evidence > limits.beside_share * (m.expected + limits.evidence)
    crossed = PLAYS[0] <= m.size <= limits.near_size
    if not plain or not crossed or m.trials.agreeing < limits.beside_agreeing or m.wave_left > PLAIN:
        return None
    return Needs(Lack.STROKE, words.valve_beside(m.size, m.trials.agreeing))
