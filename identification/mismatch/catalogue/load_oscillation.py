"""A sinusoidal load at the inlet of the process."""

import math

from identification.mismatch.effect import Block, Effect, Estimate, Param, Parameters, Slot, Variant, exact
from identification.mismatch.pictures import LOAD, Drawing, Picture, course_picture
from identification.simulation.open_loop import load

PERIODS = 6
"""Periods that are drawn."""
FREE = (
    Param(Slot.SINE, "sine_pct", "% OP", -30.0, 30.0, hidden=True),
    Param(Slot.COSINE, "cosine_pct", "% OP", -30.0, 30.0, hidden=True),
    Param(Slot.OMEGA, "angular_frequency", "rad/s", 0.0, 10.0, hidden=True),
)


def period_and_amplitude(own: Parameters) -> dict[str, Estimate]:
    """Period [s] and amplitude [% OP]."""
    w, sine, cosine = own["angular_frequency"], own["sine_pct"], own["cosine_pct"]
    period, low, high = (2 * math.pi / max(x, 1e-9) for x in (w.value, w.high, w.low))
    half = max(e.high - e.value for e in (sine, cosine))
    size = exact(math.hypot(sine.value, cosine.value), "% OP", half)
    return {"period_s": Estimate(period, low, high, "s"), "amplitude_pct": size}


def few_periods(d: Drawing) -> Picture:
    """The load over its first periods."""
    samples = PERIODS * 2 * math.pi / max(float(d.best[Slot.OMEGA]) * d.inputs.dt_s, 1e-9)
    return course_picture(d, LOAD, load, last=samples)


EFFECT = Effect(
    name="load-oscillation",
    block=Block.LOAD,
    sentence="An external oscillation with a period of {period_s} enters the loop.",
    check="Look upstream for a loop or machine that runs at that period.",
    tests={
        "stiction": "Put the loop in manual: an external oscillation continues, a sticking valve's ends.",
        "coupling": "The other loop in manual for a few periods.",
    },
    needs="line",
    timed=True,
    derived=period_and_amplitude,
    titles={"period_s": "Period", "amplitude_pct": "Amplitude"},
    curve=few_periods,
    variants=(Variant(FREE, ({Slot.SINE: 0.0, Slot.COSINE: 0.0},)),),
)
