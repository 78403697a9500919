"""What recorder and controller did, as arrays to draw: each a picture of a finding in its recording."""

from __future__ import annotations

import numpy as np

from identification.controller.check import Finding, StatedSettings, runs
from identification.controller.pi_regression import shifted
from identification.mismatch.pictures import OP, TIME, Axis, Drawn, Picture
from identification.mismatch.recording import Recording
from identification.record import Floats, Mask
from identification.simulation.pi import free_path

WINDOW, MOST_WINDOW = 240, 1500
"""Samples of a stretch that is drawn, and at most; ours: single samples can still be seen."""
HISTOGRAM = 160
"""Classes of a histogram."""
STEPS_SHOWN = 24
"""Steps of a coarse sensor that are drawn."""
LAW_WINDOW = 8.0
"""Length of a stretch with a law, in integral times; ours: a law that is off has drifted away by then."""
GAPS_SHOWN, GAP_CLASSES, FEWEST_IN_CLASS = 4.0, 32, 5
"""Errors up to so many gaps are drawn, in so many classes of size, each of at least so many samples."""
PV = Axis("PV", "%")


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


def comb(name: str, axis: Axis, at: Floats, count: np.ndarray) -> Picture:
    """How often each of some values occurs."""
    x, none = np.repeat(at, 3), np.zeros(at.size)
    y = np.stack([none, count, none], axis=1).ravel().astype(float)
    return Picture(name, "comb", axis, Axis("samples", ""), (Drawn("recorded", x, y),))


def grid(found: Finding, s: Recording, _: Floats) -> Picture:
    """How often each value of PV occurs within some steps of a coarse sensor."""
    middle = float(np.median(s.pv))
    near = s.pv[np.abs(s.pv - middle) <= 0.5 * STEPS_SHOWN * found.values["step_pct"]]
    return comb(found.name, PV, *np.unique(near, return_counts=True))


def spacings(found: Finding, s: Recording, _: Floats) -> Picture:
    """How often each spacing of two stamps occurs."""
    spacing = np.diff(s.stamp_s)
    count, edge = np.histogram(spacing[(spacing > 0) & (spacing < 2 * s.dt_s)], HISTOGRAM)
    return comb(found.name, Axis("time between samples", "s"), 0.5 * (edge[1:] + edge[:-1]), count)


def straight_lines(found: Finding, s: Recording, _: Floats) -> Picture:
    """The busiest stretch of a compressed trend, with the samples that lie on straight lines."""
    part = busiest(s.pv, WINDOW)
    time, x, marked = np.arange(part.start, part.stop) * s.dt_s, s.pv[part], found.where[part]
    curves = (Drawn("points", time[marked], x[marked]), Drawn("recorded", time, x))
    return Picture(found.name, "course", TIME, PV, curves)


def range_end(found: Finding, s: Recording, free: Floats) -> Picture:
    """The stretch in which PV stands at its end longest, with the model that goes on."""
    part = around(found.where, WINDOW)
    time = np.arange(part.start, part.stop) * s.dt_s
    end = np.full(time.size, found.values["clip_pct"])
    curves = (
        Drawn("found", time, free[part]),
        Drawn("recorded", time, s.pv[part]),
        Drawn("limit", time, end),
    )
    return Picture(found.name, "course", TIME, PV, curves)


def gap_profile(found: Finding, s: Recording, _: Floats) -> Picture | None:
    """How often OP stands still, over the size of the error, with the gap's end; None without SP."""
    if s.sp is None:
        return None
    width = found.values["gap_pct"]
    still = np.diff(s.op, prepend=s.op[0]) == 0
    edges = np.linspace(0.0, GAPS_SHOWN * width, GAP_CLASSES + 1)
    at = np.digitize(np.abs(s.sp - s.pv)[s.usable], edges) - 1
    count = np.bincount(at, minlength=GAP_CLASSES + 1)[:GAP_CLASSES]
    stood = np.bincount(at, still[s.usable], minlength=GAP_CLASSES + 1)[:GAP_CLASSES]
    held = count >= FEWEST_IN_CLASS
    middle = 0.5 * (edges[1:] + edges[:-1])
    curve = Drawn("recorded", middle[held], 100.0 * stood[held] / count[held])
    x, y = Axis("size of SP − PV", "%"), Axis("OP stands still", "% of samples")
    return Picture(found.name, "curve", x, y, (curve,), (width,))


def rebuilt(e: Floats, op: Floats, kp: float, ti: float) -> Floats:
    """OP that a PI of gain [% OP/% PV] and integral time [samples] gives for an error, shape (n,), with the mean of
    the recorded OP."""
    free = free_path(e, kp, ti)
    return np.asarray(free - free.mean() + op.mean())


def rebuilt_course(
    name: str, s: Recording, part: slice, laws: dict[str, tuple[Floats, StatedSettings]]
) -> Picture:
    """A stretch of recorded OP, and OP rebuilt from errors, shape (n,), by some laws."""
    time, own = np.arange(part.start, part.stop) * s.dt_s, s.op[part]
    curves = [Drawn(k, time, rebuilt(e[part], own, law.kp, law.ti)) for k, (e, law) in laws.items()]
    return Picture(name, "course", TIME, OP, (*curves, Drawn("recorded", time, own)))


def law_window(s: Recording, ti: float) -> int:
    """Samples of a stretch in which a law is drawn."""
    return int(np.clip(LAW_WINDOW * ti, WINDOW, min(MOST_WINDOW, s.pv.size)))


def by_stated_law(name: str, s: Recording, where: Mask | None = None) -> Picture | None:
    """OP about a mask's longest stretch (the busiest where None) and as the stated settings would have moved it.

    None without SP or settings.
    """
    if s.sp is None or s.stated is None:
        return None
    length = law_window(s, s.stated.ti)
    part = busiest(s.op, length, s.usable) if where is None else around(where[: s.op.size], length)
    return rebuilt_course(name, s, part, {"stated": (s.sp - s.pv, s.stated)})


def outside_law(found: Finding, s: Recording, _: Floats) -> Picture | None:
    """OP about the longest stretch outside the law, and as the stated settings would have moved it."""
    return by_stated_law(found.name, s, found.where)


def other_settings(found: Finding, s: Recording, _: Floats) -> Picture | None:
    """OP over its busiest stretch, rebuilt by the settings found and by those stated; None without SP or settings."""
    if s.sp is None or s.stated is None:
        return None
    part, e = busiest(s.op, law_window(s, s.stated.ti), s.usable), s.sp - s.pv
    own = StatedSettings(found.values["kp"], found.values["ti_samples"])
    return rebuilt_course(found.name, s, part, {"found": (e, own), "stated": (e, s.stated)})


def other_clock(found: Finding, s: Recording, _: Floats) -> Picture | None:
    """OP about its biggest move, rebuilt with PV as stamped and with its clock set right; None without settings."""
    if s.sp is None or s.stated is None:
        return None
    part = biggest_move(s.sp if float(np.ptp(s.sp)) > 0 else s.op, WINDOW // 4, s.usable)
    right = s.sp - shifted(s.pv, found.values["late_samples"])
    laws = {"found": (right, s.stated), "stated": (s.sp - s.pv, s.stated)}
    return rebuilt_course(found.name, s, part, laws)
