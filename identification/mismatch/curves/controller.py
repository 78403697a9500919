"""Pictures of a controller: OP rebuilt from the error by a law, and how often OP stands still."""

from __future__ import annotations

import numpy as np

from identification.controller.check import StatedSettings
from identification.controller.pi_regression import shifted
from identification.mismatch.curves.drawn import Axis, Drawn, Shape
from identification.mismatch.curves.stretches import MOST_WINDOW, WINDOW, around, biggest_move, busiest
from identification.mismatch.recording import Recording
from identification.record import Floats, Mask
from identification.simulation.pi import free_path

LAW_WINDOW = 8.0
"""Length of a stretch that is drawn, in integral times; ours: a law that is off has drifted away by then."""
GAPS_SHOWN = 4.0
"""Errors up to this many gaps are drawn."""
GAP_CLASSES = 32
"""Classes of the error's size up to there."""
FEWEST_IN_CLASS = 5
"""Samples that a class needs to be drawn."""


def rebuilt(e: Floats, op: Floats, kp: float, ti: float) -> Floats:
    """OP that a PI gives for an error, shape (n,), its constant set to the recorded OP's mean.

    Parameters
    ----------
    e, op : ndarray of shape (n,)
        Error [% PV] and OP [% OP].
    kp, ti : float
        Gain [% OP/% PV] and integral time [samples].
    """
    free = free_path(e, kp, ti)
    return np.asarray(free - free.mean() + op.mean())


def gap_profile(name: str, e: Floats, op: Floats, width: float, usable: Mask) -> Shape:
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
        name,
        "curve",
        Axis("size of SP − PV", "%"),
        Axis("OP stands still", "% of samples"),
        (curve,),
        (width,),
    )


def law_course(
    name: str, e: Floats, op: Floats, part: slice, dt_s: float, laws: dict[str, StatedSettings]
) -> Shape:
    """A stretch of recorded OP, and OP rebuilt from the error by some laws."""
    time = np.arange(part.start, part.stop) * dt_s
    cut, own = e[part], op[part]
    curves = [Drawn(k, time, rebuilt(cut, own, law.kp, law.ti)) for k, law in laws.items()]
    return Shape(name, "course", Axis("time", "s"), Axis("OP", "%"), (*curves, Drawn("recorded", time, own)))


def law_window(s: Recording, ti: float) -> int:
    """Samples of a stretch in which a law is drawn."""
    return int(np.clip(LAW_WINDOW * ti, WINDOW, min(MOST_WINDOW, s.pv.size)))


def rebuilt_course(name: str, s: Recording, found: StatedSettings) -> Shape | None:
    """OP over its busiest stretch, rebuilt by the settings found and by those stated; None without SP or settings."""
    if s.sp is None or s.stated is None:
        return None
    part = busiest(s.op, law_window(s, s.stated.ti), s.usable)
    return law_course(name, s.sp - s.pv, s.op, part, s.dt_s, {"found": found, "stated": s.stated})


def by_stated_law(name: str, s: Recording, where: Mask | None = None) -> Shape | None:
    """OP about a mask's longest stretch (the busiest where None) and as the stated settings would have moved it.

    None without SP or settings.
    """
    if s.sp is None or s.stated is None:
        return None
    length = law_window(s, s.stated.ti)
    part = busiest(s.op, length, s.usable) if where is None else around(where[: s.op.size], length)
    return law_course(name, s.sp - s.pv, s.op, part, s.dt_s, {"stated": s.stated})


def clock_course(name: str, s: Recording, late: float) -> Shape | None:
    """OP about its biggest move, rebuilt with PV as stamped and with its clock set right; None without settings."""
    if s.sp is None or s.stated is None:
        return None
    said = s.stated
    part = biggest_move(s.sp if float(np.ptp(s.sp)) > 0 else s.op, WINDOW // 4, s.usable)
    time, own = np.arange(part.start, part.stop) * s.dt_s, s.op[part]
    both = {"found": s.sp - shifted(s.pv, late), "stated": s.sp - s.pv}
    curves = [Drawn(k, time, rebuilt(e[part], own, said.kp, said.ti)) for k, e in both.items()]
    return Shape(name, "course", Axis("time", "s"), Axis("OP", "%"), (*curves, Drawn("recorded", time, own)))


def obeyed(s: Recording) -> Shape | None:
    """OP rebuilt by the stated settings over its busiest stretch; None without SP or settings."""
    if s.sp is None or s.stated is None:
        return None
    part = busiest(s.op, law_window(s, s.stated.ti), s.usable)
    return law_course("controller", s.sp - s.pv, s.op, part, s.dt_s, {"stated": s.stated})
