"""Whether a recording can answer at all: does PV answer OP, and is it long enough to tell how fast."""

from __future__ import annotations

import math

import numpy as np

from identification.estimation.candidate import Fitted, Problem
from identification.estimation.prediction_error import residual_fit
from identification.mismatch.explanation import Explanation
from identification.mismatch.recording import Recording
from identification.simulation.parameters import Slot

INSENSITIVE = "needs moves of OP that PV answers; without OP the fit is as good"
"""What is said where PV does not answer OP."""
INTEGRATING = ("level",)
"""Loop types that need not settle, of which a short record still tells the slope."""


def brings(p: Problem, fit: Fitted) -> float:
    """Log likelihood [nat] that OP brings to a fit: over the same with no gain, its mean and start as recorded."""
    c = fit.model.c.copy()
    c[Slot.K], c[Slot.BIAS], c[Slot.START] = 0.0, float(np.mean(p.y)), float(p.y[0])
    without = residual_fit(p, c).loss
    return 0.5 * fit.count * math.log(max(without, 1e-300) / max(fit.loss, 1e-300))


def unanswered(found: Explanation) -> str:
    """What is needed where PV does not answer OP; empty where it does.

    Innovations tell, in an experiment too: a load that wanders leaves few errors that count by themselves.
    """
    found = found.by_innovations or found
    loaded = any(
        row.block == "load" for row in found.best.model.added
    )  # a load is counted in terms of the gain
    if brings(found.p, found.plain if loaded else found.best) >= found.p.limits.proof.answers:
        return ""
    return INSENSITIVE


def too_short(found: Explanation, s: Recording) -> str:
    """What is needed where the record is short against the time constant; empty where it is not."""
    enough = found.p.limits.proof.time_constants
    lag, length = float(found.plain.model.c[Slot.T]), s.pv.size * s.dt_s
    if s.kind in INTEGRATING or any(v.replaces for v in found.best.model.added):
        return ""
    if length >= enough * lag:
        return ""
    return (
        f"needs {enough:.0f} time constants, has {length / lag:.2g} "
        f"(a record of {_time(length)}, a time constant of about {_time(lag)})"
    )


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 7200 else f"{seconds / 3600:.3g} h"
