"""The signs of the cause of a cycle, in addition to the likelihoods of its models."""

from __future__ import annotations

import math

from analyzer.config import CauseLimits
from analyzer.loop.decisions import Cause, Sign, SignKind
from analyzer.loop.identification.measure import Measured
from analyzer.loop.oscillation.detection import Oscillation

AMPLIFIES = 1.7
"""|S| at the period from which it is reported. Source: SIMC settings have 1.6 to 1.7 at their peak (Grimholt,
Skogestad 2012)."""

SINE, NOISE = 1.5, 3.0
"""Kurtosis of a sine and of Gaussian noise [-] (Rice 1945)."""
WEAK = 0.05
"""Least strength of a listed sign [-]; ours: it moves nothing, and sorts the sign last."""


def signs_of(m: Measured, o: Oscillation, limits: CauseLimits) -> tuple[Sign, ...]:
    """Evidence and width of a valve fault, a periodic load, the cycle's regularity, and the loop's amplification."""
    return (*_of_valve(m, limits), *_of_load(m, limits), _of_size(m, o, limits), *_of_loop(m))


def _sure(nat: float, limits: CauseLimits) -> float:
    """Strength of a gain in log likelihood [-]: one minus the factor on the odds against its cause."""
    return max(1.0 - math.exp(-max(nat, 0.0) / limits.temper), WEAK)


def _of_valve(m: Measured, limits: CauseLimits) -> tuple[Sign, ...]:
    """How much better a faulty valve explains PV, which counts little of a fault too small for OP's travel, and its
    width."""
    agreeing = () if m.trials is None else (m.trials.agreeing, m.trials.count)
    if m.evidence <= 0.0:
        return (Sign(Cause.LOAD, WEAK, SignKind.EVIDENCE, (m.evidence,)),)
    wide = m.size >= limits.least_size
    return (
        Sign(
            Cause.VALVE,
            _sure(m.evidence, limits) if wide else WEAK,
            SignKind.EVIDENCE,
            (m.evidence, *agreeing),
        ),
        Sign(Cause.VALVE if wide else Cause.LOAD, min(max(m.size, WEAK), 1.0), SignKind.WIDTH, (m.size,)),
    )


def _of_load(m: Measured, limits: CauseLimits) -> tuple[Sign, ...]:
    """A periodic load that keeps its phase."""
    if m.ringing is None or not m.ringing.is_periodic(limits):
        return ()
    nat, line = m.ringing.line_nat, m.ringing.lined.line
    kept = 0.0 if line is None else line.kept
    return (Sign(Cause.LOAD, _sure(nat, limits), SignKind.PERIODIC_LOAD, (nat, kept)),)


def _of_size(m: Measured, o: Oscillation, limits: CauseLimits) -> Sign:
    """Whether the cycle keeps its size, as a machine's or a faulty valve's does, or changes it, as noise through a
    resonance does."""
    keeps = m.kurtosis < limits.kept_size
    seen = m.ringing is not None and m.evidence >= m.ringing.penalty
    of_valve = seen and m.size >= limits.least_size
    end = SINE if keeps else NOISE
    strength = (m.kurtosis - limits.kept_size) / (end - limits.kept_size)
    cause = Cause.TUNING if not keeps else Cause.VALVE if of_valve else Cause.LOAD
    figures = m.kurtosis, o.rhythm.third, float(keeps)
    return Sign(cause, min(max(strength, WEAK), 1.0), SignKind.REGULARITY, figures)


def _of_loop(m: Measured) -> tuple[Sign, ...]:
    """Whether the loop amplifies a load at the period."""
    if m.stable and (m.amplification or 0.0) < AMPLIFIES:
        return ()
    return (Sign(Cause.TUNING, WEAK, SignKind.AMPLIFICATION, (m.amplification,) if m.stable else ()),)
