"""Starts of the search for an effect: steps and lines located in a fit's residual, the starts of each variant in
order, and two-mode processes solved on a grid."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.ndimage import median_filter

from identification.controller.check import runs
from identification.estimation.model import Fitted, Model
from identification.estimation.noise import whitened
from identification.estimation.prediction_error import SCREEN_STEPS, descended, scales, sensitivities
from identification.estimation.problem import Problem
from identification.mismatch.recording import Recording
from identification.record import Floats, Mask
from identification.simulation.open_loop import simulate, through_valve
from identification.simulation.parameters import STEPS, Slot, Variant, neutral
from identification.simulation.vessel import plain_vessel

MODES_KEPT = 2  # Starts with two modes that are kept under each noise model: bounds the time
LINES = 4  # Lines of the spectrum at which an oscillating load is tried: bounds the time
LINE_SIDE = 25  # Half of the lines whose median is a line's surroundings [lines]
PV_JUMPS = 2.0
"""Least ratio of what jumps of PV itself explain to what load steps explain, for jumps to be accepted. It
is at most 1.2 for steps through the process and at least 4 for bursts of a sensor."""
STEP_NEAR = 3  # How far from a step's place its onset is looked for [samples]
JUMP_LATE = 20  # How much later than a step's place the onset of a jump of PV is looked for [samples]
GAP_SAMPLES = 5  # Missing samples from which OP may have moved unseen [samples]: an outlier is one or two
FORGOTTEN = 3.0  # Time constants after which a gap's OP is forgotten: a twentieth is left
HELD_OUT = 0.35
"""Last part of the record that is held out when the winner is proven: two thirds to fit, one to prove."""

LEAD = 200  # Rest before a pulse is whitened [samples]: the noise model reaches 117 back
DELAYS = 40
"""Largest number of dead times tried for two modes, from none to that of the baseline model: a missing lag or
zero has lengthened it; a mode that answers at once is found to the sample alone."""
LONGER = (0.7, 1.0, 1.4, 2.0)  # Time constants tried for the first mode, over that of the baseline model
LEADING = 0.95  # First coefficient of the uninformed noise model: nearly a difference


def early_part(p: Problem) -> tuple[Problem, int]:
    """The problem with only the first part of the record to be fitted, and the first sample held out."""
    cut = int((1.0 - HELD_OUT) * p.y.size)
    return replace(p, weight=np.where(np.arange(p.y.size) < cut, p.weight, 0.0)), cut


def fitted_early(p: Problem, fit: Fitted) -> Fitted:
    """A fit's model refitted to the first part of the record; a model's START is of its first sample."""
    return descended(early_part(p)[0], fit.model, SCREEN_STEPS)


@dataclass(frozen=True)
class Round:
    """One round of the search: a problem with the possible times of load steps, a fit to which effects are added, the
    recording, which selects the candidates, and the frequencies of possible loads [rad/s]."""

    p: Problem
    near: Fitted
    s: Recording
    omegas: tuple[float, ...] = ()

    @cached_property
    def directions(self) -> Floats:
        """Orthonormal directions in which the fit's own constants move its weighted innovations, shape (n, m)."""
        moves = sensitivities(self.p, self.near.model, self.near.ar) * np.sqrt(self.p.weight)
        return np.linalg.qr(moves.T)[0]

    @cached_property
    def early(self) -> Fitted:
        """The fit refitted to the first part of the record; every candidate must be better on the rest."""
        return fitted_early(self.p, self.near)

    def free(self, x: Floats) -> Floats:
        """Part of the weighted innovations, shape (n,), that the fit's own constants cannot reduce linearly."""
        e = whitened(x, self.near.ar, self.p.edges) * np.sqrt(self.p.weight)
        return e - self.directions @ (self.directions.T @ e)  # type: ignore[no-any-return]

    def residual_squares(self, model: Model) -> float:
        """Sum of squares of this part under a model."""
        e = self.free(self.p.y - simulate(self.p.inputs, model.c))
        return float(e @ e)

    def linearly_adjusted(self, model: Model) -> Model:
        """A start with its linear parameter at the least residual."""
        slot = model.added[-1].linear
        if slot is None:
            return model
        none, one, c = model.c.copy(), model.c.copy(), model.c.copy()
        none[slot], one[slot] = 0.0, 1.0
        still = simulate(self.p.inputs, none)
        along = self.free(simulate(self.p.inputs, one) - still)
        c[slot] = float(along @ self.free(self.p.y - still)) / max(float(along @ along), 1e-300)
        return Model(model.added, c)


def round_of(p: Problem, near: Fitted, s: Recording) -> Round:
    """A round with steps and lines located in a fit's residual."""
    held = p.inputs.step_at if any(r.needs == "steps" for r in near.model.added) else step_places(p, near)
    located = replace(p, inputs=replace(p.inputs, step_at=held))
    return Round(located, near, s, line_frequencies(p, near))


def step_places(p: Problem, fit: Fitted) -> tuple[int, ...]:
    """Samples at which a load step explains the innovations best, chosen greedily, shape (STEPS,)."""
    e = fit.e * (p.weight > 0)
    shut, pulse = after_gaps(p, fit), step_pulse(p, fit)
    places: list[int] = []
    for _ in range(STEPS):
        at = _best_place(e, pulse, shut)
        places.append(at)
        part = pulse[: p.y.size - at]
        tail = e[at : at + part.size]
        tail -= part * float(part @ tail) / max(float(part @ part), 1e-300)
    return tuple(places)


def step_pulse(p: Problem, fit: Fitted) -> Floats:
    """Whitened response to a step of the load at the first sample, shape (n - lead,)."""
    one = neutral()
    one[Slot.T], one[Slot.K], one[Slot.STEP] = fit.model.c[Slot.T], fit.model.c[Slot.K], 1.0
    quiet = replace(p.inputs, op=np.full(p.y.size, p.inputs.middle), step_at=(0,))
    return _pulse(simulate(quiet, one), p, fit)


def _pulse(answer: Floats, p: Problem, fit: Fitted) -> Floats:
    """A response whitened after a lead of rest, shape (n - lead,)."""
    led = np.concatenate((np.zeros(LEAD), answer))[: p.y.size]
    return whitened(led, fit.ar, p.edges)[LEAD:]


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


def after_gaps(p: Problem, fit: Fitted) -> Mask:
    """True in gaps and until their OP moves have decayed in PV, shape (n,): no step can be identified there."""
    held = round(float(fit.model.c[Slot.L] + FORGOTTEN * fit.model.c[Slot.T]) / p.inputs.dt_s)
    out = np.zeros(p.y.size, dtype=bool)
    for first, last in runs(~p.usable):
        out[max(first - 1, 0) : last + held] |= last - first >= GAP_SAMPLES
    return out


def at_inlet(p: Problem, fit: Fitted) -> bool:
    """Whether the steps found by step_places came through the process; otherwise PV jumped, as with a sensor."""
    e = fit.e * (p.weight > 0)
    through, jump = step_pulse(p, fit), _pulse(np.ones(p.y.size), p, fit)
    near, came, jumped = STEP_NEAR, 0.0, 0.0
    for at in dict.fromkeys(p.inputs.step_at):
        came += max(_share(e, through, at + i) for i in range(-near, near + 1))
        jumped += max(_share(e, jump, at + i) for i in range(-near, JUMP_LATE))
    return jumped < PV_JUMPS * came


def _share(e: Floats, pulse: Floats, at: int) -> float:
    """Reduction of the sum of squares of innovations by a pulse at a sample."""
    at = min(max(at, 0), e.size - 2)
    part = pulse[: e.size - at]
    return float(part @ e[at : at + part.size]) ** 2 / max(float(part @ part), 1e-300)


def line_frequencies(p: Problem, fit: Fitted) -> tuple[float, ...]:
    """Angular frequencies [rad/s] of the innovations' lines with the highest power over their surroundings."""
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


def start_models(x: Round, row: Variant) -> list[Model]:
    """Starts of a row added to a fit; for an oscillating load one per frequency."""
    on_lines = tuple({int(Slot.OMEGA): w} for w in x.omegas)
    begun, out = x.near.model, []
    for start in on_lines if row.needs == "line" else row.starts:
        c = row.set_in(begun.c)
        for param in row.params:
            offset, factor = scales(x.p.inputs, begun.c, param)
            c[param.slot] = offset + factor * start.get(int(param.slot), 0.0)
        delay = sum(c[slot] for slot in row.delays) + max(-c[Slot.SHARE] * c[Slot.T], 0.0)
        if row.enter is not None:
            row.enter(c)
        for part in (0.4, 1.0) if delay > 0 else (0.0,):
            shorter = c.copy()
            shorter[Slot.L] = max(c[Slot.L] - part * delay, 0.2 * c[Slot.L])
            out.append(Model((*begun.added, row), shorter))
    return out


def screened(x: Round, models: list[Model]) -> list[Model]:
    """Starts ordered by their residual innovations after a linear adjustment of the fit's own constants."""
    return models if len(models) == 1 else sorted(map(x.linearly_adjusted, models), key=x.residual_squares)


def mode_starts(p: Problem, near: Fitted, row: Variant) -> list[Model]:
    """Starts of a two-mode row whose second mode has the share of gain that defines the row."""
    blind = np.zeros_like(near.ar)
    blind[:1] = LEADING
    out = []
    for ar in (near.ar, blind) if near.ar.size else (near.ar,):
        models = [model for _, model in sorted(grid_of_modes(p, near, row, ar), key=lambda point: point[0])]
        low, high = row.mode_share
        out += [model for model in models if low < model.c[Slot.SHARE] < high][:MODES_KEPT]
    return out


def grid_of_modes(p: Problem, near: Fitted, row: Variant, ar: Floats) -> Iterator[tuple[float, Model]]:
    """Residual of each grid point under one noise model, and its model; both gains are solved linearly."""
    dt_s, t0, dead0 = p.inputs.dt_s, float(near.model.c[Slot.T]), float(near.model.c[Slot.L])
    y, level = whitened(p.y, ar, p.edges), whitened(np.ones(p.y.size), ar, p.edges)
    firsts, others = [t0 * f for f in LONGER], [t0 * f for f in row.modes]
    found = responses(p, near, {*firsts, *others}, ar)
    longest = min(math.ceil(dead0 / dt_s), p.y.size - 1)
    for samples in range(0, longest + 1, longest // DELAYS + 1):
        late = {t: np.concatenate((np.full(samples, x[0]), x[: x.size - samples])) for t, x in found.items()}
        for first, other in product(firsts, others):
            rows = np.stack([late[first], late[other], level])
            weighted = rows * p.weight
            beta = np.linalg.lstsq(weighted @ rows.T, weighted @ y, rcond=1e-12)[0]
            (one, two), squares = beta[:2], float((p.weight * y) @ y - beta @ (weighted @ y))
            c = near.model.c.copy()
            c[Slot.T], c[Slot.L], c[Slot.MODE_T] = first, samples * dt_s, max(other, 0.1 * dt_s)
            c[Slot.K], c[Slot.SHARE] = one + two, two / (one + two) if one + two != 0 else np.inf
            yield squares, Model((*near.model.added, row), c)


def responses(p: Problem, near: Fitted, times: set[float], ar: Floats) -> dict[float, Floats]:
    """Whitened unit responses without dead time, each shape (n,), of lags with these time constants [s]."""
    inputs, c = p.inputs, near.model.c.copy()
    through, still = through_valve(inputs, c), np.zeros(inputs.op.size)
    c[Slot.K], c[Slot.BIAS], c[Slot.START], c[Slot.L] = 1.0, 0.0, 0.0, 0.0
    out = {}
    for t in times:
        c[Slot.T] = max(t, 0.1 * inputs.dt_s)
        out[t] = whitened(plain_vessel(through, still, c, inputs.dt_s, inputs.middle), ar, p.edges)
    return out
