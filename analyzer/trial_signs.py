"""What trials of the valve and the size of the cycles say about a cause."""

from __future__ import annotations

from analyzer.config import CauseLimits
from analyzer.measure import Measured
from analyzer.oscillation import Oscillation
from identification.signals.half_cycles import independent_sizes


def agree(m: Measured, limits: CauseLimits) -> bool:
    """Whether the stretches between OP's turns agree on the valve, and not a few of them alone."""
    t = m.trials
    return t is not None and t.steadiness >= limits.steadiness and t.agreeing >= limits.agreeing


def hidden_by_grid(m: Measured, pv_step: float, limits: CauseLimits) -> bool:
    """Whether the valve's stickband moves PV by so few steps of its grid, pv_step [% of span], that the grid itself
    holds PV still as the valve would."""
    best = m.stick_slip if m.stick_slip is not None and m.jump > limits.evidence_jump else m.play
    moved = abs(best.gain) * best.valve.stickband
    return m.window.position is None and moved < limits.grid_steps * pv_step


def denied_by_trials(m: Measured, limits: CauseLimits) -> bool:
    """Whether what speaks for the valve is in a few stretches between OP's turns alone."""
    t = m.trials
    return t is not None and t.steadiness < limits.denied and t.agreeing < limits.agreeing


def repeats_itself(m: Measured, o: Oscillation, limits: CauseLimits) -> bool:
    """Whether every cycle is the one before again, and none shows the valve plainly by itself.

    Then the trials are one trial, and what happened to fit once fits always, unless it fits with hardly any scatter.
    """
    t = m.trials
    if t is None or o.rhythm.third < limits.narrow or m.kurtosis > limits.kept_size:
        return False
    return m.evidence < limits.trial_gain * t.count and t.steadiness < limits.repeated_steadiness


def shown_by_trials(m: Measured, limits: CauseLimits) -> bool:
    """Whether a stickband too small to drive a cycle by itself is yet at fault.

    The trials agree, and the cycle is none that a machine could have brought, for its size changes and its wave is
    no square.
    """
    enough = m.size >= limits.trial_size and m.evidence >= limits.trial_evidence and agree(m, limits)
    return enough and m.kurtosis >= limits.trial_kurtosis and m.harmonic <= limits.trial_harmonic


def keeps_its_size(m: Measured, o: Oscillation, limits: CauseLimits) -> bool:
    """Whether the cycles are of one size although their phase wanders, as noise through a resonance never is."""
    if m.saturated > limits.at_limits:
        return False
    sizes = independent_sizes(o.rhythm, o.cycles)
    most = min(limits.kept_size + limits.kept_size_trade * sizes, limits.kept_size_most)
    return sizes >= 1.0 and m.kurtosis <= most


def foreign(m: Measured, o: Oscillation, limits: CauseLimits) -> bool:
    """Whether the cycle is none of a linear loop.

    Its size is kept, its wave is no sine, or with it another process is seen than without. A loop that runs from
    limit to limit is not linear and may do all of that.
    """
    if m.saturated > limits.at_limits:
        return False
    edged = m.harmonic >= limits.edged
    return edged or m.consistency < limits.same_process or keeps_its_size(m, o, limits)
