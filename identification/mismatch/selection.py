"""One round of candidates added to a fit: every variant of the catalogue is started, screened, refined and ranked by
its penalised gain."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from identification.estimation.model import Fitted, Model, gain
from identification.estimation.prediction_error import FULL_STEPS, SCREEN_STEPS, descended
from identification.estimation.problem import Problem
from identification.mismatch.candidate_proof import is_one_move
from identification.mismatch.catalogue import CANDIDATES
from identification.mismatch.effect import PARAMETER_PENALTY, SEARCH_PENALTY, Friction
from identification.mismatch.friction import STARTS, fit_sticking
from identification.mismatch.outside import about
from identification.mismatch.recording import Recording
from identification.mismatch.reference import SETTLES
from identification.mismatch.starts import Round, mode_starts, screened, start_models
from identification.simulation.parameters import Slot, Variant, neutral

HIDDEN_PENALTY = 1.0
"""Gain that a constant of an experiment has to bring that is not reported [nat]: a knot of a course, the start of
a record. Source: Akaike 1974: what chance brings on average."""
FOLLOWED = 6  # Candidates that are followed to the end from several starts: bounds the time
WORTH_FOLLOWING = -6.0
"""Penalised gain from which a candidate of the first round is continued [nat]: of 242 below it on the same
cases one came to anything, 0.6."""
MAY_COME_TO = 0.5
"""Share of the required gain from which a candidate is followed, if that is known: 83 sealed cases and seven
rigs are answered as where all are followed."""
SAME = 1.0
"""Gain by which a model may be below one with one more constant and still count as equally good [nat]: twice
what chance brings."""
STICKING_HINT = 6.0
"""Gain of backlash, or of a coarsely started sticking valve, from which stiction is scanned finely [nat]:
bounds the time."""
COURSE_LEAVES = 0.3
"""Part of an experiment's misfit (mean square) that a supply may leave to be reported without its own gain: a
heater that failed leaves .18."""
COURSE_FROM = 0.4
"""Least misfit of the baseline model in that case, over PV's spread: loads that are no effect move PV less
than OP does."""

Progress = Callable[[str], None]
KNOWN_TYPES = ("flow", "pressure", "temperature", "level")
"""Loop types for which a row may be excluded; any other text is ignored."""
NEEDS: Mapping[str, Callable[[Round], bool]] = {
    "every scan": lambda x: x.s.every_scan,
    "experiment": lambda x: x.p.by_simulation,
    "moves": lambda x: not is_one_move(x.p),
    "neighbour": lambda x: x.p.inputs.neighbour is not None,
}
"""Tests of whether the recording has what a row needs; needs not listed here are always met."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A fitted candidate: its gain over the previous fit, and its penalised gain."""

    fit: Fitted
    gain: float
    penalised: float

    @property
    def name(self) -> str:
        """The name of the added row."""
        return self.fit.names[-1]

    @property
    def row(self) -> Variant:
        """The added row."""
        return self.fit.model.added[-1]


def silent(_: str) -> None:
    """Progress without output."""


def ranked_candidates(
    x: Round, rows: tuple[Variant, ...] = CANDIDATES, progress: Progress = silent, least: float = 0.0
) -> list[Candidate]:
    """All rows as candidates, each added to the fit, best first; the better half is followed to the end.

    progress : called with each row's name before it is tried; least : smallest useful penalised gain [nat].
    """
    begun = [first_try(x, row, least, progress) for row in rows if applies(x, row)]
    firsts = counted_alike(x, [first for first, _ in begun])
    tried = sorted(zip(firsts, (models for _, models in begun), strict=True), key=lambda t: -t[0].penalised)
    ended = [gain_over_opponent(x, followed(x, first, models, least)) for first, models in tried[:FOLLOWED]]
    sticking = sticking_candidates(x, [first for first, _ in tried], rows, progress)
    found = [*ended, *sticking, *(gain_over_opponent(x, first) for first, _ in tried[FOLLOWED:])]
    return sorted(counted_alike(x, found), key=lambda c: -c.penalised)


def applies(x: Round, row: Variant) -> bool:
    """Whether a row may be added: its needs are met, and it is not in the model yet."""
    effect, near = about(row.name), x.near
    taken = {p.slot for r in near.model.added for p in r.params}
    if row.name in near.names or taken & {p.slot for p in row.params}:
        return False
    if effect.types and x.s.kind in KNOWN_TYPES and x.s.kind not in effect.types:
        return False
    if row.needs in NEEDS and not NEEDS[row.needs](x):
        return False
    if x.p.by_simulation and effect.timed and row.opponent is None:
        return False  # an added load is judged by innovations
    # behind one friction, a second of the same stem is not identifiable without the stem's position
    has_friction = x.s.free_valve or any(about(name).friction is not None for name in near.names)
    return effect.friction is None or not has_friction


def penalty(p: Problem, row: Variant) -> float:
    """Penalty of a variant [nat]."""
    hidden = HIDDEN_PENALTY if p.by_simulation else PARAMETER_PENALTY
    free = sum(hidden if q.hidden else PARAMETER_PENALTY for q in row.params)
    return SEARCH_PENALTY + (free or PARAMETER_PENALTY) + row.penalty


def penalised(x: Round, fit: Fitted) -> Candidate:
    """A fit as a candidate, with its gain over the previous fit."""
    won = gain(fit, x.near)
    return Candidate(fit, won, won - penalty(x.p, fit.model.added[-1]))


def best_of(x: Round, models: list[Model], steps: int, aim: float = math.inf) -> Candidate:
    """The best of some starts after some steps, of those that can reach `aim`."""
    return penalised(x, min((descended(x.p, m, steps, aim) for m in models), key=lambda f: f.loss))


def worth_following(p: Problem, least: float) -> float:
    """Smallest penalised gain of the first round for which a candidate is followed [nat]: below the useful gain by
    the possible improvement, or a share of the useful gain if that is less."""
    return min(MAY_COME_TO * least, least + WORTH_FOLLOWING)


def first_try(x: Round, row: Variant, least: float, progress: Progress) -> tuple[Candidate, list[Model]]:
    """The candidate after a few steps from a row's best start, and all its starts, the best first; a hopeless start
    is stopped."""
    progress(row.name)
    p, near = x.p, x.near
    first = models = start_models(x, row)
    if row.needs != "line":
        models = screened(x, models)[:STARTS]
        first = models[:1]
    if row.modes:
        first = first + mode_starts(p, near, row)
    worth = penalty(p, row) + worth_following(p, least)
    aim = near.loss * math.exp(-2.0 * worth / p.count)
    return best_of(x, first, SCREEN_STEPS, aim), models


def followed(x: Round, first: Candidate, models: list[Model], least: float) -> Candidate:
    """A candidate of the first round followed to the end, from its result and from its next starts."""
    if first.penalised < worth_following(x.p, least) and (least > 0.0 or not x.p.by_simulation):
        return first
    best = best_of(x, [first.fit.model, *models[1:STARTS]], FULL_STEPS)
    return best if best.penalised > first.penalised else first


def counted_alike(x: Round, found: list[Candidate]) -> list[Candidate]:
    """Count an experiment's candidates with the number of independent errors of the whitest one. The correlation of
    another comes from its model error, not from the noise. A load course absorbs the noise itself and keeps its own
    number."""
    most = max((c.fit.count for c in found if c.row.opponent is None), default=0)
    if not x.p.by_simulation:
        return found
    return [c if c.row.opponent is not None else penalised(x, replace(c.fit, count=most)) for c in found]


def gain_over_opponent(x: Round, first: Candidate) -> Candidate:
    """A candidate of an experiment, by its gain over its opponent if any: the same course of an added load, which
    belongs to the baseline model. A course that moves PV as much as OP does needs no such proof: the record may not
    show whether it also changes the gain."""
    p, near, row = x.p, x.near, first.row.opponent
    if row is None or not p.by_simulation:
        return first
    model, steps = Model((*near.model.added, row), row.set_in(near.model.c)), FULL_STEPS
    added, own = descended(p, model, steps), descended(p, first.fit.model, steps)
    moves = float(p.weight @ p.y**2 / p.weight.sum())
    if own.loss < COURSE_LEAVES * near.loss and near.loss > COURSE_FROM**2 * moves:
        return penalised(x, own)
    won = gain(own, added)
    return Candidate(own, won, won - penalty(p, first.row) + first.row.penalty)


def sticking_candidates(
    x: Round, tried: list[Candidate], rows: tuple[Variant, ...], progress: Progress
) -> list[Candidate]:
    """Sticking valves scanned near the best backlash, if backlash or a similar effect gains anything."""
    backlashes = [c for c in tried if about(c.name).friction is Friction.BACKLASH]
    hints = [c.gain for c in tried if about(c.name).friction is not None]
    if not backlashes or max(hints) < STICKING_HINT:
        return []
    out = []
    for row in rows:
        if about(row.name).friction is Friction.STICKS:
            progress(row.name)
            fit = fit_sticking(x.p, backlashes[0].fit, row, x.near.model.added)
            out.append(penalised(x, fit))
    return out


def longest_first(model: Model) -> Model:
    """A model whose added lag is shorter than the process's: two lags in series are the same in either order."""
    slots, c = {q.slot for q in model.params}, model.c
    if Slot.T2 not in slots or {Slot.T3, Slot.BEGUN} & slots or c[Slot.T2] <= c[Slot.T]:
        return model
    swapped = c.copy()
    swapped[Slot.T], swapped[Slot.T2] = c[Slot.T2], c[Slot.T]
    return replace(model, c=swapped)


def without(model: Model, rows: Iterable[Variant]) -> Model:
    """A model without some of its additions, their constants neutral."""
    c, rest, gone = model.c.copy(), neutral(), list(rows)
    for row in gone:
        for slot in [p.slot for p in row.params] + list(row.fixed):
            c[slot] = rest[slot]
    names = {row.name for row in gone}
    return Model(tuple(r for r in model.added if r.name not in names), c)


def integrating_or_first_order(p: Problem, free: Fitted, s: Recording) -> tuple[Problem, Fitted]:
    """Problem and baseline fit, with the time constant limited by the record if an integrator fits as well.

    A baseline model with a time constant longer than the record is an integrator. Where an integrator with one
    constant fewer fits as well, the baseline model is one that settles within the record.
    """
    row, x = next(v for v in CANDIDATES if v.replaces), Round(p, free, s)
    longest = SETTLES * p.inputs.dt_s * p.y.size
    if float(free.model.c[Slot.T]) <= longest or not applies(x, row):
        return p, free
    ended = best_of(x, start_models(x, row), FULL_STEPS)
    if ended.gain < -SAME:
        return p, free
    held = replace(p, inputs=replace(p.inputs, longest_s=longest))
    c = free.model.c.copy()
    c[Slot.K] *= longest / c[Slot.T]
    c[Slot.T] = longest
    return held, descended(held, Model((), c), FULL_STEPS)
