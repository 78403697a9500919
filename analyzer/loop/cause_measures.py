"""The signs of a cause as numbers that do not depend on the size of the loop, in which their weights count."""

from __future__ import annotations

import math

import numpy as np

from analyzer.loop.measure import Measured
from analyzer.loop.oscillation import Oscillation
from identification.record import Floats

UNSTABLE = 20.0
"""Amplification [-] that stands for that of an unstable loop; ours: more than any stable one's of the study."""
SMALL_GAIN, SMALL_GAIN_CYCLE = 5.0, 0.5
"""Gains in log likelihood [nat], of all and a cycle, up to which they count as they are, above as their log."""

KEPT = 0.9
"""Height of the autocorrelation's third returning peak [-] from which a rhythm is kept as by a clock; ours: a load
from a machine and a loop at its limit of stability are both above it, and not told apart by how far."""

PLAIN = 0.08
"""Harmonics left over the fundamental [-] below which they say nothing, for a cycle near a sine leaves none whatever
makes it; ours: without it a loop that a tank with play feeds is blamed for a valve of its own, at 85 %, and of .01 to
.08 the last tells most of the loops kept apart from the fit (proofs/cause_weights.py)."""


def _signed_log(x: float) -> float:
    """Straight near zero, logarithmic far from it."""
    return math.copysign(math.log1p(abs(x)), x)


def _log(x: float, low: float, high: float) -> float:
    """Logarithm of a value within bounds."""
    return math.log(min(max(x, low), high))


def _amplification(m: Measured) -> float:
    """|S| at the period [-], 1 where no settings are known."""
    if not m.stable:
        return UNSTABLE
    return m.amplification or 1.0


def _loop_gain(m: Measured) -> float:
    """Gain of process and controller together [-], 1 where no settings are known."""
    return 1.0 if m.controller is None else abs(m.linear.gain * m.controller.kp)


NAMES = (
    *("evidence", "evidence_per_cycle", "agreeing", "steadiness", "jump", "size"),
    *("line_linear", "line_valve", "amplification", "loop_gain", "dead_time_share", "consistency"),
    *("harmonic", "kurtosis", "rhythm", "saturated", "wave_left"),
)
"""What is measured, in the order of `measures`."""


def measures(m: Measured, o: Oscillation) -> Floats:
    """The signs of one oscillating loop as numbers, shape (len(NAMES),), within fixed bounds; NaN where not known.

    Gains in log likelihood in logarithms; agreeing and steadiness of the trials, 0 without; stickband over range of
    OP; prominences, amplification at the period and K Kp in logarithms; dead time over period; gain outside the
    period's band over gain with it; third harmonic over fundamental; kurtosis of the cycle's size; the
    autocorrelation's third returning peak; share of time at a limit; harmonics that a faulty valve leaves.
    """
    t, cycles = m.trials, max(o.cycles, 1.0)
    found = (
        _signed_log(m.evidence / SMALL_GAIN),
        _signed_log(m.evidence / cycles / SMALL_GAIN_CYCLE),
        0.0 if t is None else t.agreeing - 0.5,
        0.0 if t is None else min(max(t.steadiness, -2.0), 15.0),
        _signed_log(max(m.jump, -1e6) / SMALL_GAIN if not math.isinf(m.jump) else 1e3),
        min(max(m.size, 0.0), 1.5),
        _log(m.line_linear, 0.05, 1e4),
        _log(m.line_valve, 0.05, 1e4),
        _log(_amplification(m), 0.1, 50.0),
        _log(_loop_gain(m), 1e-3, 1e2),
        min(m.linear.dead_time_s / o.period_s, 1.5),
        min(max(m.consistency, 0.0), 1.5),
        min(m.harmonic, 0.4),
        min(max(m.kurtosis, 1.4), 4.0),
        min(max(o.rhythm.third, -0.2), KEPT),
        m.saturated,
        min(max(m.wave_left, PLAIN), 0.4),
    )
    return np.array(found, dtype=np.float64)
