"""The plain loop of a recording, and what the most flexible model of no name leaves of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.noise import NO_NOISE, lag_means, whitened
from identification.estimation.prediction_error import (
    Fitted,
    Model,
    Problem,
    correlated,
    descended,
    problem,
    sensitivities,
)
from identification.estimation.start_values import plain_processes
from identification.limits import LIMITS, REFERENCE, ExplainLimits, RecorderLimits
from identification.mismatch.recording import Recording
from identification.record import Floats, Mask
from identification.signals.robust import robust_weights
from identification.simulation.lag import lagged
from identification.simulation.open_loop import ModelInputs, as_parameters, simulate, through_valve
from identification.simulation.parameters import Slot
from identification.simulation.vessel import plain_vessel


@dataclass(frozen=True, slots=True)
class Clip:
    """A transmitter's end: its value [% PV], whether it is the upper one, and where PV stands at it, shape (n,)."""

    value: float
    upper: bool
    where: Mask


def inputs_of(s: Recording) -> ModelInputs:
    """What drives the model of a recording."""
    level = float(np.mean(s.pv))
    neighbour = s.neighbours[0] - s.neighbours[0].mean() if s.neighbours else None
    span = (float(s.pv.min()), float(s.pv.max()))
    return ModelInputs(s.op, s.dt_s, float(s.op.mean()), level, span, (), neighbour, pv=s.pv - level)


def without_spikes(pv: Floats, usable: Mask, limits: RecorderLimits = LIMITS.recorder) -> Mask:
    """Usable samples less single values that stand far off both neighbours."""
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
    brought: Floats | None = None,
    clip: Clip | None = None,
    limits: ExplainLimits = LIMITS,
    experiment: bool = False,
) -> tuple[Problem, Fitted]:
    """A problem whose outliers count less, and its plain fit; an experiment's is judged by simulation.

    Samples at a clip are left out; those after them still count, and the model is clipped too. `brought` are the
    constants of the user's own model, shape (SIZE,), one start more.
    """
    p = problem(inputs, y, usable, limits, NO_NOISE if experiment else None)
    if clip is not None:
        p = replace(p, weight=np.where(clip.where, 0.0, p.weight))
    first = plain(p, brought, clip)
    calm = replace(p, weight=robust_weights(first.e, p.weight > 0))
    fit = descended(calm, first.model, p.limits.search.full_steps)
    return with_memory(calm, fit) if experiment else (calm, fit)


def plain(p: Problem, brought: Floats | None = None, clip: Clip | None = None) -> Fitted:
    """The plain loop at its optimum, from several starts."""
    starts = [] if brought is None else [brought.copy()]
    for process in plain_processes(p.y, p.inputs.op, p.usable, p.inputs.dt_s):
        c = as_parameters(process)
        if clip is not None:
            c[Slot.CLIP_HI if clip.upper else Slot.CLIP_LO] = clip.value
        c[Slot.START] = p.y[0]
        c[Slot.BIAS] = float(np.mean(p.y)) - process.gain * float(np.mean(p.inputs.op) - p.inputs.middle)
        starts.append(c)
    fits = [descended(p, Model((), c), p.limits.search.full_steps) for c in starts]
    return min(fits, key=lambda fit: fit.loss)


def with_memory(p: Problem, fit: Fitted) -> tuple[Problem, Fitted]:
    """An experiment and its fit, with the memory of what the most flexible model leaves: the nearest to its noise."""
    left = left_freely(p, fit)
    known = replace(p, memory=correlated(left[p.weight > 0]))
    return known, replace(fit, count=known.independent(fit.e))


def unfollowed(p: Problem, fit: Fitted) -> Callable[[Floats], Floats]:
    """Takes from signals, shape (n,) or (n, m), weighted as innovations are, what a fit's own constants and its noise
    model can follow linearly."""
    r = p.y - simulate(p.inputs, fit.model.c)
    own = np.concatenate((sensitivities(p, fit.model, fit.ar), lag_means(r, p.edges))) * np.sqrt(p.weight)
    span = np.linalg.qr(np.nan_to_num(own).T)[0]
    return lambda x: x - span @ (span.T @ x)


def left_freely(p: Problem, fit: Fitted) -> Floats:
    """What the flexible model leaves of a fit's weighted innovations, shape (n,)."""
    c, root, rest = fit.model.c, np.sqrt(p.weight), unfollowed(p, fit)
    through = through_valve(p.inputs, c)
    free = past_moves(p, c, through) + bent_moves(p, c, through)
    e = rest(fit.e * root)
    more = rest((np.stack([whitened(x, fit.ar, p.edges) for x in free]) * root).T)
    q, scale = np.linalg.qr(more)
    kept = np.abs(np.diag(scale)) > 1e-8 * np.abs(np.diag(scale)).max()
    return e - q[:, kept] @ (q[:, kept].T @ e)  # type: ignore[no-any-return]


def past_moves(p: Problem, c: Floats, through: Floats) -> list[Floats]:
    """Means of OP behind the valve over past stretches, each shape (n,)."""
    n, dt_s = through.size, p.inputs.dt_s
    length_s = min(REFERENCE.reach * float(c[Slot.T] + c[Slot.L]), REFERENCE.most_reach * n * dt_s)
    width = max(round(length_s / REFERENCE.boxes / dt_s), REFERENCE.least_box)
    total = np.concatenate(([0.0], np.cumsum(through - through.mean())))
    at = [np.maximum(np.arange(n) - i * width, 0) for i in range(REFERENCE.boxes + 1)]
    return [(total[at[i]] - total[at[i + 1]]) / width for i in range(REFERENCE.boxes)]


def bent_moves(p: Problem, c: Floats, through: Floats) -> list[Floats]:
    """Responses to OP's fast part by size, to its square and to its cube, each shape (n,)."""
    dt_s, moves = p.inputs.dt_s, []
    for share in (0.1, 0.5):
        fast = through - lagged(through, max(share * float(c[Slot.T]), dt_s), dt_s)
        moves += [fast * np.abs(fast), np.abs(fast)]
    level = through - through.mean()
    moves += [level**2, level**3]
    return [response(x, c, dt_s) for x in moves]


def response(x: Floats, c: Floats, dt_s: float) -> Floats:
    """Response of PV to a load at the inlet, shape (n,), of unit gain with a model's lag and dead time."""
    unit = c.copy()
    unit[[Slot.K, Slot.BIAS, Slot.START]] = 1.0, 0.0, 0.0
    return plain_vessel(x - x[0], np.zeros(x.size), unit, dt_s, 0.0)
