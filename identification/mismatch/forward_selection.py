"""The candidates of a record: every row of the catalogue started, screened, followed, and ranked by what it gains."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.candidate import Fitted, Model, Problem, correlated, gain, problem
from identification.estimation.noise import NO_NOISE
from identification.estimation.prediction_error import descend
from identification.estimation.start_values import plain_processes
from identification.limits import LIMITS, ExplainLimits
from identification.mismatch.catalogue import CANDIDATES, EFFECTS
from identification.mismatch.cross_validation import is_one_move
from identification.mismatch.effect import Friction
from identification.mismatch.lack_of_fit import explained_freely
from identification.mismatch.outside import about
from identification.mismatch.recording import Circumstances
from identification.mismatch.starts.screening import CandidateInputs, screened, span_of, start_models
from identification.mismatch.starts.stick_slip import fit_sticking
from identification.mismatch.starts.two_modes import mode_starts
from identification.record import Floats, Mask
from identification.signals.robust import robust_weights
from identification.simulation.effect import Variant
from identification.simulation.open_loop import ModelInputs, as_parameters
from identification.simulation.parameters import Slot

Progress = Callable[[str], None]
KNOWN_TYPES = ("flow", "pressure", "temperature", "level")
"""Loop types under which a row may be left out; any other text says nothing."""


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


@dataclass(frozen=True, slots=True)
class Clip:
    """A transmitter's end: its value [% PV], whether it is the upper one, and where PV stands at it, shape (n,)."""

    value: float
    upper: bool
    where: Mask


def censored(p: Problem, clip: Clip) -> Problem:
    """The problem without the samples at a clip; those after them still count, and the model is clipped too."""
    return replace(p, weight=np.where(clip.where, 0.0, p.weight))


def plain(p: Problem, brought: Floats | None = None, clip: Clip | None = None) -> Fitted:
    """The plain loop at its optimum; a brought model (its constants) is one more start."""
    fits = [] if brought is None else [descend(p, Model((), brought.copy()), p.limits.search.full_steps)]
    for process in plain_processes(p.y, p.inputs.op, p.usable, p.inputs.dt_s):
        c = as_parameters(process)
        if clip is not None:
            c[Slot.CLIP_HI if clip.upper else Slot.CLIP_LO] = clip.value
        c[Slot.START] = p.y[0]
        c[Slot.BIAS] = float(np.mean(p.y)) - process.gain * float(np.mean(p.inputs.op) - p.inputs.middle)
        fits.append(descend(p, Model((), c), p.limits.search.full_steps))
    return min(fits, key=lambda fit: fit.loss)


def robustly_weighted(p: Problem, fit: Fitted) -> Problem:
    """The problem with innovations that are too large to be noise counting less."""
    return replace(p, weight=robust_weights(fit.e, p.weight > 0))


def applies(x: CandidateInputs, near: Fitted, row: Variant) -> bool:
    """Whether a row may be added: what it needs is there, and it is not in the model yet."""
    taken = {p.slot for r in near.model.added for p in r.params}
    if row.name in near.names or taken & {p.slot for p in row.params}:
        return False
    if row.types and x.known.kind in KNOWN_TYPES and x.known.kind not in row.types:
        return False
    if row.needs == "every scan" and not x.known.every_scan:
        return False
    if row.needs == "experiment" and not x.p.by_simulation:
        return False
    rubs = about(row.name).friction is not None
    if rubs and (x.known.free_valve or any(EFFECTS[r.name].friction is not None for r in near.model.added)):
        return (
            False  # behind one friction a second of the same stem cannot be told without the stem's position
        )
    if row.needs == "moves" and is_one_move(x.p):
        return False
    if x.p.by_simulation and about(row.name).timed and row.opponent is None:
        return False  # a load that is added is told by innovations
    if row.needs == "neighbour":
        return x.p.inputs.neighbour is not None
    return True


def penalty(p: Problem, row: Variant) -> float:
    """Log likelihood [nat] that a variant costs."""
    limits = p.limits.search
    free = [
        limits.hidden_penalty if q.hidden and p.by_simulation else limits.parameter_penalty
        for q in row.params
    ]
    return limits.search_penalty + (sum(free) or limits.parameter_penalty) + row.penalty


def candidate(p: Problem, near: Fitted, models: list[Model], steps: int) -> Candidate:
    """The best of some starts, followed for some steps."""
    return _of_fits(p, near, [descend(p, model, steps) for model in models])


def worth_following(p: Problem, least: float) -> float:
    """What a candidate of the first round has to come to, to be followed [nat], its penalty taken off: so far below
    what it is of use from as any may lie, or at a share of that where that is less."""
    limits = p.limits.search
    return min(limits.may_come_to * least, least + limits.worth_following)


def screened_candidate(p: Problem, near: Fitted, models: list[Model], least: float = 0.0) -> Candidate:
    """The same in the first round, where a start that will not come to anything worth following is left."""
    worth = penalty(p, models[0].added[-1])
    worth += worth_following(p, least)
    aim = near.loss * math.exp(-2.0 * worth / p.count)
    return _of_fits(p, near, [descend(p, model, p.limits.search.screen_steps, aim) for model in models])


def _of_fits(p: Problem, near: Fitted, fits: list[Fitted]) -> Candidate:
    return priced(p, near, min(fits, key=lambda f: f.loss))


def priced(p: Problem, near: Fitted, fit: Fitted) -> Candidate:
    """A fit as a candidate beside the fit before."""
    won = gain(fit, near)
    return Candidate(fit, won, won - penalty(p, fit.model.added[-1]))


def counted_alike(p: Problem, near: Fitted, found: list[Candidate]) -> list[Candidate]:
    """An experiment's candidates with errors that count as many as those of the one that leaves the whitest: what
    another leaves is correlated by what it lacks, and not by the noise. A course takes the noise itself up, and is
    counted by itself."""
    lasting = [c.fit.count for c in found if c.row.opponent is None]
    if not p.by_simulation or not lasting:
        return found
    return [
        c if c.row.opponent is not None else priced(p, near, replace(c.fit, count=max(lasting)))
        for c in found
    ]


def outdoing(p: Problem, near: Fitted, first: Candidate) -> Candidate:
    """A candidate of an experiment that has an opponent, by what it gains over that: the same course of a load that
    is added, which is no effect but the plain loop's own. One that moves PV as much as OP does needs no such proof:
    whether it changes the gain too, the record may not tell."""
    row = first.row.opponent
    if row is None or not p.by_simulation:
        return first
    c = near.model.c.copy()
    for slot, value in (row.fixed or {}).items():
        c[slot] = value
    added = descend(p, Model((*near.model.added, row), c), p.limits.search.full_steps)
    own = descend(p, first.fit.model, p.limits.search.full_steps)
    limits, moves = p.limits.proof, float(p.weight @ p.y**2 / p.weight.sum())
    if own.loss < limits.course_leaves * near.loss and near.loss > limits.course_from**2 * moves:
        return priced(p, near, own)
    won = gain(own, added)
    return Candidate(own, won, won - penalty(p, first.row) + first.row.penalty)


def followed(
    p: Problem, near: Fitted, first: Candidate, models: list[Model], least: float = 0.0
) -> Candidate:
    """A candidate of the first round followed to the end, from there and from its second and third start."""
    enough = first.penalised >= worth_following(p, least)
    if not enough and (least > 0.0 or not p.by_simulation):
        return first
    starts = [first.fit.model, *models[1:3]]
    best = candidate(p, near, starts, p.limits.search.full_steps)
    return best if best.penalised > first.penalised else first


def compete(
    x: CandidateInputs,
    near: Fitted,
    rows: tuple[Variant, ...] = CANDIDATES,
    tell: Progress = silent,
    least: float = 0.0,
) -> list[Candidate]:
    """All rows as candidates of a fit, best first; the better half followed to the end.

    Parameters
    ----------
    x : CandidateInputs
    near : Fitted
        The fit to which each row is added.
    rows : tuple of Variant
    tell : callable
        Is told each row's name before it is tried.
    least : float
        What a candidate has to come to, penalty taken off, to be of any use [nat].
    """
    tried: list[tuple[Candidate, list[Model]]] = []
    span = span_of(x.p, near)
    for row in rows:
        if applies(x, near, row):
            tell(row.name)
            models = start_models(x, near, row)
            first = models
            if row.needs != "line":
                models = screened(x.p, near, span, models)[:3]
                first = models[:1]
            if row.modes:
                first += mode_starts(x.p, near, row)
            tried.append((screened_candidate(x.p, near, first, least), models))
    alike = counted_alike(x.p, near, [first for first, _ in tried])
    tried = sorted(zip(alike, (models for _, models in tried), strict=True), key=lambda t: -t[0].penalised)
    most = x.p.limits.search.followed
    ended = [outdoing(x.p, near, followed(x.p, near, first, models, least)) for first, models in tried[:most]]
    ended += stiction_candidates(x, near, [first for first, _ in tried], rows, tell)
    ended += [outdoing(x.p, near, first) for first, _ in tried[most:]]
    found = counted_alike(x.p, near, ended)
    return sorted(found, key=lambda r: -r.penalised)


def prepared(
    inputs: ModelInputs,
    y: Floats,
    usable: Mask,
    brought: Floats | None = None,
    clip: Clip | None = None,
    limits: ExplainLimits = LIMITS,
    experiment: bool = False,
) -> tuple[Problem, Fitted]:
    """A problem with its outliers robustly_weighted, and its plain fit; an experiment's is judged by simulation."""
    p = problem(inputs, y, usable, limits, NO_NOISE if experiment else None)
    if clip is not None:
        p = censored(p, clip)
    first = plain(p, brought, clip)
    calm = robustly_weighted(p, first)
    fit = descend(calm, first.model, p.limits.search.full_steps)
    return with_memory(calm, fit) if experiment else (calm, fit)


def with_memory(p: Problem, fit: Fitted) -> tuple[Problem, Fitted]:
    """An experiment and its fit, with the memory of what the most flexible model leaves: the nearest to its noise."""
    _, left, _ = explained_freely(p, fit)
    known = replace(p, memory=correlated(left[p.weight > 0]))
    return known, replace(fit, count=known.independent(fit.e))


def integrating_or_first_order(p: Problem, free: Fitted, kind: str) -> tuple[Problem, Fitted]:
    """Problem and plain fit, the time constant kept within the record where it might as well have no end.

    A plain loop whose time constant outlasts the record is an integrator under another name. Where an integrator
    does as well with one constant fewer, the plain loop is one that settles within the record.
    """
    rows = [v for v in CANDIDATES if v.replaces]
    x = CandidateInputs(p, (), Circumstances(kind))
    longest = p.limits.search.settles * p.inputs.dt_s * p.y.size
    if float(free.model.c[Slot.T]) <= longest or not applies(x, free, rows[0]):
        return p, free
    ended = candidate(p, free, start_models(x, free, rows[0]), p.limits.search.full_steps)
    if ended.gain < -p.limits.search.same:
        return p, free
    held = replace(p, inputs=replace(p.inputs, longest_s=longest))
    c = free.model.c.copy()
    c[Slot.K] *= longest / c[Slot.T]
    c[Slot.T] = longest
    return held, descend(held, Model((), c), p.limits.search.full_steps)


def stiction_candidates(
    x: CandidateInputs,
    near: Fitted,
    tried: list[Candidate],
    rows: tuple[Variant, ...],
    tell: Progress = silent,
) -> list[Candidate]:
    """Sticking valves scanned about the best play, where a play or the like gains anything at all."""
    plays = [r for r in tried if about(r.name).friction is Friction.PLAY]
    hints = [r.gain for r in tried if about(r.name).friction is not None]
    if not plays or max(hints) < x.p.limits.search.sticking_hint:
        return []
    out = []
    for row in rows:
        if about(row.name).friction is Friction.STICKS:
            tell(row.name)
            fit = fit_sticking(x.p, plays[0].fit, row, near.model.added)
            out.append(priced(x.p, near, fit))
    return out
