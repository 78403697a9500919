"""One round of effects added to a fit: every variant of the catalogue started, screened, followed, and ranked by what
it gains."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from identification.estimation.prediction_error import Fitted, Model, Problem, descended, gain
from identification.mismatch.catalogue import CANDIDATES
from identification.mismatch.effect import Friction
from identification.mismatch.friction import fit_sticking
from identification.mismatch.outside import about
from identification.mismatch.proof import is_one_move
from identification.mismatch.recording import Recording
from identification.mismatch.starts import Round, mode_starts, screened, start_models
from identification.simulation.parameters import Slot, Variant, neutral

Progress = Callable[[str], None]
KNOWN_TYPES = ("flow", "pressure", "temperature", "level")
"""Loop types under which a row may be left out; any other text says nothing."""
NEEDS: Mapping[str, Callable[[Round], bool]] = {
    "every scan": lambda x: x.s.every_scan,
    "experiment": lambda x: x.p.by_simulation,
    "moves": lambda x: not is_one_move(x.p),
    "neighbour": lambda x: x.p.inputs.neighbour is not None,
}
"""Whether what a row needs is in the recording; what is not here always is."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A fitted candidate: what it gains over the fit before, and what is left of that after its penalty."""

    fit: Fitted
    gain: float
    penalised: float

    @property
    def name(self) -> str:
        """The name of the row that it adds."""
        return self.fit.names[-1]

    @property
    def row(self) -> Variant:
        """The row that it adds."""
        return self.fit.model.added[-1]


def silent(_: str) -> None:
    """Progress that nobody watches."""


def compete(
    x: Round, rows: tuple[Variant, ...] = CANDIDATES, tell: Progress = silent, least: float = 0.0
) -> list[Candidate]:
    """All rows as candidates of a fit to which each is added, best first; the better half followed to the end.

    tell : is told each row's name before it is tried; least : what a candidate has to come to, penalty taken off, to
    be of any use [nat].
    """
    begun = [first_try(x, row, least, tell) for row in rows if applies(x, row)]
    firsts = counted_alike(x, [first for first, _ in begun])
    tried = sorted(zip(firsts, (models for _, models in begun), strict=True), key=lambda t: -t[0].penalised)
    most = x.p.limits.search.followed
    ended = [gain_over_opponent(x, followed(x, first, models, least)) for first, models in tried[:most]]
    sticking = sticking_candidates(x, [first for first, _ in tried], rows, tell)
    found = [*ended, *sticking, *(gain_over_opponent(x, first) for first, _ in tried[most:])]
    return sorted(counted_alike(x, found), key=lambda c: -c.penalised)


def applies(x: Round, row: Variant) -> bool:
    """Whether a row may be added: what it needs is there, and it is not in the model yet."""
    effect, near = about(row.name), x.near
    taken = {p.slot for r in near.model.added for p in r.params}
    if row.name in near.names or taken & {p.slot for p in row.params}:
        return False
    if effect.types and x.s.kind in KNOWN_TYPES and x.s.kind not in effect.types:
        return False
    if row.needs in NEEDS and not NEEDS[row.needs](x):
        return False
    if x.p.by_simulation and effect.timed and row.opponent is None:
        return False  # a load that is added is told by innovations
    # behind one friction a second of the same stem cannot be told without the stem's position
    told = x.s.free_valve or any(about(name).friction is not None for name in near.names)
    return effect.friction is None or not told


def penalty(p: Problem, row: Variant) -> float:
    """Log likelihood [nat] that a variant costs."""
    limits = p.limits.search
    hidden = limits.hidden_penalty if p.by_simulation else limits.parameter_penalty
    free = sum(hidden if q.hidden else limits.parameter_penalty for q in row.params)
    return limits.search_penalty + (free or limits.parameter_penalty) + row.penalty


def penalised(x: Round, fit: Fitted) -> Candidate:
    """A fit as a candidate beside the fit before."""
    won = gain(fit, x.near)
    return Candidate(fit, won, won - penalty(x.p, fit.model.added[-1]))


def best_of(x: Round, models: list[Model], steps: int, aim: float = math.inf) -> Candidate:
    """The best of some starts, followed for some steps, as far as they come under `aim`."""
    return penalised(x, min((descended(x.p, m, steps, aim) for m in models), key=lambda f: f.loss))


def worth_following(p: Problem, least: float) -> float:
    """What a candidate of the first round has to come to, to be followed [nat], its penalty taken off: so far below
    what it is of use from as any may lie, or at a share of that where that is less."""
    limits = p.limits.search
    return min(limits.may_come_to * least, least + limits.worth_following)


def first_try(x: Round, row: Variant, least: float, tell: Progress) -> tuple[Candidate, list[Model]]:
    """The candidate that a few steps make of a row's best start, and all its starts, the best first; a start that
    will not come to anything worth following is left."""
    tell(row.name)
    p, near, limits = x.p, x.near, x.p.limits.search
    first = models = start_models(x, row)
    if row.needs != "line":
        models = screened(x, models)[: limits.starts]
        first = models[:1]
    if row.modes:
        first = first + mode_starts(p, near, row)
    worth = penalty(p, row) + worth_following(p, least)
    aim = near.loss * math.exp(-2.0 * worth / p.count)
    return best_of(x, first, limits.screen_steps, aim), models


def followed(x: Round, first: Candidate, models: list[Model], least: float) -> Candidate:
    """A candidate of the first round followed to the end, from there and from its next starts."""
    if first.penalised < worth_following(x.p, least) and (least > 0.0 or not x.p.by_simulation):
        return first
    limits = x.p.limits.search
    best = best_of(x, [first.fit.model, *models[1 : limits.starts]], limits.full_steps)
    return best if best.penalised > first.penalised else first


def counted_alike(x: Round, found: list[Candidate]) -> list[Candidate]:
    """An experiment's candidates with errors that count as many as those of the one that leaves the whitest: what
    another leaves is correlated by what it lacks, and not by the noise. A course takes the noise itself up, and is
    counted by itself."""
    most = max((c.fit.count for c in found if c.row.opponent is None), default=0)
    if not x.p.by_simulation:
        return found
    return [c if c.row.opponent is not None else penalised(x, replace(c.fit, count=most)) for c in found]


def gain_over_opponent(x: Round, first: Candidate) -> Candidate:
    """A candidate of an experiment that has an opponent, by what it gains over that: the same course of a load that
    is added, which is no effect but the plain loop's own. One that moves PV as much as OP does needs no such proof:
    whether it changes the gain too, the record may not tell."""
    p, near, row = x.p, x.near, first.row.opponent
    if row is None or not p.by_simulation:
        return first
    model, steps = Model((*near.model.added, row), row.set_in(near.model.c)), p.limits.search.full_steps
    added, own = descended(p, model, steps), descended(p, first.fit.model, steps)
    limits, moves = p.limits.proof, float(p.weight @ p.y**2 / p.weight.sum())
    if own.loss < limits.course_leaves * near.loss and near.loss > limits.course_from**2 * moves:
        return penalised(x, own)
    won = gain(own, added)
    return Candidate(own, won, won - penalty(p, first.row) + first.row.penalty)


def sticking_candidates(
    x: Round, tried: list[Candidate], rows: tuple[Variant, ...], tell: Progress
) -> list[Candidate]:
    """Sticking valves scanned about the best play, where a play or the like gains anything at all."""
    plays = [c for c in tried if about(c.name).friction is Friction.PLAY]
    hints = [c.gain for c in tried if about(c.name).friction is not None]
    if not plays or max(hints) < x.p.limits.search.sticking_hint:
        return []
    out = []
    for row in rows:
        if about(row.name).friction is Friction.STICKS:
            tell(row.name)
            fit = fit_sticking(x.p, plays[0].fit, row, x.near.model.added)
            out.append(penalised(x, fit))
    return out


def without(model: Model, rows: Iterable[Variant]) -> Model:
    """A model less some of what is added to it, the constants of those at rest."""
    c, rest, gone = model.c.copy(), neutral(), list(rows)
    for row in gone:
        for slot in [p.slot for p in row.params] + list(row.fixed):
            c[slot] = rest[slot]
    names = {row.name for row in gone}
    return Model(tuple(r for r in model.added if r.name not in names), c)


def integrating_or_first_order(p: Problem, free: Fitted, s: Recording) -> tuple[Problem, Fitted]:
    """Problem and plain fit, the time constant kept within the record where it might as well have no end.

    A plain loop whose time constant outlasts the record is an integrator under another name. Where an integrator
    does as well with one constant fewer, the plain loop is one that settles within the record.
    """
    row, x = next(v for v in CANDIDATES if v.replaces), Round(p, free, s)
    longest = p.limits.search.settles * p.inputs.dt_s * p.y.size
    if float(free.model.c[Slot.T]) <= longest or not applies(x, row):
        return p, free
    ended = best_of(x, start_models(x, row), p.limits.search.full_steps)
    if ended.gain < -p.limits.search.same:
        return p, free
    held = replace(p, inputs=replace(p.inputs, longest_s=longest))
    c = free.model.c.copy()
    c[Slot.K] *= longest / c[Slot.T]
    c[Slot.T] = longest
    return held, descended(held, Model((), c), p.limits.search.full_steps)
