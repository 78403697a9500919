"""Data of the pictures of an effect: of valve and process and over the recording, with the baseline model, and of
recorder and controller as recorded.

A picture of the physics is a function of the model's parameters; its band is that function at the ends of their
intervals, one parameter at a time, with the deviations added as squares.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from identification.controller.check import StatedSettings, runs
from identification.mismatch.recording import Recording
from identification.models import Estimate
from identification.record import Floats, Mask
from identification.simulation.open_loop import ModelInputs, load, simulate
from identification.simulation.parameters import Slot, Variant, alone
from identification.simulation.pi import free_path
from identification.simulation.valve_chain import flow

POINTS = 241
"""Points of a static curve."""
COURSE_POINTS = 600
"""Points of a time course."""
SWEEP = 2.5
"""Half height of the sweep for a valve's loop, in widths of its stickband; ours: both flanks are visible."""
STEP_PCT, MOST_STEP_PCT = 10.0, 50.0
"""Size of the step whose response is drawn; for a stem, half of OP's range if that is larger, and at most the second
value [% OP]."""
STEM_LENGTH, FEWEST_SAMPLES = 1.6, 4
"""Length of a stem's response, relative to its duration; minimum number of samples."""
PV_LENGTH = 5.0
"""Length of PV's response, relative to the sum of dead time and all time constants."""
WINDOW, MOST_WINDOW = 240, 1500
"""Samples of a drawn stretch, and the maximum; ours: single samples are still visible."""
LAW_WINDOW = 8.0
"""Length of a stretch with a law, in integral times; ours: a wrong law has drifted away by then."""
EARLY = 0.25
"""It is drawn to ten of its shortest lags if that is less than this part of the whole."""
FRICTION = (Slot.STICKBAND, Slot.JUMP, Slot.COAST, Slot.STEM_T)
AT_REST = (Slot.STOP_LO, Slot.STOP_HI, Slot.SPLIT, Slot.RATIO, Slot.SPLIT_DEAD, Slot.BEND)
DYNAMICS = (Slot.T, Slot.L, Slot.K, Slot.T2, Slot.T3, Slot.SHARE, Slot.MODE_T, Slot.ASYMMETRY, Slot.LEAK)
"""Parameters of the valve's friction, of its flow at rest, and of the process dynamics."""

Read = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True)
class Drawn:
    """One curve: its name, shape (m,) each; low and high bound it if an interval is known."""

    name: str
    x: Floats
    y: Floats
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True, slots=True)
class Axis:
    """Quantity and unit of an axis."""

    what: str
    unit: str


TIME, OP, FLOW, STEM = Axis("time", "s"), Axis("OP", "%"), Axis("flow", "% OP"), Axis("stem", "% OP")
GAIN, LOAD, PV = Axis("gain", "% PV/% OP"), Axis("load at the inlet", "% OP"), Axis("PV", "%")


@dataclass(frozen=True, slots=True)
class Picture:
    """A finding, drawn: its kind, both axes, curves (the finding first), marks on the horizontal axis.

    kind : loop (the band is two more loops, least and most), curve, response, course or comb.
    """

    kind: str
    x: Axis
    y: Axis
    curves: tuple[Drawn, ...] = field(repr=False)
    places: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Drawing:
    """Data for a picture.

    inputs : inputs of the model; variant : the added effect; known : its parameters with intervals, by their reported
    names; best, plain : parameters of the improved and of the baseline model, shape (SIZE,) each.
    """

    inputs: ModelInputs
    variant: Variant
    known: Mapping[str, Estimate]
    best: Floats = field(repr=False)
    plain: Floats = field(repr=False)

    @property
    def ends(self) -> tuple[tuple[int, float, float], ...]:
        """Slot, low and high end of each parameter with a known interval."""
        found = ((int(p.slot), self.known.get(p.name)) for p in self.variant.params)
        return tuple((slot, e.low, e.high) for slot, e in found if e is not None)


def banded(read: Read, d: Drawing) -> tuple[Floats, Floats, Floats]:
    """Values of `read` for the best parameters, with lower and upper bound, shape (m,) each."""
    here = read(d.best)
    below, above = np.zeros_like(here), np.zeros_like(here)
    for slot, *both in d.ends:
        moves = np.zeros((3, here.size))
        for i, value in enumerate(both):
            other = d.best.copy()
            other[slot] = value
            moves[i] = read(other) - here
        below += moves.min(axis=0) ** 2
        above += moves.max(axis=0) ** 2
    return here, here - np.sqrt(below), here + np.sqrt(above)


def with_baseline(
    d: Drawing,
    kind: str,
    axes: tuple[Axis, Axis],
    x: Floats,
    read: Read,
    plain: Floats | float,
    places: tuple[float, ...] = (),
) -> Picture:
    """Values over x for the parameters, with their band, and for the baseline model, shape (m,) each."""
    y, low, high = banded(read, d)
    still = np.broadcast_to(np.asarray(plain, dtype=np.float64), x.shape)
    return Picture(kind, *axes, (Drawn("found", x, y, low, high), Drawn("plain", x, still)), places)


def op_range(inputs: ModelInputs) -> Floats:
    """OP from its lowest to its highest value, shape (POINTS,)."""
    return np.linspace(float(inputs.op.min()), float(inputs.op.max()), POINTS)


def drawn_step(size: float, n: int, dt_s: float, back: bool = False) -> tuple[Floats, Floats]:
    """Time [s] and a step (and optionally the step back), shape (m,)."""
    time = dt_s * np.arange(-n // 10, (2 if back else 1) * n, dtype=np.float64)
    on = (time >= 0) & (time < n * dt_s) if back else time >= 0
    return time, np.where(on, size, 0.0)


def stem_over_op(d: Drawing) -> Picture:
    """Stem over OP of a valve with backlash or stick-slip, with the loops of the narrowest and the widest band."""
    reach = SWEEP * max(float(d.best[Slot.STICKBAND]), 1e-3)
    one, half = np.concatenate((np.linspace(-1, 1, POINTS), np.linspace(1, -1, POINTS))), 2 * POINTS
    op = d.inputs.middle + reach * np.concatenate((one, one))
    least, most = d.best.copy(), d.best.copy()
    for slot, low, high in d.ends:
        least[slot], most[slot] = low, high
    for c in (least, most):
        c[Slot.JUMP] = min(c[Slot.JUMP], c[Slot.STICKBAND])
    curves = []
    for name, c in (("found", d.best), ("least", least), ("most", most)):
        stem = flow(op, alone(c, FRICTION), 1.0, d.inputs.middle)
        curves.append(Drawn(name, op[half:], stem[half:]))
    return Picture("loop", OP, STEM, (*curves, Drawn("plain", op[half:], op[half:])))


def flow_over_op(d: Drawing) -> Picture:
    """Flow over OP at rest: characteristic, stop or second valve."""
    op, ends = op_range(d.inputs), (Slot.STOP_LO, Slot.STOP_HI, Slot.SPLIT)
    places = tuple(float(d.best[s]) for s in ends if np.isfinite(d.best[s]))

    def read(c: Floats) -> Floats:
        return flow(op, alone(c, AT_REST), 1.0, d.inputs.middle)

    return with_baseline(d, "curve", (OP, FLOW), op, read, op, places)


def step_size(d: Drawing) -> float:
    """Size of the step whose stem is drawn [% OP]."""
    return min(max(STEP_PCT, 0.5 * float(np.ptp(d.inputs.op))), MOST_STEP_PCT)


def stem_response(d: Drawing, length_s: float, keep: tuple[int, ...]) -> Picture:
    """Stem after a step of OP, over about `length_s`, with the parameters in `keep` active."""
    fine = max(length_s * STEM_LENGTH, FEWEST_SAMPLES * d.inputs.dt_s) / POINTS
    time, op = drawn_step(step_size(d), POINTS, fine)
    middle = d.inputs.middle
    return with_baseline(
        d, "response", (TIME, STEM), time, lambda c: flow(op, alone(c, keep), fine, middle), op
    )


def _pv_length_s(d: Drawing, fast_s: float | None) -> float:
    c = d.best
    times = float(c[Slot.T] + c[Slot.L] + c[Slot.T2] + (c[Slot.MODE_T] if c[Slot.SHARE] != 0 else 0.0))
    if c[Slot.LEAK] == 0:
        times = float(d.plain[Slot.T] + d.plain[Slot.L])
    length = min(PV_LENGTH * times, d.inputs.dt_s * d.inputs.op.size)
    fast = float(c[Slot.L]) + 10.0 * (length if fast_s is None else fast_s)
    return fast if fast < EARLY * length else length


def pv_response(d: Drawing, faster: int | None = None, back: bool = False) -> Picture:
    """PV after a step of OP (and back), of the baseline and the improved process; cut short if the lag of the slot
    `faster`, or the process's own, ends early."""
    inputs = d.inputs
    length = _pv_length_s(d, None if faster is None else float(min(d.best[faster], d.best[Slot.T])))
    dt = min(length / POINTS, inputs.dt_s) if length < POINTS * inputs.dt_s else length / POINTS
    n = min(int(length / dt), 4 * POINTS)
    time, op = drawn_step(min(STEP_PCT, float(np.ptp(inputs.op))), n, dt, back)
    drawn = ModelInputs(op, dt, 0.0, inputs.level, (0.0, 100.0))

    def read(c: Floats) -> Floats:
        return simulate(drawn, alone(c, DYNAMICS))  # without valve, load, clip and the record's start

    return with_baseline(d, "response", (TIME, Axis("PV", "% PV")), time, read, read(d.plain))


def gain_over_pv(d: Drawing) -> Picture:
    """Gain of the process over PV: by slope, by its speed, or as a vessel with a square-root outflow."""
    inputs = d.inputs
    pv = np.linspace(*inputs.pv_range, POINTS)
    x = pv - inputs.level

    def read(k: Floats) -> Floats:
        empty = max(inputs.level, 1.0) / k[Slot.ROOT] if k[Slot.ROOT] > 0 else np.inf
        root = np.sqrt(np.maximum(1.0 + x / empty, 0.0))
        bent = np.maximum(1.0 + k[Slot.SLOPE] * x / 50.0, 0.05)
        scheduled = np.maximum(1.0 + k[Slot.GAIN_SLOPE] * x / 50.0, 0.05)
        return np.asarray(k[Slot.K] * root * bent * scheduled)

    return with_baseline(d, "curve", (PV, GAIN), pv, read, float(d.plain[Slot.K]))


def course_picture(
    d: Drawing,
    axis: Axis,
    values: Callable[[ModelInputs, Floats], Floats],
    rest: float = 0.0,
    last: float = np.inf,
    places: tuple[float, ...] = (),
) -> Picture:
    """A quantity over the recording, shape (n,), from `values` of inputs and parameters, with its value in the
    baseline model; up to the sample `last`, with some times [s] marked."""
    at = np.unique(np.linspace(0, min(last, d.inputs.op.size - 1), COURSE_POINTS).astype(int))
    time = at * d.inputs.dt_s
    return with_baseline(d, "course", (TIME, axis), time, lambda c: values(d.inputs, c)[at], rest, places)


def gain_course(d: Drawing, change: Callable[[ModelInputs, Floats], Floats]) -> Picture:
    """The process gain over the recording, with the given change."""
    return course_picture(d, GAIN, lambda x, c: c[Slot.K] * change(x, c), float(d.plain[Slot.K]))


def load_over_time(d: Drawing) -> Picture:
    """The load at the inlet over the recording."""
    return course_picture(d, LOAD, load)


def most_active(x: Floats, length: int, usable: Mask | None = None) -> slice:
    """The stretch of that many samples in which a signal moves most, without unusable samples."""
    length = min(length, x.size)
    travel = np.abs(np.diff(x, prepend=x[0]))
    if usable is not None:
        travel = np.where(usable, travel, 0.0)
    total = np.concatenate(([0.0], np.cumsum(travel)))
    first = int(np.argmax(total[length:] - total[:-length]))
    return slice(first, first + length)


def biggest_move(x: Floats, length: int, usable: Mask) -> slice:
    """A stretch of that many samples about a signal's biggest move, one third of it before."""
    size = np.where(usable, np.abs(np.diff(x, prepend=x[0])), 0.0)
    length = min(length, x.size)
    first = min(max(int(np.argmax(size)) - length // 3, 0), x.size - length)
    return slice(first, first + length)


def around_run(where: Mask, length: int) -> slice:
    """A stretch about the longest run of a mask."""
    found = runs(where)
    if not found:
        return slice(0, min(length, where.size))
    first, last = max(found, key=lambda r: r[1] - r[0])
    length = min(max(length, 2 * (last - first)), MOST_WINDOW, where.size)
    start = min(max((first + last - length) // 2, 0), where.size - length)
    return slice(start, start + length)


def comb(axis: Axis, at: Floats, count: np.ndarray) -> Picture:
    """Number of occurrences of each value."""
    x, none = np.repeat(at, 3), np.zeros(at.size)
    y = np.stack([none, count, none], axis=1).ravel().astype(float)
    return Picture("comb", axis, Axis("samples", ""), (Drawn("recorded", x, y),))


def rebuilt(e: Floats, op: Floats, kp: float, ti: float) -> Floats:
    """OP of a PI controller with gain [% OP/% PV] and integral time [samples] for an error, shape (n,), with the mean
    of the recorded OP."""
    free = free_path(e, kp, ti)
    return np.asarray(free - free.mean() + op.mean())


def rebuilt_course(s: Recording, part: slice, laws: dict[str, tuple[Floats, StatedSettings]]) -> Picture:
    """A stretch of recorded OP, and OP recomputed from errors, shape (n,), by some laws."""
    time, own = np.arange(part.start, part.stop) * s.dt_s, s.op[part]
    curves = [Drawn(k, time, rebuilt(e[part], own, law.kp, law.ti)) for k, (e, law) in laws.items()]
    return Picture("course", TIME, OP, (*curves, Drawn("recorded", time, own)))


def law_window(s: Recording, ti: float) -> int:
    """Samples of a stretch in which a law is drawn."""
    return int(np.clip(LAW_WINDOW * ti, WINDOW, min(MOST_WINDOW, s.pv.size)))


def by_stated_law(s: Recording, where: Mask | None = None) -> Picture | None:
    """OP about a mask's longest stretch (the most active if None) and as the stated settings would have moved it.

    None without SP or settings.
    """
    if s.sp is None or s.stated is None:
        return None
    length = law_window(s, s.stated.ti)
    part = most_active(s.op, length, s.usable) if where is None else around_run(where[: s.op.size], length)
    return rebuilt_course(s, part, {"stated": (s.sp - s.pv, s.stated)})
