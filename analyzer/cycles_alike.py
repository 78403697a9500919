"""Whether an identified loop with its valve, simulated, cycles as the record does."""

from __future__ import annotations

import math

from analyzer.oscillation import Oscillation
from identification.estimation.hammerstein import Fit, process_of
from identification.estimation.window import Window
from identification.models import Loop, Pid
from tuning.limit_cycle import confirm
from tuning.linear import is_stable

ALIKE_PERIOD, ALIKE_AMPLITUDE = 1.1, 1.3
"""Largest ratios of a simulated to the recorded cycle that count as the same [-]; ours: identified loops of simulated
tanks with play come within 1.04 and 1.12."""


def cycles_alike(window: Window, fit: Fit, controller: Pid | None, o: Oscillation) -> bool:
    """Whether the identified loop, simulated without load, cycles with the recorded period and amplitude."""
    if controller is None or fit.gain * controller.kp <= 0 or fit.valve.stickband <= 0:
        return False
    loop = Loop(process_of(window, fit), controller, fit.valve.valve)
    if not is_stable(loop):
        return False
    cycle = confirm(loop).cycle
    if cycle is None or o.amplitude_pct <= 0 or cycle.pv_amplitude <= 0:
        return False
    periods, sizes = cycle.period_s / o.period_s, cycle.pv_amplitude / o.amplitude_pct
    return abs(math.log(periods)) < math.log(ALIKE_PERIOD) and abs(math.log(sizes)) < math.log(
        ALIKE_AMPLITUDE
    )
