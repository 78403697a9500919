"""The shape of what was found, as arrays to draw: the loop, curve, response or course that the plain loop lacks.

Each shape is a function of the model's constants; its band is that function at the ends of the parameters'
intervals, one parameter at a time, their deviations added as squares.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from identification.models import Estimate
from identification.record import Floats
from identification.simulation.open_loop import ModelInputs, head, load, simulate
from identification.simulation.parameters import STEPS, Slot, neutral
from identification.simulation.valve_chain import curved, friction, positioned, second_valve, slewed

if TYPE_CHECKING:
    from identification.simulation.effect import Row

POINTS = 241
"""Points of a static curve."""
STEP_PCT = 10.0
"""Size of the step whose response is drawn, OP's range where that is less [% OP]."""
LENGTHS = 5.0
"""Length of a response, in dead time and all time constants together."""
SWEEP = 2.5
"""Half height of the sweep that draws a valve's loop, in widths of its stickband; ours: both flanks show."""
EARLY = 0.25
"""A response is drawn to ten of its shortest lags where that is less than this part of the whole."""
COURSE_POINTS = 600
"""Points of a course over time."""

Read = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True)
class Drawn:
    """One curve: its name, shape (m,) each; low and high bound it where an interval is known."""

    name: str
    x: Floats
    y: Floats
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True, slots=True)
class Axis:
    """What an axis counts and in which unit."""

    what: str
    unit: str


@dataclass(frozen=True, slots=True)
class Shape:
    """What was found, drawn: its kind, both axes, curves (the found one first), places on the horizontal axis.

    kind : loop (the band is two more loops, least and most), curve, response or course.
    """

    effect: str
    kind: str
    x: Axis
    y: Axis
    curves: tuple[Drawn, ...] = field(repr=False)
    places: tuple[float, ...] = ()


def ends(row: Row, known: Mapping[str, Estimate]) -> tuple[tuple[int, float, float], ...]:
    """Place, low and high end of each of a row's constants whose interval is known."""
    found = ((int(p.slot), known.get(p.name)) for p in row.params)
    return tuple((slot, e.low, e.high) for slot, e in found if e is not None)


def banded(
    read: Read, c: Floats, spread: tuple[tuple[int, float, float], ...]
) -> tuple[Floats, Floats, Floats]:
    """A shape at given constants with its least and greatest value, shape (m,) each.

    Parameters
    ----------
    read : callable
        Shape of constants.
    c : ndarray of shape (SIZE,)
    spread : tuple of (slot, low, high)
        The constants' intervals.
    """
    here = read(c)
    below, above = np.zeros_like(here), np.zeros_like(here)
    for slot, *both in spread:
        moves = np.zeros((3, here.size))
        for i, value in enumerate(both):
            other = c.copy()
            other[slot] = value
            moves[i] = read(other) - here
        below += moves.min(axis=0) ** 2
        above += moves.max(axis=0) ** 2
    return here, here - np.sqrt(below), here + np.sqrt(above)


def sweep(inputs: ModelInputs, width: float) -> Floats:
    """OP up and down twice about its middle, far enough to open a loop of that width, shape (m,)."""
    reach = SWEEP * max(width, 1e-3)
    one = np.concatenate((np.linspace(-1, 1, POINTS), np.linspace(1, -1, POINTS)))
    return inputs.middle + reach * np.concatenate((one, one))


def loop(inputs: ModelInputs, c: Floats, row: Row, known: Mapping[str, Estimate]) -> Shape:
    """Stem over OP of a valve with play or stick-slip, with the loops of the narrowest and the widest band."""
    op = sweep(inputs, float(c[Slot.STICKBAND]))
    last = slice(2 * POINTS, None)
    curves = [Drawn("found", op[last], friction(op, c)[last])]
    for name, i in (("least", 1), ("most", 2)):
        other = c.copy()
        for place in ends(row, known):
            other[place[0]] = place[i]
        other[Slot.JUMP] = min(other[Slot.JUMP], other[Slot.STICKBAND])
        curves.append(Drawn(name, op[last], friction(op, other)[last]))
    curves.append(Drawn("plain", op[last], op[last]))
    return Shape(row.name, "loop", Axis("OP", "%"), Axis("stem", "% OP"), tuple(curves))


def op_range(inputs: ModelInputs) -> Floats:
    """OP from its least to its greatest value, shape (POINTS,)."""
    return np.linspace(float(inputs.op.min()), float(inputs.op.max()), POINTS)


def flow_curve(inputs: ModelInputs, c: Floats, row: Row, known: Mapping[str, Estimate]) -> Shape:
    """Flow over OP at rest: characteristic, stop or second valve."""
    op = op_range(inputs)

    def read(k: Floats) -> Floats:
        z = np.clip(op, k[Slot.STOP_LO], k[Slot.STOP_HI])
        if np.isfinite(k[Slot.SPLIT]):
            at_rest = k.copy()
            at_rest[Slot.SPLIT_LAG] = 0.0
            z = second_valve(z, at_rest, inputs.dt_s)
        return curved(z, float(k[Slot.BEND]), inputs.middle)

    y, low, high = banded(read, c, ends(row, known))
    places = tuple(float(c[s]) for s in (Slot.STOP_LO, Slot.STOP_HI, Slot.SPLIT) if np.isfinite(c[s]))
    curves = (Drawn("found", op, y, low, high), Drawn("plain", op, op))
    return Shape(row.name, "curve", Axis("OP", "%"), Axis("flow", "% OP"), curves, places)


def _step(size: float, n: int, dt_s: float, back: bool) -> tuple[Floats, Floats]:
    """Time [s] and a step (and, if wanted, the step back), shape (m,)."""
    time = dt_s * np.arange(-n // 10, (2 if back else 1) * n, dtype=np.float64)
    on = (time >= 0) & (time < n * dt_s) if back else time >= 0
    return time, np.where(on, size, 0.0)


def stem_response(inputs: ModelInputs, c: Floats, row: Row, known: Mapping[str, Estimate]) -> Shape:
    """Stem after a step of OP: slew or positioner."""
    size = min(max(STEP_PCT, 0.5 * float(np.ptp(inputs.op))), 50.0)
    slow = size / c[Slot.RATE] if row.name == "rate-limit" else 8.0 * c[Slot.SERVO]
    fine = max(float(slow) * 1.6, 4 * inputs.dt_s) / POINTS
    time, op = _step(size, POINTS, fine, False)

    def read(k: Floats) -> Floats:
        if row.name == "rate-limit":
            return slewed(op, float(k[Slot.RATE]), fine)
        return positioned(op, k[Slot.SERVO], k[Slot.DAMPING], k[Slot.DEADBAND], fine, 5)

    y, low, high = banded(read, c, ends(row, known))
    curves = (Drawn("found", time, y, low, high), Drawn("plain", time, op))
    return Shape(row.name, "response", Axis("time", "s"), Axis("stem", "% OP"), curves)


def resting(c: Floats, keep: tuple[int, ...]) -> Floats:
    """A model's process alone: valve, load, clip and the record's start taken out; `keep` are not."""
    out = neutral()
    for slot in (*PROCESS, *keep):
        out[slot] = c[slot]
    return out


PROCESS = (Slot.T, Slot.L, Slot.K, Slot.T2, Slot.T3, Slot.SHARE, Slot.MODE_T, Slot.ASYMMETRY, Slot.LEAK)
"""Constants of the process's own dynamics."""


def step_response(
    inputs: ModelInputs, c: Floats, row: Row, known: Mapping[str, Estimate], plain: Floats
) -> Shape:
    """PV after a step of OP up (and down again), of the plain and the improved process."""
    times = float(c[Slot.T] + c[Slot.L] + c[Slot.T2] + (c[Slot.MODE_T] if c[Slot.SHARE] != 0 else 0.0))
    if c[Slot.LEAK] == 0:
        times = float(plain[Slot.T] + plain[Slot.L])
    length = min(LENGTHS * times, inputs.dt_s * inputs.op.size)
    fast = float(c[Slot.L]) + 10.0 * min(_lags(c, row.name), default=length)
    length = fast if fast < EARLY * length else length
    dt = min(length / POINTS, inputs.dt_s) if length < POINTS * inputs.dt_s else length / POINTS
    n = min(int(length / dt), 4 * POINTS)
    size = min(STEP_PCT, float(np.ptp(inputs.op)))
    time, op = _step(size, n, dt, row.name == "direction-asymmetry")
    drawn = ModelInputs(op, dt, 0.0, inputs.level, (0.0, 100.0))

    def read(k: Floats) -> Floats:
        return simulate(drawn, resting(k, ()))

    y, low, high = banded(read, c, ends(row, known))
    curves = (Drawn("found", time, y, low, high), Drawn("plain", time, read(plain)))
    return Shape(row.name, "response", Axis("time", "s"), Axis("PV", "% PV"), curves)


def gain_curve(
    inputs: ModelInputs, c: Floats, row: Row, known: Mapping[str, Estimate], plain: Floats
) -> Shape:
    """Gain of the process over PV: by slope, by its speed, or as a vessel with a rooted outflow."""
    pv = np.linspace(*inputs.pv_range, POINTS)
    x = pv - inputs.level

    def read(k: Floats) -> Floats:
        empty = max(inputs.level, 1.0) / k[Slot.ROOT] if k[Slot.ROOT] > 0 else np.inf
        root = np.sqrt(np.maximum(1.0 + x / empty, 0.0))
        bent = np.maximum(1.0 + k[Slot.SLOPE] * x / 50.0, 0.05)
        scheduled = np.maximum(1.0 + k[Slot.GAIN_SLOPE] * x / 50.0, 0.05)
        return np.asarray(k[Slot.K] * root * bent * scheduled)

    y, low, high = banded(read, c, ends(row, known))
    curves = (Drawn("found", pv, y, low, high), Drawn("plain", pv, np.full(POINTS, float(plain[Slot.K]))))
    return Shape(row.name, "curve", Axis("PV", "%"), Axis("gain", "% PV/% OP"), curves)


def delay_curve(
    inputs: ModelInputs, c: Floats, row: Row, known: Mapping[str, Estimate], plain: Floats
) -> Shape:
    """Dead time over flow (OP), at a flow that stays."""
    op = op_range(inputs)
    about = max(inputs.middle, 1e-3)

    def read(k: Floats) -> Floats:
        return np.asarray(k[Slot.L] / np.maximum(1.0 + k[Slot.PIPE] * (op / about - 1.0), 0.1))

    y, low, high = banded(read, c, ends(row, known))
    curves = (Drawn("found", op, y, low, high), Drawn("plain", op, np.full(POINTS, float(plain[Slot.L]))))
    return Shape(row.name, "curve", Axis("OP (flow)", "%"), Axis("dead time", "s"), curves)


def overflow_curve(inputs: ModelInputs, c: Floats, row: Row, known: Mapping[str, Estimate]) -> Shape:
    """PV over what an unbounded vessel would show."""
    low_pv, high_pv = inputs.pv_range
    free = np.linspace(low_pv, high_pv + 0.3 * (high_pv - low_pv), POINTS)
    y, low, high = banded(lambda k: np.minimum(free, k[Slot.CAP]), c, ends(row, known))
    curves = (Drawn("found", free, y, low, high), Drawn("plain", free, free))
    return Shape(row.name, "curve", Axis("PV of a vessel without overflow", "%"), Axis("PV", "%"), curves)


def course(inputs: ModelInputs, c: Floats, row: Row, known: Mapping[str, Estimate], plain: Floats) -> Shape:
    """What acts over the recording: load, supply, or the gain as it drifts."""
    n = inputs.op.size
    at = np.unique(np.linspace(0, n - 1, min(COURSE_POINTS, n)).astype(int))
    if row.name == "load-oscillation":
        at = at_few_periods(inputs, c)
    time = at * inputs.dt_s
    drifts = row.name == "gain-drift"

    def read(k: Floats) -> Floats:
        if drifts:
            return np.asarray(k[Slot.K] * (1.0 + k[Slot.DRIFT] * inputs.clock[at]))
        if row.name == "supply-variation":
            return np.asarray(100.0 * head(inputs, k)[at])
        return np.asarray(load(inputs, k)[at])

    y, low, high = banded(read, c, ends(row, known))
    rest = np.full(at.size, float(plain[Slot.K]) if drifts else 0.0)
    axis = Axis("gain", "% PV/% OP") if drifts else Axis("load at the inlet", "% OP")
    axis = Axis("supply", "% of its mean") if row.name == "supply-variation" else axis
    acting = [k for i, k in enumerate(inputs.step_at[:STEPS]) if c[int(Slot.STEP) + i] != 0]
    places = tuple(float(k * inputs.dt_s) for k in acting) if row.name == "load-step" else ()
    curves = (Drawn("found", time, y, low, high), Drawn("plain", time, rest))
    return Shape(row.name, "course", Axis("time", "s"), axis, curves, places)


def at_few_periods(inputs: ModelInputs, c: Floats) -> np.ndarray:
    """Samples of the first six periods of an oscillating load."""
    samples = 6 * 2 * np.pi / max(float(c[Slot.OMEGA]) * inputs.dt_s, 1e-9)
    return np.unique(np.linspace(0, min(samples, inputs.op.size - 1), COURSE_POINTS).astype(int))


LOOPS = ("backlash", "stiction")
FLOWS = ("valve-characteristic", "saturation", "split-range")
STEMS = ("rate-limit", "positioner")
STEPPED = ("second-lag", "slow-mode", "inverse-response", "direction-asymmetry", "integrator")
GAINS = ("nonlinear-gain", "sqrt-outflow")


def _lags(c: Floats, name: str) -> list[float]:
    """The added lag whose work is over early [s], if there is one."""
    if name == "second-lag":
        return [float(min(c[Slot.T2], c[Slot.T]))]
    return [float(min(c[Slot.MODE_T], c[Slot.T]))] if name == "inverse-response" else []


def shape_of(
    inputs: ModelInputs, row: Row, known: Mapping[str, Estimate], best: Floats, plain: Floats
) -> Shape | None:
    """The shape of one row of the physics; None of a row without one.

    Parameters
    ----------
    inputs : ModelInputs
    row : Row
    known : mapping of str to Estimate
        The row's constants with intervals, by their answered names.
    best, plain : ndarray of shape (SIZE,)
        Constants of the improved and of the plain model.
    """
    if row.name in LOOPS:
        return loop(inputs, best, row, known)
    if row.name in FLOWS:
        return flow_curve(inputs, best, row, known)
    if row.name in STEMS:
        return stem_response(inputs, best, row, known)
    if row.name in STEPPED:
        return step_response(inputs, best, row, known, plain)
    if row.name in GAINS:
        return gain_curve(inputs, best, row, known, plain)
    if row.name == "flow-dependent-delay":
        return delay_curve(inputs, best, row, known, plain)
    if row.name == "overflow":
        return overflow_curve(inputs, best, row, known)
    if row.block == "load" or row.name == "gain-drift":
        return course(inputs, best, row, known, plain)
    return None
