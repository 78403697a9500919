"""The shape of a finding about recorder, sensor or controller: values on their grid, stamps, OP rebuilt by a law."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.controller.check import ControllerFinding, Stated, runs
from identification.controller.pi_regression import shifted
from identification.mismatch.curves.shape import Axis, Drawn, Shape
from identification.record import Floats, Mask

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Recording
    from identification.mismatch.recording_faults import RecorderFinding

WINDOW = 240
"""Samples of a stretch that is drawn; ours: single samples can still be seen."""
LAW_WINDOW = 8.0
"""The same for a controller, in its integral times; ours: a law that is off has drifted away by then."""
MOST_WINDOW = 1500
"""Samples of a stretch at most."""
GAPS_SHOWN = 4.0
"""Errors up to this many gaps are drawn."""
GAP_CLASSES = 32
"""Classes of the error's size up to there."""
FEWEST_IN_CLASS = 5
"""Samples that a class needs to be drawn."""
HISTOGRAM = 160
"""Classes of a histogram."""
STEPS_SHOWN = 24
"""Steps of a coarse sensor that are drawn."""


def busiest(x: Floats, length: int, usable: Mask | None = None) -> slice:
    """The stretch of that many samples in which a signal travels most, samples not usable left out of account."""
    length = min(length, x.size)
    travel = np.abs(np.diff(x, prepend=x[0]))
    if usable is not None:
        travel = np.where(usable, travel, 0.0)
    total = np.concatenate(([0.0], np.cumsum(travel)))
    first = int(np.argmax(total[length:] - total[:-length]))
    return slice(first, first + length)


def biggest_move(x: Floats, length: int, usable: Mask) -> slice:
    """A stretch of that many samples about a signal's biggest move, a third of it before."""
    size = np.where(usable, np.abs(np.diff(x, prepend=x[0])), 0.0)
    length = min(length, x.size)
    first = min(max(int(np.argmax(size)) - length // 3, 0), x.size - length)
    return slice(first, first + length)


def around(where: Mask, length: int) -> slice:
    """A stretch about the longest run of a mask."""
    found = runs(where)
    if not found:
        return slice(0, min(length, where.size))
    first, last = max(found, key=lambda r: r[1] - r[0])
    length = min(max(length, 2 * (last - first)), MOST_WINDOW, where.size)
    start = min(max((first + last - length) // 2, 0), where.size - length)
    return slice(start, start + length)


def rebuilt(e: Floats, op: Floats, kp: float, ti: float) -> Floats:
    """OP that a PI gives for an error, shape (n,), its constant set to the recorded OP's mean.

    Parameters
    ----------
    e, op : ndarray of shape (n,)
        Error [% PV] and OP [% OP].
    kp, ti : float
        Gain [% OP/% PV] and integral time [samples].
    """
    free = kp * (e + np.cumsum(e) / ti)
    return np.asarray(free - free.mean() + op.mean())


def grid(pv: Floats, step: float) -> Shape:
    """How often each value of PV occurs within some steps of a coarse sensor."""
    middle = float(np.median(pv))
    near = pv[np.abs(pv - middle) <= 0.5 * STEPS_SHOWN * step]
    levels, count = np.unique(near, return_counts=True)
    x = np.repeat(levels, 3)
    y = (np.stack([np.zeros(levels.size), count, np.zeros(levels.size)], axis=1)).ravel().astype(float)
    return Shape("quantization", "comb", Axis("PV", "%"), Axis("samples", ""), (Drawn("recorded", x, y),))


def straightened(pv: Floats, where: Mask, dt_s: float) -> Shape:
    """A stretch of a compressed trend, with the samples that lie on straight lines."""
    part = busiest(pv, WINDOW)
    time, x, marked = np.arange(part.start, part.stop) * dt_s, pv[part], where[part]
    curves = (Drawn("points", time[marked], x[marked]), Drawn("recorded", time, x))
    return Shape("compression", "course", Axis("time", "s"), Axis("PV", "%"), curves)


def spacings(stamp_s: Floats, dt_s: float) -> Shape:
    """How often each spacing of two stamps occurs."""
    spacing = np.diff(stamp_s)
    near = spacing[(spacing > 0) & (spacing < 2 * dt_s)]
    count, edge = np.histogram(near, HISTOGRAM)
    x = np.repeat(0.5 * (edge[1:] + edge[:-1]), 3)
    y = np.stack([np.zeros(count.size), count, np.zeros(count.size)], axis=1).ravel().astype(float)
    return Shape(
        "sampling", "comb", Axis("time between samples", "s"), Axis("samples", ""), (Drawn("recorded", x, y),)
    )


def clip(pv: Floats, at: float, dt_s: float, where: Mask, model: Floats) -> Shape:
    """The stretch in which PV stands at its end longest, with the model that goes on."""
    part = around(where, WINDOW)
    time = np.arange(part.start, part.stop) * dt_s
    free = model[part]
    curves = (
        Drawn("found", time, free),
        Drawn("recorded", time, pv[part]),
        Drawn("limit", time, np.full(time.size, at)),
    )
    return Shape("sensor-clipping", "course", Axis("time", "s"), Axis("PV", "%"), curves)


def recorder_shape(t: RecorderFinding, s: Recording, model: Floats) -> Shape | None:
    """The shape of a finding about the recording; `model` is the simulated PV without its clip, shape (n,)."""
    match t.name:
        case "quantization":
            return grid(s.pv, t.value)
        case "compression":
            return straightened(s.pv, t.where, s.dt_s)
        case "sampling":
            return spacings(s.stamp_s, s.dt_s)
        case "sensor-clipping":
            return clip(s.pv, t.value, s.dt_s, t.where, model)
    return None


def gap_profile(e: Floats, op: Floats, width: float, usable: Mask) -> Shape:
    """How often OP stands still, over the size of the error, with the gap's end."""
    still = np.diff(op, prepend=op[0]) == 0
    size = np.abs(e)
    edges = np.linspace(0.0, GAPS_SHOWN * width, GAP_CLASSES + 1)
    at = np.digitize(size[usable], edges) - 1
    count = np.bincount(at, minlength=GAP_CLASSES + 1)[:GAP_CLASSES]
    stood = np.bincount(at, still[usable], minlength=GAP_CLASSES + 1)[:GAP_CLASSES]
    held = count >= FEWEST_IN_CLASS
    middle = 0.5 * (edges[1:] + edges[:-1])
    curve = Drawn("recorded", middle[held], 100.0 * stood[held] / count[held])
    return Shape(
        "controller-gap",
        "curve",
        Axis("size of SP − PV", "%"),
        Axis("OP stands still", "% of samples"),
        (curve,),
        (width,),
    )


def law_course(name: str, e: Floats, op: Floats, part: slice, dt_s: float, laws: dict[str, Stated]) -> Shape:
    """A stretch of recorded OP, and OP rebuilt from the error by some laws."""
    time = np.arange(part.start, part.stop) * dt_s
    cut, own = e[part], op[part]
    curves = [Drawn(k, time, rebuilt(cut, own, law.kp, law.ti)) for k, law in laws.items()]
    return Shape(name, "course", Axis("time", "s"), Axis("OP", "%"), (*curves, Drawn("recorded", time, own)))


def law_window(s: Recording, ti: float) -> int:
    """Samples of a stretch in which a law is drawn."""
    return int(np.clip(LAW_WINDOW * ti, WINDOW, min(MOST_WINDOW, s.pv.size)))


def controller_shape(r: ControllerFinding, s: Recording) -> Shape | None:
    """The shape of a finding about clock or controller; None without SP or settings."""
    if s.sp is None or s.stated is None:
        return None
    e, said = s.sp - s.pv, s.stated
    part = busiest(s.op, law_window(s, said.ti), s.usable)
    match r.name:
        case "controller-gap":
            return gap_profile(e, s.op, r.values["gap_pct"], s.usable)
        case "controller-settings":
            found = Stated(r.values["kp"], r.values["ti_samples"])
            return law_course(r.name, e, s.op, part, s.dt_s, {"found": found, "stated": said})
        case "clock-offset":
            return clock_course(s, said, r.values["late_samples"])
        case "controller-logic":
            where = around(r.where[: s.op.size], law_window(s, said.ti))
            return law_course(r.name, e, s.op, where, s.dt_s, {"stated": said})
    return None


def clock_course(s: Recording, said: Stated, late: float) -> Shape:
    """OP about its busiest stretch, rebuilt with PV as stamped and with PV's clock set right."""
    assert s.sp is not None
    part = biggest_move(s.sp if float(np.ptp(s.sp)) > 0 else s.op, WINDOW // 4, s.usable)
    time, own = np.arange(part.start, part.stop) * s.dt_s, s.op[part]
    both = {"found": s.sp - shifted(s.pv, late), "stated": s.sp - s.pv}
    curves = [Drawn(k, time, rebuilt(e[part], own, said.kp, said.ti)) for k, e in both.items()]
    return Shape(
        "clock-offset", "course", Axis("time", "s"), Axis("OP", "%"), (*curves, Drawn("recorded", time, own))
    )


def obeyed(s: Recording) -> Shape | None:
    """OP rebuilt by the stated settings over its busiest stretch; None without SP or settings."""
    if s.sp is None or s.stated is None:
        return None
    part = busiest(s.op, law_window(s, s.stated.ti), s.usable)
    return law_course("controller", s.sp - s.pv, s.op, part, s.dt_s, {"stated": s.stated})
