"""Pictures of a process: PV after a step of OP, and the gain over PV."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.drawn import POINTS, Axis, Drawing, Drawn, Shape, banded, step
from identification.record import Floats
from identification.simulation.open_loop import ModelInputs, simulate
from identification.simulation.parameters import Slot, neutral

STEP_PCT = 10.0
"""Size of the step whose response is drawn, OP's range where that is less [% OP]."""
LENGTHS = 5.0
"""Length of a response, in dead time and all time constants together."""
EARLY = 0.25
"""A response is drawn to ten of its shortest lags where that is less than this part of the whole."""
DYNAMICS = (Slot.T, Slot.L, Slot.K, Slot.T2, Slot.T3, Slot.SHARE, Slot.MODE_T, Slot.ASYMMETRY, Slot.LEAK)
"""Parameters of the process's own dynamics."""


def resting(c: Floats) -> Floats:
    """A model's process alone, shape (SIZE,): valve, load, clip and the record's start taken out."""
    out = neutral()
    for slot in DYNAMICS:
        out[slot] = c[slot]
    return out


def _length_s(d: Drawing, fast_s: float | None) -> float:
    c = d.best
    times = float(c[Slot.T] + c[Slot.L] + c[Slot.T2] + (c[Slot.MODE_T] if c[Slot.SHARE] != 0 else 0.0))
    if c[Slot.LEAK] == 0:
        times = float(d.plain[Slot.T] + d.plain[Slot.L])
    length = min(LENGTHS * times, d.inputs.dt_s * d.inputs.op.size)
    fast = float(c[Slot.L]) + 10.0 * (length if fast_s is None else fast_s)
    return fast if fast < EARLY * length else length


def pv_response(d: Drawing, fast_s: float | None = None, back: bool = False) -> Shape:
    """PV after a step of OP (and back down again), of the plain and the improved process.

    Parameters
    ----------
    d : Drawing
    fast_s : float or None
        A lag whose work is over early [s], to which the picture is cut where the rest is long.
    back : bool
        Whether the step goes back.
    """
    inputs, length = d.inputs, _length_s(d, fast_s)
    dt = min(length / POINTS, inputs.dt_s) if length < POINTS * inputs.dt_s else length / POINTS
    n = min(int(length / dt), 4 * POINTS)
    time, op = step(min(STEP_PCT, float(np.ptp(inputs.op))), n, dt, back)
    drawn = ModelInputs(op, dt, 0.0, inputs.level, (0.0, 100.0))

    def read(k: Floats) -> Floats:
        return simulate(drawn, resting(k))

    y, low, high = banded(read, d)
    curves = (Drawn("found", time, y, low, high), Drawn("plain", time, read(d.plain)))
    return Shape(d.name, "response", Axis("time", "s"), Axis("PV", "% PV"), curves)


def gain_over_pv(d: Drawing) -> Shape:
    """Gain of the process over PV: by slope, by its speed, or as a vessel with a rooted outflow."""
    inputs = d.inputs
    pv = np.linspace(*inputs.pv_range, POINTS)
    x = pv - inputs.level

    def read(k: Floats) -> Floats:
        empty = max(inputs.level, 1.0) / k[Slot.ROOT] if k[Slot.ROOT] > 0 else np.inf
        root = np.sqrt(np.maximum(1.0 + x / empty, 0.0))
        bent = np.maximum(1.0 + k[Slot.SLOPE] * x / 50.0, 0.05)
        scheduled = np.maximum(1.0 + k[Slot.GAIN_SLOPE] * x / 50.0, 0.05)
        return np.asarray(k[Slot.K] * root * bent * scheduled)

    y, low, high = banded(read, d)
    plain = np.full(POINTS, float(d.plain[Slot.K]))
    curves = (Drawn("found", pv, y, low, high), Drawn("plain", pv, plain))
    return Shape(d.name, "curve", Axis("PV", "%"), Axis("gain", "% PV/% OP"), curves)
