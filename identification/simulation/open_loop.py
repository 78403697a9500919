"""The loop model in open loop under a recorded OP: the one simulator of candidates, explanation and saved model."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

from identification.models import Backlash, Integrator, Process, Valve
from identification.record import Floats
from identification.simulation.lag import lagged
from identification.simulation.parameters import KNOTS, SIZE, STEPS, Signal, Slot, acted, neutral
from identification.simulation.valve_chain import COASTS, flow
from identification.simulation.vessel import outflow, outflow_of, plain_vessel, transported, vessel

RAMP = 0.5
"""Change of PV [% PV] over which a switched load comes on; ours: about a transmitter's noise, so that the search for
the switching point has a slope."""
LEAST_GAIN = 0.05
"""Smallest remaining share of a gain; ours, equal to that of a gain that depends on the level."""


@njit(cache=True)
def switched(pv: Floats, at: float, band: float) -> Floats:
    """Share of a load that is on, from 0 to 1, shape (n,), switched on by PV above a value and off below it.

    pv, at : [% PV]; band : from off to on [% PV]. It is off before the first sample above.
    """
    out = np.empty_like(pv)
    on, half = 0.0, 0.5 * band
    for k in range(pv.size):
        up = (pv[k] - at - half) / RAMP + 0.5
        down = (pv[k] - at + half) / RAMP + 0.5
        on = min(max(on, min(max(up, 0.0), 1.0)), min(max(down, 0.0), 1.0))
        out[k] = on
    return out


def gain_change_by_history(pv: Floats, change: float, memory_s: float, dt_s: float) -> Floats:
    """Relative change of gain that depends on PV before each sample, shape (n,).

    pv : deviation from the PV of nominal gain, shape (n,) [% PV]; change : per 10 % of PV [-]; memory_s : time
    constant of the moving mean [s].
    """
    past = lagged(np.concatenate((np.zeros(1), pv[:-1])), memory_s, dt_s)
    return np.maximum(change * past / 10.0, LEAST_GAIN - 1.0)  # type: ignore[no-any-return]


def returned(pv: Floats, way_s: float, dt_s: float) -> Floats:
    """PV at a fixed time before the middle of each sample, shape (n,); before the first sample equal to the first,
    and never later than the sample itself, because later values are not known yet.

    pv : shape (n,) [% PV]; way_s : the delay [s].
    """
    k = np.arange(pv.size)
    return np.interp(np.minimum(k + 0.5 - way_s / dt_s, k), k, pv)


OUTSIDE = (
    *(Slot.T, Slot.L, Slot.K, Slot.BIAS, Slot.START, Slot.STICKBAND, Slot.JUMP, Slot.COAST, Slot.RATE),
    Slot.STEM_T,
    *(Slot.STOP_HI, Slot.STOP_LO, Slot.BEND, Slot.SERVO, Slot.DAMPING, Slot.DEADBAND),
    *(Slot.SPLIT, Slot.RATIO, Slot.SPLIT_DEAD, Slot.SPLIT_LAG, Slot.CLIP_HI, Slot.CLIP_LO),
    *(Slot.SINE, Slot.COSINE, Slot.OMEGA, Slot.NEIGHBOUR, Slot.NEIGHBOUR_T),
    *(int(Slot.STEP) + i for i in range(STEPS)),
    *(Slot.MODE_T, Slot.SPEED, Slot.HEAD_BIAS, Slot.RECALL_T),
    *(Slot.SWITCH, Slot.SWITCH_AT, Slot.SWITCH_BAND, Slot.RETURNED, Slot.RETURNS_S),
)
"""Parameters covered by a first-order vessel with constant gain and by the parts before and behind it, and those
without an effect of their own. Any other active parameter, also a new one, needs the full vessel."""
NEUTRAL = neutral()[:SIZE]
WITHIN = np.setdiff1d(np.arange(SIZE), np.array([int(s) for s in OUTSIDE]))
"""Indices of all the others."""


@dataclass(frozen=True, slots=True)
class ModelInputs:
    """Recorded quantities, which are not fitted.

    op : shape (n,) [% OP]; dt_s [s]; middle : OP that counts as zero [% OP]; level : PV that counts as zero [% PV];
    pv_range : lowest and highest PV; step_at : samples at which the load may step; neighbour : another loop's OP less
    its mean, shape (n,); longest_s : longest time constant that counts as one [s]; pv : recorded PV less level, shape
    (n,), on which gain or load may depend; None where PV is to be simulated.
    """

    op: Floats
    dt_s: float
    middle: float
    level: float
    pv_range: tuple[float, float]
    step_at: tuple[int, ...] = ()
    neighbour: Floats | None = field(default=None, repr=False)
    longest_s: float = math.inf
    pv: Floats | None = field(default=None, repr=False)

    @property
    def clock(self) -> Floats:
        """Time from -0.5 to 0.5 over the record, shape (n,)."""
        return np.arange(self.op.size) / self.op.size - 0.5


def as_parameters(process: Process, valve: Valve = None) -> Floats:
    """A process and a valve of models.py as parameters of the loop model, shape (SIZE + own,); all else neutral."""
    c = neutral()
    if isinstance(process, Integrator):
        c[Slot.LEAK], c[Slot.T] = 0.0, 1.0 / abs(process.slope)
        c[Slot.K] = math.copysign(1.0, process.slope)
    else:
        c[Slot.K], c[Slot.T] = process.gain, process.time_constant_s
    c[Slot.L] = process.dead_time_s
    if isinstance(valve, Backlash):
        c[Slot.STICKBAND] = valve.width
    elif valve is not None:
        c[Slot.STICKBAND], c[Slot.JUMP] = valve.stickband, valve.slip_jump
        c[Slot.COAST] = COASTS[valve.motion]
    return c


def head(inputs: ModelInputs, c: Floats) -> Floats:
    """Slow relative supply, shape (n,): linear between knots, mean zero."""
    knots = c[int(Slot.HEAD) : int(Slot.HEAD) + KNOTS]
    if not knots.any():
        return np.zeros(inputs.op.size)
    line = np.interp(inputs.clock, np.linspace(-0.5, 0.5, KNOTS), knots)
    return line - line.mean()


def load(inputs: ModelInputs, c: Floats) -> Floats:
    """Load at the vessel's inlet, shape (n,) [% OP], from the constants."""
    act = np.zeros(inputs.op.size)
    for i, at in enumerate(inputs.step_at[:STEPS]):
        act[at:] += c[int(Slot.STEP) + i]
    if c[Slot.SINE] != 0 or c[Slot.COSINE] != 0:
        angle = c[Slot.OMEGA] * inputs.dt_s * np.arange(inputs.op.size)
        act += c[Slot.SINE] * np.sin(angle) + c[Slot.COSINE] * np.cos(angle)
    if inputs.neighbour is not None and c[Slot.NEIGHBOUR] != 0:
        act += c[Slot.NEIGHBOUR] * lagged(inputs.neighbour, c[Slot.NEIGHBOUR_T], inputs.dt_s)
    if inputs.pv is not None and c[Slot.SWITCH] != 0:
        act += c[Slot.SWITCH] * switched(inputs.pv, c[Slot.SWITCH_AT] - inputs.level, c[Slot.SWITCH_BAND])
    if inputs.pv is not None and c[Slot.RETURNED] != 0:
        act += c[Slot.RETURNED] / c[Slot.K] * returned(inputs.pv, float(c[Slot.RETURNS_S]), inputs.dt_s)
    return act


def history(inputs: ModelInputs, c: Floats) -> Floats:
    """Relative change of gain that depends on past recorded PV, shape (n,)."""
    if inputs.pv is None or c[Slot.RECALL] == 0:
        return np.zeros(inputs.op.size)
    return gain_change_by_history(inputs.pv, float(c[Slot.RECALL]), float(c[Slot.RECALL_T]), inputs.dt_s)


def through_valve(inputs: ModelInputs, c: Floats) -> Floats:
    """Flow through the valve during each sample [% OP], shape (n,), of the model under the recorded OP."""
    op = acted(Signal.OP, inputs.op, c, inputs.dt_s)
    return acted(Signal.FLOW, flow(op, c, inputs.dt_s, inputs.middle), c, inputs.dt_s)


def simulate(inputs: ModelInputs, c: Floats) -> Floats:
    """PV's deviation from inputs.level [% PV], shape (n,), of the model under the recorded OP.

    c : shape (SIZE,), constants (parameters.py).
    """
    return from_flow(inputs, c, through_valve(inputs, c))


def from_flow(inputs: ModelInputs, c: Floats, through: Floats) -> Floats:
    """The same for a flow through the valve during each sample, shape (n,) [% OP]."""
    dt, middle = inputs.dt_s, inputs.middle
    if (c[WITHIN] != NEUTRAL[WITHIN]).any():
        if c[Slot.PIPE] != 0:
            through = transported(through, c[Slot.L], c[Slot.PIPE], max(middle, 1e-3), dt)
        act, gain = load_over_record(inputs, c), gain_over_record(inputs, c)
        full, head_at = counted_from_level(inputs, c), outflow_head(inputs, c)
        out = vessel(through, act, gain, full, dt, middle, head_at)
    else:
        out = plain_vessel(through, load(inputs, c), c, dt, middle)
    out = acted(Signal.PV, out, c, dt)
    if math.isfinite(c[Slot.CLIP_HI]) or math.isfinite(c[Slot.CLIP_LO]):
        out = np.clip(out, c[Slot.CLIP_LO] - inputs.level, c[Slot.CLIP_HI] - inputs.level)
    return out if np.isfinite(out).all() else np.nan_to_num(out, nan=1e6, posinf=1e6, neginf=-1e6)


def gain_over_record(inputs: ModelInputs, c: Floats) -> Floats:
    """Relative gain of the process over the recording, shape (n,): supply, drift, and past PV."""
    supply = head(inputs, c) + history(inputs, c)
    return 1.0 + supply if c[Slot.DRIFT] == 0 else 1.0 + c[Slot.DRIFT] * inputs.clock + supply


def load_over_record(inputs: ModelInputs, c: Floats) -> Floats:
    """Load at the inlet, including the part from a varying gain by supply or past PV, shape (n,) [% OP]."""
    return load(inputs, c) + c[Slot.HEAD_BIAS] * (head(inputs, c) + history(inputs, c))


def outflow_head(inputs: ModelInputs, c: Floats) -> float:
    """Level deviation at which a vessel with square-root outflow would be empty, sign reversed [% PV]."""
    return max(inputs.level, 1.0) / float(c[Slot.ROOT]) if c[Slot.ROOT] > 0 else 1.0


def begun_at_rest(inputs: ModelInputs, c: Floats) -> Floats:
    """Constants, shape (SIZE,), for which the vessel before the last feeds it the outflow of its own initial level.

    A record may begin during a move; the initial level of the vessel before the last belongs to that record alone.
    """
    out = c.copy()
    flow_out, _ = outflow(float(c[Slot.START]), outflow_of(c, outflow_head(inputs, c)))
    fed = c[Slot.K] * (through_valve(inputs, c)[0] - inputs.middle) + c[Slot.BIAS]
    out[Slot.BEGUN] = flow_out - fed
    return out


def counted_from_level(inputs: ModelInputs, c: Floats) -> Floats:
    """Constants, shape (SIZE,), with caps [% PV] relative to inputs.level, as the vessel's own deviations are."""
    out = c.copy()
    out[Slot.CAP] -= inputs.level
    out[Slot.UPPER_CAP] -= inputs.level
    return out
