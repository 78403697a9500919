"""Where a candidate starts: steps and lines located in what a fit leaves, and each row's starts, the best first."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter

from identification.estimation.candidate import Fitted, Model, Problem, scales
from identification.estimation.noise import whitened
from identification.estimation.prediction_error import sensitivities
from identification.mismatch.recording import Circumstances
from identification.record import Floats, Mask
from identification.simulation.effect import Variant
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import STEPS, Slot, neutral

ANY = Circumstances()
"""Nothing that would leave an effect out."""
LINES = 4
"""Lines that are tried."""
LEAD = 200
"""Samples of rest before a pulse is whitened; ours: the noise model reaches 117 back."""
JUMPS = 2.0
"""Times that jumps of PV itself must explain more than load steps before they are believed; ours: in steps that came
through the process up to 1.2, in bursts of a sensor from 4 on."""
NEAR, DELAYED = 3, 20
"""Samples about a step's place in which its onset is looked for, and how much later that of a jump of PV; ours."""
GAP_SAMPLES = 5
"""Missing samples from which OP may have moved unseen; ours: an outlier is one or two."""
FORGOTTEN = 3.0
"""Time constants after which a gap's OP is forgotten; ours: a twentieth is left."""
LINE_SIDE = 25
"""Half of the lines whose median is a line's surroundings."""


def step_places(p: Problem, fit: Fitted) -> tuple[int, ...]:
    """Samples at which a step of the load explains the innovations best, greedily, shape (STEPS,)."""
    n = p.y.size
    e = fit.e * (p.weight > 0)
    shut = after_gaps(p, fit)
    pulse = step_pulse(p, fit)
    places: list[int] = []
    for _ in range(STEPS):
        places.append(_best_place(e, pulse, shut))
        part = pulse[: n - places[-1]]
        tail = e[places[-1] :][: part.size]
        part = part[: tail.size]
        e = e.copy()
        e[places[-1] :][: part.size] -= part * float(part @ tail) / max(float(part @ part), 1e-300)
    return tuple(places)


def step_pulse(p: Problem, fit: Fitted) -> Floats:
    """Whitened response to a step of the load at the first sample, shape (n - LEAD,)."""
    n = p.y.size
    one = neutral()
    for slot in (Slot.T, Slot.K):
        one[slot] = fit.model.c[slot]
    one[int(Slot.STEP)] = 1.0
    quiet = replace(p.inputs, op=np.full(n, p.inputs.middle), step_at=(0,))
    return whitened(np.concatenate((np.zeros(LEAD), simulate(quiet, one)))[:n], fit.ar, p.edges)[LEAD:]


def at_inlet(p: Problem, fit: Fitted) -> bool:
    """Whether the steps found by step_places came through the process, or PV jumped by itself, as a sensor does."""
    e = fit.e * (p.weight > 0)
    through = step_pulse(p, fit)
    jump = whitened(np.concatenate((np.zeros(LEAD), np.ones(p.y.size - LEAD))), fit.ar, p.edges)[LEAD:]
    came, jumped = 0.0, 0.0
    for at in dict.fromkeys(p.inputs.step_at):
        came += max(_share(e, through, at + i) for i in range(-NEAR, NEAR + 1))
        jumped += max(_share(e, jump, at + i) for i in range(-NEAR, DELAYED))
    return jumped < JUMPS * came


def _share(e: Floats, pulse: Floats, at: int) -> float:
    """Sum of squares of innovations that a pulse at a sample takes away."""
    at = min(max(at, 0), e.size - 2)
    part = pulse[: e.size - at]
    return float(part @ e[at : at + part.size]) ** 2 / max(float(part @ part), 1e-300)


def after_gaps(p: Problem, fit: Fitted) -> Mask:
    """True in gaps and until what OP did in them has died away in PV, shape (n,): no step can be told there."""
    held = round(float(fit.model.c[Slot.L] + FORGOTTEN * fit.model.c[Slot.T]) / p.inputs.dt_s)
    gone = np.diff(np.concatenate(([0], (~p.usable).astype(np.int8), [0])))
    out = np.zeros(p.y.size, dtype=bool)
    for first, last in zip(np.flatnonzero(gone == 1), np.flatnonzero(gone == -1), strict=True):
        if last - first >= GAP_SAMPLES:
            out[max(first - 1, 0) : last + held] = True
    return out


def _best_place(e: Floats, pulse: Floats, shut: Mask) -> int:
    n, m = e.size, pulse.size
    size = 1 << math.ceil(math.log2(n + m))
    cross = np.fft.irfft(np.fft.rfft(e, size) * np.conj(np.fft.rfft(pulse, size)), size)[:n]
    power = np.cumsum(pulse**2)
    room = power[np.minimum(n - 1 - np.arange(n), m - 1)]
    share = cross**2 / np.maximum(room, 1e-3 * power[-1])
    share[int(0.98 * n) :] = 0.0
    share[: int(0.01 * n)] = 0.0
    share[shut] = 0.0
    return int(np.argmax(share))


def line_frequencies(p: Problem, fit: Fitted) -> tuple[float, ...]:
    """Angular frequencies [rad/s] of the lines that stand out most from their surroundings in the innovations."""
    e = fit.e * (p.weight > 0)
    power = np.abs(np.fft.rfft(e, 2 * e.size)) ** 2
    share = power / np.maximum(median_filter(power, 2 * LINE_SIDE, mode="nearest"), 1e-30)
    share[:8] = 0.0
    share[power.size // 3 :] = 0.0
    found = []
    for _ in range(LINES):
        k = int(np.argmax(share))
        found.append(math.pi * k / (e.size * p.inputs.dt_s))
        share[max(k - 4, 0) : k + 5] = 0.0
    return tuple(found)


@dataclass(frozen=True, slots=True)
class CandidateInputs:
    """A problem with the places and frequencies at which a load may act, and the circumstances of its recording."""

    p: Problem
    omegas: tuple[float, ...]
    known: Circumstances = ANY


def candidate_inputs(p: Problem, fit: Fitted, known: Circumstances = ANY) -> CandidateInputs:
    """Steps and a line located in what a fit leaves."""
    held = p.inputs.step_at if any(r.needs == "steps" for r in fit.model.added) else step_places(p, fit)
    located = replace(p, inputs=replace(p.inputs, step_at=held))
    return CandidateInputs(located, line_frequencies(p, fit), known)


def start_models(x: CandidateInputs, near: Fitted, row: Variant) -> list[Model]:
    """Starts of a row added to a fit."""
    if row.needs == "line":
        return lines(x, near, row)
    out = []
    for start in row.starts:
        c = near.model.c.copy()
        for slot, value in (row.fixed or {}).items():
            c[slot] = value
        for param in row.params:
            offset, factor = scales(x.p.inputs, near.model.c, param)
            c[param.slot] = offset + factor * start.get(int(param.slot), 0.0)
        stood = sum(c[slot] for slot in row.delays) + max(-c[Slot.SHARE] * c[Slot.T], 0.0)
        if row.enter is not None:
            row.enter(c)
        for part in (0.4, 1.0) if stood > 0 else (0.0,):
            shorter = c.copy()
            shorter[Slot.L] = max(c[Slot.L] - part * stood, 0.2 * c[Slot.L])
            out.append(Model((*near.model.added, row), shorter))
    return out


def lines(x: CandidateInputs, near: Fitted, row: Variant) -> list[Model]:
    """Starts of an oscillating load, one a frequency."""
    out = []
    for omega in x.omegas:
        c = near.model.c.copy()
        c[Slot.OMEGA] = omega
        out.append(Model((*near.model.added, row), c))
    return out


def span_of(p: Problem, near: Fitted) -> Floats:
    """Orthonormal directions, shape (n, m), in which a fit's own constants move the weighted innovations."""
    moves = sensitivities(p, near.model, near.ar) * np.sqrt(p.weight)
    return np.linalg.qr(moves.T)[0]


def screened(p: Problem, near: Fitted, span: Floats, models: list[Model]) -> list[Model]:
    """Starts ordered by the innovations that they leave once the fit's own constants have followed, linearly."""
    if len(models) == 1:
        return models
    sized = [on_line(p, near, span, model) for model in models]
    left = [(_left(p, near, span, model), i) for i, model in enumerate(sized)]
    return [sized[i] for _, i in sorted(left)]


def _free(p: Problem, near: Fitted, span: Floats, x: Floats) -> Floats:
    """Weighted innovations of what is left, shape (n,), that a fit's own constants cannot lessen."""
    e = whitened(x, near.ar, p.edges) * np.sqrt(p.weight)
    return e - span @ (span.T @ e)  # type: ignore[no-any-return]


def _left(p: Problem, near: Fitted, span: Floats, model: Model) -> float:
    e = _free(p, near, span, p.y - simulate(p.inputs, model.c))
    return float(e @ e)


def on_line(p: Problem, near: Fitted, span: Floats, model: Model) -> Model:
    """A start with the parameter that PV goes with in a straight line where it leaves least."""
    slot = model.added[-1].linear
    if slot is None:
        return model
    none, one = model.c.copy(), model.c.copy()
    none[slot], one[slot] = 0.0, 1.0
    still = simulate(p.inputs, none)
    along = _free(p, near, span, simulate(p.inputs, one) - still)
    c = model.c.copy()
    c[slot] = float(along @ _free(p, near, span, p.y - still)) / max(float(along @ along), 1e-300)
    return Model(model.added, c)
