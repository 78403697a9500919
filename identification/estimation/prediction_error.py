"""Prediction-error fit of a model with any additions: its residual, the descent, and deviations of its constants.

The descent of the batch run in gauss_newton.py is its fast path for a lag behind a valve.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.descent import Descent, damped_step, down, inverse, nats, scattered
from identification.estimation.model import Fitted, Model
from identification.estimation.noise import fitted, lag_means, whitened
from identification.estimation.problem import Problem
from identification.record import Floats
from identification.simulation.open_loop import ModelInputs, simulate
from identification.simulation.parameters import Param, Slot

SCREEN_STEPS = 5  # Gauss-Newton steps in the first round: bounds the time

FULL_STEPS = 20  # Gauss-Newton steps of the candidates that are followed: bounds the time

SETTLED = 0.025  # Gain of a step below which the descent ends [nat]
PROMISES = 5.0
"""Multiple of the next step's predicted gain by which a candidate of the first round may be below
WORTH_FOLLOWING, otherwise it ends: of 2,727 descents on 40 cases of another seed two would have come there,
of valves that are scanned anyway."""
START_SCATTER = 1.0
"""Standard deviation of the model's first value about the recorded one, which short time constants need [%
PV]."""
BIAS_SCATTER = 20.0  # Standard deviation of the model's bias about the record's mean [% PV]

PLACES = (-1.0, -0.5, 0.0, 0.5, 1.0)  # Possible first stem positions, relative to OP [of the breakaway]
PLACE_WORTH = 3.0  # Gain of another place from which it is taken [nat]: what a parameter costs
DAMPINGS = 5  # Dampings tried for a step of explain's fits
FAR = 3000.0  # Residual from which a model counts as diverged [% PV]


def scales(inputs: ModelInputs, c: Floats, param: Param) -> tuple[float, float]:
    """Offset and factor that convert a row's numbers to the unit of the constant."""
    op = inputs.op
    reach = max(float(np.ptp(op)), 1e-6)
    match param.scale:
        case "op":
            return 0.0, reach
        case "op/dt":
            return 0.0, reach / inputs.dt_s
        case "opspan":
            return float(op.min()), reach
        case "1/op":
            return 0.0, 100.0 / reach
        case "1/pv":
            return 0.0, 50.0 / max(inputs.pv_range[1] - inputs.pv_range[0], 1e-6)
        case "pvspan":
            return inputs.pv_range[0], inputs.pv_range[1] - inputs.pv_range[0]
        case "T":
            return 0.0, float(c[Slot.T])
        case "dt":
            return 0.0, inputs.dt_s
        case "span":
            return 0.0, inputs.dt_s * op.size
    return 0.0, 1.0


def bounds(inputs: ModelInputs, c: Floats, param: Param) -> tuple[float, float]:
    """Lowest and highest value of a constant, in its unit."""
    if param.slot == Slot.T:
        longest = 2.0 * inputs.dt_s * inputs.op.size
        return 0.3 * inputs.dt_s, longest if c[Slot.LEAK] == 0 else min(longest, inputs.longest_s)
    offset, factor = scales(inputs, c, param)
    return offset + factor * param.low, offset + factor * param.high


PRIOR = (Slot.START, Slot.BIAS)
"""Constants poorly determined with a short time constant or random-walk load; a prior holds them."""


@dataclass(frozen=True, slots=True)
class Residual:
    """Residual of a model and its best noise model.

    simulated : simulated PV [% PV], shape (n,); ar : noise model, shape (groups,). The others include the weights:
    columns, lag means of the residual, shape (groups, n), gram, their products, white, the innovations, shape (n,),
    and loss, their mean square.
    """

    model: Model
    simulated: Floats
    columns: Floats
    gram: Floats
    ar: Floats
    white: Floats
    loss: float


def residual_fit(p: Problem, model: Model) -> Residual:
    """Residual, noise model and innovations of a model."""
    simulated = simulate(p.inputs, model.c)
    r = p.judged_part(p.y - simulated)
    groups, root, total = p.edges.size - 1, np.sqrt(p.weight), float(p.weight.sum())
    if not float(np.abs(r).max()) < FAR:
        none = np.zeros((groups, r.size)), np.zeros((groups, groups)), np.zeros(groups)
        return Residual(model, simulated, *none, FAR * root, FAR**2)
    columns, weighted = lag_means(r, p.edges), r * root
    columns *= root
    ar, gram = fitted(columns, weighted)
    white = weighted - ar @ columns
    return Residual(model, simulated, columns, gram, ar, white, float(white @ white) / total)


def step_of(inputs: ModelInputs, c: Floats, param: Param) -> float:
    """Step of the numeric derivative of a constant, in its unit."""
    if param.log:
        return 0.01 * float(c[param.slot])
    if param.slot == Slot.L:
        return 0.05 * inputs.dt_s
    if param.scale in ("op", "opspan"):
        return 2e-3 * float(np.ptp(inputs.op))
    if param.slot == Slot.OMEGA:
        return 0.02 * 2 * math.pi / (inputs.dt_s * inputs.op.size)
    return 0.01 * max(abs(float(c[param.slot])), 0.1)


def sensitivities(p: Problem, model: Model, ar: Floats, here: Floats | None = None) -> Floats:
    """Whitened derivatives of the simulation by the free constants (logarithms where so searched), (m, n).

    `here` is the model's exact simulation, if known: a constant without effect must have a derivative of zero.
    """
    here = simulate(p.inputs, model.c) if here is None else here
    out = np.empty((len(model.params), p.y.size))
    for i, param in enumerate(model.params):
        c, h = model.c.copy(), step_of(p.inputs, model.c, param)
        if c[param.slot] + h > bounds(p.inputs, model.c, param)[1]:
            h = -h
        c[param.slot] += h
        slope = (simulate(p.inputs, c) - here) / (h / model.c[param.slot] if param.log else h)
        out[i] = whitened(p.judged_part(np.clip(slope, -1e9, 1e9)), ar, p.edges)
    return out


def moved(p: Problem, model: Model, step: Floats) -> Model:
    """The model after a step in its free constants, kept within bounds."""
    c = model.c.copy()
    for param, s in zip(model.params, step, strict=True):
        low, high = bounds(p.inputs, model.c, param)
        value = c[param.slot]
        value = value * math.exp(min(max(s, -1.5), 1.5)) if param.log else value + s
        c[param.slot] = min(max(value, low), high)
    if c[Slot.JUMP] > c[Slot.STICKBAND]:
        c[Slot.JUMP] = c[Slot.STICKBAND]
    return replace(model, c=c)


def curvature(p: Problem, found: Residual) -> tuple[Floats, Floats, Floats]:
    """Gauss-Newton matrix of the constants with the noise model eliminated, the gradient, and the weighted
    derivatives of the innovations that form them, shape (m, n)."""
    model = found.model
    moves = sensitivities(p, model, found.ar, found.simulated) * np.sqrt(p.weight)
    own, groups = found.columns, found.ar.size
    inner = found.gram + 1e-10 * np.trace(found.gram) / max(groups, 1) * np.eye(groups)
    coupling = own @ moves.T
    gram, slope = moves @ moves.T, moves @ found.white
    if groups:
        cross = np.linalg.lstsq(inner, np.column_stack((coupling, own @ found.white)), rcond=1e-13)[0]
        gram -= coupling.T @ cross[:, :-1]
        slope -= coupling.T @ cross[:, -1]
    for i, param in enumerate(model.params):
        if param.slot in PRIOR:
            at_start = param.slot == Slot.START
            aim = p.y[0] if at_start else 0.0
            scatter = START_SCATTER if at_start else BIAS_SCATTER
            held = found.loss / scatter**2
            gram[i, i] += held
            slope[i] += held * (aim - model.c[param.slot])
    return gram, slope, moves


def is_out_of_reach(p: Problem, found: Residual, gram: Floats, slope: Floats, aim: float) -> bool:
    """Whether the target loss is out of reach even if the next steps gain several times the predicted amount."""
    if math.isinf(aim):
        return False
    promised = float(slope @ damped_step(gram, slope, 1e-6)) / max(float(found.white @ found.white), 1e-300)
    return math.log(max(found.loss, 1e-300) / aim) > PROMISES * max(promised, 0.0)


def _with_place(model: Model, place: float) -> Model:
    c = model.c.copy()
    c[Slot.PLACE] = place
    return replace(model, c=c)


def placed(p: Problem, model: Model) -> Model:
    """The model with the initial stem position estimated from PV; no slip has occurred before the record begins."""
    if not model.c[Slot.STICKBAND] > 0.0:
        return model
    first = float(model.c[Slot.PLACE])
    losses = {place: residual_fit(p, _with_place(model, place)).loss for place in (first, *PLACES)}
    best = min(losses, key=lambda place: losses[place])
    return _with_place(model, best) if nats(p.count, losses[first], losses[best]) > PLACE_WORTH else model


def descended(p: Problem, model: Model, steps: int, aim: float = math.inf) -> Fitted:
    """Descend to the smallest innovations; with friction, the initial stem position is estimated before and after.

    model : start; steps : largest number of steps of each descent; aim : largest loss of interest. From the second
    step on, a descent that cannot reach it ends.
    """
    fit = _descend(p, placed(p, model), steps, aim)
    again = placed(p, fit.model)
    return fit if again is fit.model else _descend(p, again, steps, aim)


def _descend(p: Problem, model: Model, steps: int, aim: float) -> Fitted:
    """Damped Gauss-Newton steps from a model to the smallest innovations."""

    def curved(p: Problem, found: Residual, taken: int) -> tuple[bool, Floats, Floats]:
        gram, slope, _ = curvature(p, found)
        return taken == 0 or not is_out_of_reach(p, found, gram, slope, aim), gram, slope

    def stepped(p: Problem, found: Residual, step: Floats) -> Residual:
        return residual_fit(p, moved(p, found.model, step))

    ends = Descent(steps, DAMPINGS * steps, p.count, SETTLED, 20.0, 10.0, DAMPINGS - 1)
    best = down(p, residual_fit(p, model), curved, stepped, ends)
    e = innovations_of(p, best)
    return Fitted(p, best.model, best.loss, p.independent(e), best.ar, e)


def innovations_of(p: Problem, found: Residual) -> Floats:
    """Innovations [% PV], shape (n,), including those with zero weight."""
    if not found.loss < FAR**2:
        return np.full(p.y.size, FAR)
    residual = p.judged_part(p.y - found.simulated)
    return whitened(residual, found.ar, p.edges)  # type: ignore[no-any-return]


def deviations(p: Problem, fit: Fitted, held: Collection[int] = ()) -> Floats:
    """Standard deviations of the free constants (of logarithms where so searched), shape (m,); see descent.py.

    held : indices of constants that are not free; their deviations are zero.
    """
    found = residual_fit(p, fit.model)
    gram, _, moves = curvature(p, found)
    if not np.isfinite(gram).all():
        return np.full(gram.shape[0], np.inf)
    follow = np.linalg.lstsq(found.gram, found.columns @ moves.T, rcond=1e-13)[0]
    scores = (moves - follow.T @ found.columns) * found.white
    free = np.array([i for i, q in enumerate(fit.model.params) if q.slot not in held])
    spread = scattered(inverse(gram[np.ix_(free, free)]), scores[free].T, fit.loss)
    out = np.zeros(gram.shape[0])
    out[free] = np.sqrt(np.maximum(np.diag(spread), 0.0))
    return out
