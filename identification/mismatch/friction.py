"""Valves with friction, which a descent from a guess does not find: starts of the search, and the valid horizon.

Real friction differs from slip to slip. In open simulation over hours, a model of constant friction loses the stem
position, and the likelihood, at the first early or late slip: the innovations have narrow optima. So stickband and
jump are scanned, or started from the loop's cycles, stretch by stretch. Over one cycle, from the true stem position,
such a model shows what the valve does to PV: the position is the state at a window's start, estimated from the window
itself; the constants do not change.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
from numba import njit

from identification.estimation.backlash_stiction import local_minima
from identification.estimation.descent import compass
from identification.estimation.model import Fitted, Model
from identification.estimation.noise import generic_noise
from identification.estimation.prediction_error import FULL_STEPS, SCREEN_STEPS, descended, residual_fit
from identification.estimation.problem import Problem, in_blocks
from identification.mismatch.effect import Friction
from identification.mismatch.outside import about
from identification.mismatch.recording import SeenInCycles
from identification.mismatch.starts import Round
from identification.models import Backlash, Stiction, Valve
from identification.record import Floats
from identification.signals.filters import stretch_ends
from identification.simulation.open_loop import as_parameters, from_flow, simulate
from identification.simulation.parameters import Signal, Slot, Variant, acted, alone
from identification.simulation.valve import IDEAL, StemLaw, moved_stem, sticking
from identification.simulation.valve_chain import before_stem, behind_stem, friction_of, with_friction

STARTS = 3  # Starts of a candidate, or of a stem with mass, that are followed to the end: bounds the time
MASSES_MOVED = 20  # Starts of a stem with mass that are moved by small steps: bounds the time
MASS_MOVES = 40  # Small steps by which such a start is moved at most: bounds the time

PLACES = 9  # Places of the stem that are tried within its friction band: an eighth of the band apart
WIDTHS = (0.9, 1.8, 10)
"""First and last of the stickbands tried for a stem with mass, in widths of the best backlash, and their
number [of the backlash]: of 18 simulated stems of dry friction they were 1.1 to 1.8."""
JUMPS = (0.4, 0.6, 0.8)  # Jumps that are tried of a stem with mass [of the stickband]
TIMES = (0.12, 0.25, 0.5)
"""Natural times that are tried of a stem with mass [samples]: faster stems move within a sample, slower ones
are a lag."""
STEPS = (0.08, 0.04, 0.02, 0.01)
"""Relative steps of the search of a stem with mass: a pit is a tenth of the stickband wide."""
DEAD_STEPS = 4.0  # Dead time that a step of one takes [samples]
CARRIED_ON = 0.9
"""Sum of squares with another position over that with the continued stem, from which the stem is placed
again."""

WEARS = (Friction.BACKLASH, Friction.STICKS)
"""Roles of the effects of a worn valve."""
OF_CYCLES = (Slot.T, Slot.L, Slot.K, Slot.STICKBAND, Slot.JUMP, Slot.COAST)
"""Parameters that the cycles determine."""
MOVES = (
    *((1, 0, 0, 0), (-1, 0, 0, 0), (0, 1, 0, 0), (0, -1, 0, 0)),
    *((0, 0, 1, 0), (0, 0, -1, 0), (0, 0, 0, 1), (0, 0, 0, -1), (1, 1, 0, 0), (-1, -1, 0, 0)),
)
"""Compass moves in stickband, jump, natural time and dead time."""


def is_friction(name: str) -> bool:
    """Whether an effect is backlash or stick-slip, which cycles can show."""
    return about(name).friction in WEARS


def fit_sticking(p: Problem, backlash: Fitted, row: Variant, rows: tuple[Variant, ...]) -> Fitted:
    """The best sticking valve of the form `row`, with `rows`, near a fit whose last row is backlash: its stem is
    searched as in the batch run, or with its mass, and followed to the end with all other effects."""
    model = Model((*rows, row), row.set_in(backlash.model.c))
    has_mass = any(q.slot == Slot.STEM_T for q in row.params)
    begun = _with_mass(p, model) if has_mass else _scanned_starts(p, backlash, model)
    return min((descended(p, m, 2 * SCREEN_STEPS) for m in begun), key=lambda fit: fit.loss)


def _scanned_starts(p: Problem, backlash: Fitted, model: Model) -> list[Model]:
    """Starts at the local optima of stickband and jump from a batch-run scan."""
    behind, c = _behind(p, backlash.model.c), model.c
    near = replace(backlash, p=behind, ar=generic_noise(), slow=np.zeros(4)).moved(
        time_constant_s=min(float(c[Slot.T]), behind.bounds[0]),
        valve=sticking(float(c[Slot.STICKBAND]), 0.0),
    )
    out = []
    for found in local_minima(near, (friction_of(c).tolerance,)):
        c = c.copy()
        c[Slot.STICKBAND], c[Slot.JUMP] = found.valve.stickband, found.valve.slip_jump
        c[Slot.L] = found.dead_time_s
        out.append(Model(model.added, c))
    return out


def _with_mass(p: Problem, model: Model) -> list[Model]:
    """The best starts of stems with mass: a scan of stickbands near the backlash width, jumps and natural times,
    refined by decreasing steps, because slips make narrow optima that a descent misses."""
    scanned = []
    widths = np.geomspace(*WIDTHS)
    for width, share, samples in product(widths, JUMPS, TIMES):
        c = model.c.copy()
        c[Slot.STICKBAND] *= width
        c[Slot.JUMP] = share * c[Slot.STICKBAND]
        c[Slot.STEM_T] = samples * p.inputs.dt_s
        c[Slot.L] = max(c[Slot.L] - c[Slot.STEM_T], 0.0)
        trial = Model(model.added, c)
        scanned.append((residual_fit(p, trial).loss, trial))
    best = sorted(scanned, key=lambda pair: pair[0])[:MASSES_MOVED]
    most, steps = MASS_MOVES, STEPS
    moved = (compass(p, trial, loss, _heavier, MOVES, steps, most=most) for loss, trial in best)
    return [trial for trial, _ in sorted(moved, key=lambda pair: pair[1])[:STARTS]]


def _heavier(p: Problem, model: Model, move: tuple[int, ...], step: float) -> tuple[Model, float]:
    """A stem with mass with another stickband, jump, natural time and dead time, and its loss."""
    c = model.c.copy()
    for slot, sign in zip((Slot.STICKBAND, Slot.JUMP, Slot.STEM_T), move, strict=False):
        c[slot] *= math.exp(step * sign)
    c[Slot.L] = max(c[Slot.L] + move[3] * step * DEAD_STEPS * p.inputs.dt_s, 0.0)
    if c[Slot.JUMP] > c[Slot.STICKBAND]:
        return model, math.inf
    trial = Model(model.added, c)
    return trial, residual_fit(p, trial).loss


def _behind(p: Problem, c: Floats) -> Problem:
    """The problem for a lag behind a valve: OP at the stem's input, PV without the model's other effects."""
    inputs, plain = p.inputs, alone(c, (*OF_CYCLES, Slot.BIAS, Slot.START, Slot.LEAK))
    op = before_stem(np.ascontiguousarray(acted(Signal.OP, inputs.op, c, inputs.dt_s)), c, inputs.dt_s)
    y = p.y - simulate(inputs, c) + simulate(inputs, plain)
    return in_blocks(y, op, p.usable, inputs.dt_s)


def from_cycles(x: Round, seen: SeenInCycles, rows: tuple[Variant, ...]) -> list[Fitted]:
    """Friction rows added to a fit, each followed to the end from the valve identified in the cycles."""
    out, p, near = [], x.p, x.near
    for row in rows:
        valve = _valve_for(row, seen.valve) if is_friction(row.name) else None
        if valve is not None:
            model = Model((*near.model.added, row), _begun(p, near, seen, valve))
            out.append(descended(p, model, FULL_STEPS))
    return out


def _valve_for(row: Variant, valve: Backlash | Stiction) -> Valve:
    """The identified valve in the form of a catalogue row; None if the row has another motion."""
    if about(row.name).friction is Friction.BACKLASH:
        return Backlash(valve.width if isinstance(valve, Backlash) else valve.stickband)
    return valve if isinstance(valve, Stiction) and row.label == valve.motion else None


def _begun(p: Problem, near: Fitted, seen: SeenInCycles, valve: Valve) -> Floats:
    """Constants of a fit with process and valve from the cycles, shape (SIZE + own,)."""
    c, identified = near.model.c.copy(), as_parameters(seen.process, valve)
    for slot in OF_CYCLES:
        c[slot] = identified[slot]
    c[Slot.START] = p.y[0]
    c[Slot.BIAS] = float(np.mean(p.y)) - c[Slot.K] * float(np.mean(p.inputs.op) - p.inputs.middle)
    return c


def simulated_reestimated(p: Problem, c: Floats, window: int) -> Floats:
    """PV's deviation [% PV], shape (n,), for constants, shape (SIZE + own,), the stem re-estimated every `window`
    samples; as simulate() without friction."""
    inputs = p.inputs
    if friction_of(c).breakaway <= 0.0:
        return simulate(inputs, c)
    flow = behind_stem(stem_reestimated(p, c, window), c, inputs.dt_s, inputs.middle)
    return from_flow(inputs, c, acted(Signal.FLOW, flow, c, inputs.dt_s))


def stem_reestimated(p: Problem, c: Floats, window: int) -> Floats:
    """The stem [% OP], shape (n,), behind the friction of constants, re-estimated every `window` samples."""
    inputs = p.inputs
    op = before_stem(np.ascontiguousarray(acted(Signal.OP, inputs.op, c, inputs.dt_s)), c, inputs.dt_s)
    dead = round(float(c[Slot.L]) / inputs.dt_s)
    pole = math.exp(-inputs.dt_s / max(float(c[Slot.T]), 1e-9))
    mass, ends = (float(c[Slot.STEM_T]), inputs.dt_s), stretch_ends(op.size, window)
    return stem_placed(op, p.y, ends, dead, pole, float(c[Slot.K]), friction_of(c), mass)  # type: ignore[no-any-return]


def behind_placed(p: Problem, c: Floats, window: int) -> tuple[Problem, Floats]:
    """The problem with the stem, re-estimated every `window` samples, in place of OP, and the constants without
    friction: a process can be fitted to it as behind an ideal valve."""
    stem = stem_reestimated(p, c, window)
    return replace(p, inputs=replace(p.inputs, op=stem)), with_friction(c, IDEAL)


@njit(cache=True)
def _residual_squares(
    op: Floats,
    y: Floats,
    first: int,
    last: int,
    dead: int,
    pole: float,
    gain: float,
    friction: StemLaw,
    mass: tuple[float, float],
    stem: float,
    x: float,
    out: Floats,
) -> tuple[float, float, float]:
    """Squares of the PV residual about a line for a stem with a given start; final stem and lag; `out` is its path.

    mass : natural time of the stem, 0 without mass, and of a sample [s].
    """
    state = (stem, 0.0, op[first])
    n = t1 = t2 = r0 = r1 = r2 = 0.0
    for k in range(first, last):
        out[k], state = moved_stem(state, op[k], friction, mass[0], mass[1])
        stem = out[k]
        x = pole * x + (1.0 - pole) * stem
        if k + dead < y.size:
            r, t = y[k + dead] - gain * x, float(k - first)
            n, t1, t2 = n + 1.0, t1 + t, t2 + t * t
            r0, r1, r2 = r0 + r, r1 + r * t, r2 + r * r
    if n < 3.0:
        return 0.0, state[0], x
    spread = t2 - t1 * t1 / n
    slope = (r1 - t1 * r0 / n) / spread if spread > 0.0 else 0.0
    return r2 - r0 * r0 / n - slope * (r1 - t1 * r0 / n), state[0], x


@njit(cache=True)
def stem_placed(
    op: Floats,
    y: Floats,
    ends: np.ndarray,
    dead: int,
    pole: float,
    gain: float,
    friction: StemLaw,
    mass: tuple[float, float],
) -> Floats:
    """Stem [% OP], shape (n,), estimated in each window by least residual of PV, or carried on."""
    out, trial = np.empty_like(op), np.empty_like(op)
    stem, x = op[0], op[0]
    for i in range(ends.size - 1):
        first, last = ends[i], ends[i + 1]
        least, stem_on, x_on = _residual_squares(
            op, y, first, last, dead, pole, gain, friction, mass, stem, x, out
        )
        least *= CARRIED_ON
        for j in range(PLACES):
            place = op[first] + friction.breakaway * (2.0 * j / (PLACES - 1) - 1.0)
            squares, stem_j, x_j = _residual_squares(
                op, y, first, last, dead, pole, gain, friction, mass, place, x, trial
            )
            if squares < least:
                least, stem_on, x_on = squares, stem_j, x_j
                out[first:last] = trial[first:last]
        stem, x = stem_on, x_on
    return out
