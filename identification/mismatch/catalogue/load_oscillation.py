"""A sine that enters at the process's inlet."""

from __future__ import annotations

import math

import numpy as np

from identification.mismatch.curves.course import COURSE_POINTS, course, load_over_time
from identification.mismatch.curves.drawn import Axis, Drawing, Shape
from identification.mismatch.effect import Block, Effect, Parameters, exact
from identification.models import Estimate
from identification.simulation.effect import Param, Variant
from identification.simulation.parameters import Slot

PERIODS = 6
"""Periods that are drawn."""


def period_and_amplitude(own: Parameters) -> dict[str, Estimate]:
    """Period [s] and amplitude [% OP]."""
    w = own["angular_frequency"]
    low, high = (2 * math.pi / max(x, 1e-9) for x in (w.high, w.low))
    size = math.hypot(own["sine_pct"].value, own["cosine_pct"].value)
    half = max(e.high - e.value for e in (own["sine_pct"], own["cosine_pct"]))
    period = Estimate(2 * math.pi / max(w.value, 1e-9), low, high, "s")
    return {"period_s": period, "amplitude_pct": exact(size, "% OP", half)}


def few_periods(d: Drawing) -> Shape:
    """The load over its first periods."""
    samples = PERIODS * 2 * np.pi / max(float(d.best[Slot.OMEGA]) * d.inputs.dt_s, 1e-9)
    at = np.unique(np.linspace(0, min(samples, d.inputs.op.size - 1), COURSE_POINTS).astype(int))
    return course(d, at, load_over_time(d, at), Axis("load at the inlet", "% OP"))


EFFECT = Effect(
    name="load-oscillation",
    block=Block.LOAD,
    sentence="An outside oscillation with a period of {period_s} enters the loop.",
    check="Look upstream for a loop or machine that runs at that period.",
    tests={
        "stiction": "Put the loop in manual: an outside oscillation goes on, a sticking valve's ends.",
        "coupling": "The other loop in manual for a few periods.",
    },
    needs="line",
    timed=True,
    derived=period_and_amplitude,
    titles={"period_s": "Period", "amplitude_pct": "Amplitude"},
    curve=few_periods,
    variants=(
        Variant(
            (
                Param(Slot.SINE, "sine_pct", "% OP", -30.0, 30.0, hidden=True),
                Param(Slot.COSINE, "cosine_pct", "% OP", -30.0, 30.0, hidden=True),
                Param(Slot.OMEGA, "angular_frequency", "rad/s", 0.0, 10.0, hidden=True),
            ),
            ({Slot.SINE: 0.0, Slot.COSINE: 0.0},),
        ),
    ),
)
