"""The baseline model of a recording: its inputs, the samples judged, and its fit from several starts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.model import Fitted, Model
from identification.estimation.noise import NO_NOISE
from identification.estimation.prediction_error import FULL_STEPS, descended
from identification.estimation.problem import Problem, problem
from identification.estimation.search import plain_processes
from identification.limits import LIMITS, ExplainLimits, RecorderLimits
from identification.mismatch.recording import Recording
from identification.mismatch.reference import flexible_residual
from identification.record import Floats, Mask
from identification.signals.correlation import correlated
from identification.signals.robust import robust_weights
from identification.simulation.open_loop import ModelInputs, as_parameters
from identification.simulation.parameters import Slot


@dataclass(frozen=True, slots=True)
class Clip:
    """A transmitter's range end: its value [% PV], the model's constant, and the samples of PV at it, shape (n,)."""

    value: float
    slot: Slot
    where: Mask


def inputs_of(s: Recording) -> ModelInputs:
    """Model inputs of a recording."""
    level = float(np.mean(s.pv))
    neighbour = s.neighbours[0] - s.neighbours[0].mean() if s.neighbours else None
    span = (float(s.pv.min()), float(s.pv.max()))
    return ModelInputs(s.op, s.dt_s, float(s.op.mean()), level, span, (), neighbour, pv=s.pv - level)


def without_spikes(pv: Floats, usable: Mask, limits: RecorderLimits = LIMITS.recorder) -> Mask:
    """Usable samples without single values far from both neighbours."""
    rise = np.diff(pv)
    alone = np.zeros(pv.size, dtype=bool)
    size = np.median(np.abs(rise)) + 1e-9
    away = np.minimum(np.abs(rise[:-1]), np.abs(rise[1:]))
    alone[1:-1] = (away > limits.spike * size) & (np.sign(rise[:-1]) != np.sign(rise[1:]))
    return usable & ~alone


def prepared(
    inputs: ModelInputs,
    y: Floats,
    usable: Mask,
    user_model: Floats | None = None,
    clip: Clip | None = None,
    limits: ExplainLimits = LIMITS,
    experiment: bool = False,
) -> tuple[Problem, Fitted]:
    """A problem with robustly weighted outliers, and its baseline fit. An experiment is judged by simulation, with
    the memory of the most flexible model's residual, which is nearest to the noise.

    Samples at a clip are left out; those after them count, and the model is clipped too. `user_model` are the
    constants of the user's own model, shape (SIZE,), an additional start.
    """
    p = problem(inputs, y, usable, limits, NO_NOISE if experiment else None)
    if clip is not None:
        p = replace(p, weight=np.where(clip.where, 0.0, p.weight))
    first = plain(p, user_model, clip)
    calm = replace(p, weight=robust_weights(first.e, p.weight > 0))
    fit = descended(calm, first.model, FULL_STEPS)
    if experiment:
        calm = replace(calm, memory=correlated(flexible_residual(calm, fit)[calm.weight > 0]))
        fit = replace(fit, count=calm.independent(fit.e))
    return calm, fit


def plain(p: Problem, user_model: Floats | None = None, clip: Clip | None = None) -> Fitted:
    """The baseline model at its optimum, from several starts."""
    starts = [] if user_model is None else [user_model.copy()]
    for process in plain_processes(p):
        c = as_parameters(process)
        c[Slot.START] = p.y[0]
        c[Slot.BIAS] = float(np.mean(p.y)) - process.gain * float(np.mean(p.inputs.op) - p.inputs.middle)
        starts.append(c)
    if clip is not None:
        for c in starts:
            c[clip.slot] = clip.value
    fits = [descended(p, Model((), c), FULL_STEPS) for c in starts]
    return min(fits, key=lambda fit: fit.loss)
