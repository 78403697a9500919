"""Design of the step test that identifies a loop: step size, hold time, and direction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from identification.estimation.descent import NINETY
from identification.record import Floats, LoopRecord
from identification.signals.robust import robust_deviation

HOLD_LAGS = 4.0
"""Sums of lags for which a step of a test is held, in addition to the dead time. Source: theory: PV is then
at 98 % of its way."""
HOLD_SAMPLES = 20  # Samples for which a step of a test is held at least [samples]
OVER_WANDER = 16.0
"""PV's answer to a step of a test over what the means of two holds differ by. Source: theory: the gain's 90 %
interval is then 10 %."""
OVER_SAMPLE = 4.0
"""The same over PV's noise from sample to sample: the samples of the rise determine the dead time."""
OVER_BACKLASH = 3.0  # Step of a test over the width of backlash or stickband: a step within it moves nothing
FIRST_STEP = 3.0  # First step of a test of a loop of unknown gain [% of OP]: what plants allow without asking
LEAST_STEP = 1.0  # Least step of a test [% of OP]: positioners resolve a few tenths of a percent
MARGIN = 5.0  # Distance from OP's limits that a test keeps [% of OP]
MOST_ANSWER = 10.0  # PV's answer to one step of a test at most [% of PV's span]: a plant may allow twice that

MOVES = (1.0, 1.0, -1.0, -1.0)
"""Moves of a test, in steps: the second identifies the gain free of backlash, the third backlash; the last
returns."""
RAMPS = (1.0, -1.0, -1.0, 1.0)
"""The same for an integrating PV: back to OP's balance after each."""


@dataclass(frozen=True, slots=True)
class Known:
    """Knowledge of a loop before a test: gain [% PV/% OP], for an integrator PV's move per lag, None if unknown; lag
    and dead time [s]; width of backlash or stickband [% OP], 0 if unknown; integrating, whether PV ramps while OP is
    off its balance; source of the values."""

    gain: float | None
    lag_s: float
    dead_s: float
    width_pct: float = 0.0
    integrating: bool = False
    source: str = ""


@dataclass(frozen=True, slots=True)
class Plan:
    """A test: step size [% OP], successive levels [% OP], hold time of each [s], noise from sample to sample and
    between the means of two holds [% PV], PV response to a step [% PV], None if the gain is unknown, relative
    half-widths of the 90 % intervals of gain and backlash expected afterwards, None likewise, and whether OP's range,
    not noise, determines the size."""

    step_pct: float
    levels_pct: tuple[float, ...]
    hold_s: float
    noise_pct: float
    wander_pct: float
    answer_pct: float | None
    gain_within: float | None
    backlash_within: float | None
    bounded: bool

    @property
    def duration_s(self) -> float:
        """Duration of the test [s], including the hold before its first move."""
        return (len(self.levels_pct)) * self.hold_s


def wander_between(pv: Floats, block: int) -> float:
    """Deviation [% PV] between means of neighbouring blocks of `block` samples, over the square root of two."""
    n = pv.size // block
    if n < 4:
        return robust_deviation(pv - np.median(pv)) if pv.size else 0.0
    means = pv[: n * block].reshape(n, block).mean(axis=1)
    return robust_deviation(np.diff(means)) / math.sqrt(2.0)


def planned(record: LoopRecord, known: Known) -> Plan:
    """The test of a loop at the operating point where its record ends."""
    good = record.at_work
    pv, op = record.pv[good], record.op[good]
    noise = robust_deviation(np.diff(pv)) / math.sqrt(2.0) if pv.size > 2 else 0.0
    hold_s = known.dead_s + HOLD_LAGS * known.lag_s
    hold_s = max(hold_s, HOLD_SAMPLES * record.dt_s)
    wander = max(
        wander_between(pv, max(int(hold_s / record.dt_s), 1)), noise / math.sqrt(hold_s / record.dt_s)
    )
    gain = abs(known.gain) if known.gain else None
    answer = max(OVER_WANDER * wander, OVER_SAMPLE * noise)
    wanted = FIRST_STEP if gain is None else answer / gain
    wanted = max(wanted, OVER_BACKLASH * known.width_pct, LEAST_STEP)
    middle = float(np.median(op[-max(op.size // 20, 1) :])) if op.size else 50.0
    room = max(100.0 - MARGIN - middle, middle - MARGIN)
    largest = math.inf if gain is None or known.integrating else MOST_ANSWER / gain
    step = min(wanted, max(0.5 * room, 0.0), largest)
    direction = 1.0 if middle + 2.0 * step <= 100.0 - MARGIN else -1.0
    step = float(f"{max(step, 0.1):.2g}")
    moves = RAMPS if known.integrating else MOVES
    levels = tuple(round(middle + direction * step * x, 2) for x in np.cumsum((0.0, *moves)))
    seen = None if gain is None else gain * step
    if known.integrating and seen is not None and seen > MOST_ANSWER:
        hold_s = known.dead_s + known.lag_s * MOST_ANSWER / seen
        seen = MOST_ANSWER
    within = None if seen is None or seen == 0.0 else NINETY * wander / seen
    width = known.width_pct
    backlash = None if within is None or width <= 0.0 else 2.0 * within * step / width
    return Plan(step, levels, hold_s, noise, wander, seen, within, backlash, step < 0.9 * wanted)
