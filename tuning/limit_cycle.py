"""The limit cycle of a loop with backlash or stick-slip, confirmed by simulation.

If the harmonic balance predicts another cycle, the simulation decides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from identification.models import Fopdt, Integrator, Loop, Motion, Stiction
from identification.record import Floats, LoopRecord
from identification.simulation.closed_loop import closed_loop, scan_step
from tuning.describing import band
from tuning.frequency_response import rejects_s, slowest_s
from tuning.harmonic_balance import Balance, predicted_cycle

CYCLE_PERIODS = 30
"""Predicted periods that the confirmation of a limit cycle simulates at first: the study's loops settle
within ten."""
CYCLE_STEPS = 600000  # Steps that a confirmation may take in all: some 20 ms
REST_SHARE = 0.45
"""Amplitude of OP over the width of the backlash below which a loop does not cycle. Source: no cycle has less
than half of it."""
STEADY = 0.02
"""Relative change of amplitude from one quarter of the record to the next below which a cycle is steady."""

KICK = 1.0 + math.sqrt(5.0)
"""Kick in backlash widths at OP; irrational, so that the stem's travel never matches it exactly."""
KICKS = (1.0, 1.37, 1.83)
"""Further kicks relative to the first, for a stem that moves by jumps and happens to stop at the set point."""
NO_LIMIT = 1e9
"""Output limits [% OP] without effect: a cycle scales with the backlash and must not reach a limit."""


@dataclass(frozen=True, slots=True)
class Cycle:
    """A steady cycle found by simulation.

    period_s [s], op_amplitude [% OP], pv_amplitude [% PV] (half of peak to peak), stem_travel [%/h].
    """

    period_s: float
    op_amplitude: float
    pv_amplitude: float
    stem_travel: float


@dataclass(frozen=True, slots=True)
class Confirmed:
    """Result of the simulation: a cycle, none, or undecided.

    settled is False if neither a steady cycle nor rest was reached; `cycle` is then the last one found; predicted is
    the largest stable solution of the harmonic balance.
    """

    cycle: Cycle | None
    settled: bool
    predicted: Balance | None


def _measured(r: LoopRecord) -> Cycle | None:
    """The cycle in a stretch of a settled loop; None if the stem rests or there are fewer than two periods."""
    x = r.pv - 0.5 * (r.pv.max() + r.pv.min())
    k = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    at = k + x[k] / (x[k] - x[k + 1])  # crosses its middle upwards, between samples
    if at.size < 3 or np.ptp(r.stem) == 0.0:
        return None
    whole = slice(math.ceil(at[0]), math.floor(at[-1]) + 1)
    travel = float(np.abs(np.diff(r.stem[whole])).sum())
    return Cycle(
        period_s=float((at[-1] - at[0]) / (at.size - 1) * r.dt_s),
        op_amplitude=0.5 * float(np.ptp(r.op[whole])),
        pv_amplitude=0.5 * float(np.ptp(r.pv[whole])),
        stem_travel=float(travel / ((at[-1] - at[0]) * r.dt_s) * 3600.0),
    )


def _kicked(loop: Loop, steps: int, kick: float) -> LoopRecord:
    """The loop at rest, without output limits, after a step of PV by `kick` [% PV].

    Halfway the load of a stem that moves by whole jumps is adjusted so that equilibrium is midway between two of its
    positions. The share of a jump that the load requires determines the asymmetry and period of the cycle; half a
    jump gives the symmetric and fastest one, which is also that of the balance.
    """
    free = replace(loop, controller=replace(loop.controller, op_lo=-NO_LIMIT, op_hi=NO_LIMIT))
    valve, half = loop.valve, steps // 2
    load = np.full(steps, kick)
    load[0] = 0.0
    if isinstance(valve, Stiction) and valve.motion is Motion.RESTS and isinstance(loop.process, Fopdt):
        stem = closed_loop(free, np.zeros(half), load[:half], op_start=0.0).stem[-1]
        rest_levels = -loop.process.gain * (stem + valve.slip_jump * np.array([-0.5, 0.5]))
        load[half:] = rest_levels[np.argmin(np.abs(rest_levels - kick))]
    return closed_loop(free, np.zeros(steps), load, op_start=0.0)


def _verdict(op: Floats, width: float) -> str:
    """decays, steady, grows or moves: the amplitude of OP in the last two quarters."""
    n = op.size // 4
    before, now = 0.5 * np.ptp(op[-2 * n : -n]), 0.5 * np.ptp(op[-n:])
    if now < REST_SHARE * width:
        return "decays"
    if now > 1e4 * width:
        return "grows"
    return "steady" if abs(now / before - 1.0) < STEADY else "moves"


def confirm(loop: Loop) -> Confirmed:
    """The limit cycle in a simulation after a kick, without noise."""
    predicted = predicted_cycle(loop)
    width = band(loop.valve)
    if width <= 0.0:
        return Confirmed(None, True, None)
    h = scan_step(loop)
    kick = kick_of(loop, width)
    scale = max(4.0 * slowest_s(loop), _ramp_s(loop))
    if predicted is not None:
        kick, scale = max(kick, 3.0 * predicted.pv_amplitude), predicted.period_s
    steps = int(min(max(CYCLE_PERIODS * scale / h, 2000), CYCLE_STEPS))
    valve = loop.valve
    jumps = isinstance(valve, Stiction) and valve.motion is Motion.RESTS and valve.slip_jump > 0.0
    for factor in KICKS if jumps else KICKS[:1]:
        found = _settle(loop, steps, factor * kick, width, predicted)
        if found.cycle is not None:
            break
    return found


def kick_of(loop: Loop, width: float) -> float:
    """An error that moves OP by several widths [% PV], by an integral alone within the loop's slowest time."""
    c = loop.controller
    return KICK * width / (abs(c.kp) or abs(c.ki) * slowest_s(loop))


def _ramp_s(loop: Loop) -> float:
    """Time [s] in which integral action moves OP by four stickbands at an error of half a band."""
    c = loop.controller
    if isinstance(loop.process, Integrator) or not c.ki:
        return 0.0
    return 8.0 * rejects_s(c) / abs(loop.process.gain)


def _settle(loop: Loop, steps: int, kick: float, width: float, predicted: Balance | None) -> Confirmed:
    """Extend the simulation until the loop rests or cycles steadily with four periods in the last quarter."""
    while True:
        record = _kicked(loop, steps, kick)
        verdict = _verdict(record.op, width)
        if verdict == "decays":
            return Confirmed(None, True, predicted)
        last = record.span(steps - steps // 4, steps)
        cycle = _measured(last)
        if verdict == "steady" and cycle is not None and cycle.period_s * 4 < last.duration_s:
            return Confirmed(cycle, True, predicted)
        if verdict == "grows" or 3 * steps > CYCLE_STEPS:
            return Confirmed(cycle, False, predicted)
        steps *= 3
