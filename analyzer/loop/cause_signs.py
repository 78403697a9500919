"""Signs of a cause in words with figures, each with the cause to which it moves the odds most."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from analyzer.loop.cause_weights import PLAIN, measures, pushes
from analyzer.loop.decisions import AMPLIFICATION, CAUSES, Cause
from analyzer.loop.finding import Sign
from analyzer.loop.measure import Measured
from analyzer.loop.oscillation import Oscillation

AMPLIFIES = 1.7
"""|S| at the period from which that is told [-]: SIMC settings have 1.6 to 1.7 at their peak (Grimholt, Skogestad
2012)."""
LEAST_NAT = 0.1
"""Push [nat] below which a sign is not worth a line: it moves the odds by a tenth."""


Told = tuple[str, str]
"""Words for everybody, and figures for an expert, '' where the words hold them."""


def likelihood_told(evidence: float) -> Told:
    """How a faulty valve explains PV against an ideal one."""
    if evidence <= 0:
        return "play or stick-slip explains PV no better than an ideal valve", ""
    return "play or stick-slip explains PV better than an ideal valve", f"log likelihood +{evidence:.0f}"


def width_text(size: float) -> str:
    """The width of the valve's fault."""
    return f"its width is {100 * size:.0f} % of OP's range"


def _likelihood(m: Measured, o: Oscillation) -> Told:
    t = m.trials
    text, figures = likelihood_told(m.evidence)
    if t is None or m.evidence <= 0:
        return text, figures
    return f"{text}, in {100 * t.agreeing:.0f} % of {t.count} stretches between turns of OP", figures


def _width(m: Measured, o: Oscillation) -> Told:
    if m.evidence <= 0:
        return "no play or stick-slip is seen in PV", ""
    return f"the fault that fits best is {100 * m.size:.0f} % of OP's range wide", ""


def _left(m: Measured, o: Oscillation) -> Told:
    plain = f"the load that is left has {'a' if m.line_linear >= 1.0 else 'no'} peak at the period"
    return plain, f"prominence {m.line_linear:.1f}, behind a faulty valve {m.line_valve:.1f}"


def _amplification(m: Measured, o: Oscillation) -> Told:
    if not m.stable:
        return "the identified loop is unstable", ""
    if m.amplification is None:
        return "how the loop amplifies at the period is not known, for want of its settings", ""
    verb = "amplifies" if m.amplification > 1.0 else "weakens"
    times = m.amplification if m.amplification > 1.0 else 1.0 / max(m.amplification, 1e-3)
    return f"at the period the loop {verb} load {times:.1f} times", ""


def _loop_gain(m: Measured, o: Oscillation) -> Told:
    if m.controller is None:
        return "the gain of process and controller together is not known, for want of settings", ""
    return f"process and controller together have a gain of {abs(m.linear.gain * m.controller.kp):.2g}", ""


def _process(m: Measured, o: Oscillation) -> Told:
    figures = f"{m.consistency:.1f} times its gain"
    if m.consistency >= 0.5:
        return "outside the period's band the same process is seen", figures
    return "away from the period another process is seen", figures


def _wave(m: Measured, o: Oscillation) -> Told:
    return f"the wave has a phase-locked third harmonic of {100 * m.harmonic:.0f} %", ""


def _wave_left(m: Measured, o: Oscillation) -> Told:
    if m.wave_left < PLAIN:
        return "a faulty valve leaves few harmonics of the cycle unexplained", ""
    return f"a faulty valve leaves harmonics of {100 * m.wave_left:.0f} % of the cycle unexplained", ""


def _size(m: Measured, o: Oscillation) -> Told:
    size, rhythm = m.kurtosis < 2.0, o.rhythm.third >= 0.5
    figures = f"kurtosis {m.kurtosis:.1f}, noise has 3; rhythm {o.rhythm.third:.1f}"
    if size == rhythm:
        return f"the cycle {'keeps' if size else 'changes'} its size and its rhythm", figures
    kept, changed = ("size", "rhythm") if size else ("rhythm", "size")
    return f"the cycle keeps its {kept} and changes its {changed}", figures


def _limits(m: Measured, o: Oscillation) -> Told:
    share = 100 * m.saturated
    return f"OP is at a limit {share:.0f} % of the time" if share >= 1 else "OP stays off its limits", ""


def _dead_time(m: Measured, o: Oscillation) -> Told:
    if o.period_s > 50 * m.linear.dead_time_s:
        return "the period is long against the dead time", ""
    return f"the period is {o.period_s / m.linear.dead_time_s:.0f} dead times", ""


GROUPS: tuple[tuple[tuple[str, ...], Callable[[Measured, Oscillation], Told]], ...] = (
    (("evidence", "evidence_per_cycle", "agreeing", "steadiness", "jump"), _likelihood),
    (("size",), _width),
    (("line_linear", "line_valve"), _left),
    ((AMPLIFICATION,), _amplification),
    (("loop_gain",), _loop_gain),
    (("consistency",), _process),
    (("harmonic",), _wave),
    (("wave_left",), _wave_left),
    (("kurtosis", "rhythm"), _size),
    (("saturated",), _limits),
    (("dead_time_share",), _dead_time),
)
"""Measures that are one sign together, with its words."""


def signs_of(m: Measured, o: Oscillation) -> tuple[Sign, ...]:
    """The signs of one oscillating loop; strength is one less the share to which a sign brings the odds against its
    cause."""
    moved = pushes(measures(m, o))
    out = []
    for names, text in GROUPS:
        push = np.sum([moved[n] for n in names], axis=0)
        k = int(np.argmax(push))
        if push[k] >= LEAST_NAT:
            words, figures = text(m, o)
            out.append(Sign(CAUSES[k], 1.0 - math.exp(-float(push[k])), words, names[0], figures))
    if not m.stable or (m.amplification or 0.0) >= AMPLIFIES:
        told = [s for s in out if s.name != AMPLIFICATION]
        return (*told, Sign(Cause.TUNING, 0.05, _amplification(m, o)[0], AMPLIFICATION))
    return tuple(out)
