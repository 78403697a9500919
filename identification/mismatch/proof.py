"""Plain and better model on data that were not fitted, each at its best by what is drawn, judged and told.

A model has two optima: of what it foretells one step ahead, which a load in a closed loop does not bias, and of what
its simulation misses of PV, which pictures and tables show. Names are found by the first. What is told as gained is
measured by the second, against the plain loop that leaves least of PV by either.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from identification.estimation.candidate import Fitted, Model, Problem
from identification.estimation.noise import NO_NOISE
from identification.estimation.prediction_error import descend
from identification.estimation.start_values import simulated_best
from identification.limits import LIMITS, ProofLimits
from identification.mismatch.cross_validation import early_part, fitted_early, held_out_gain
from identification.mismatch.restarts import simulated_anew
from identification.record import Floats, Mask
from identification.signals.filters import without_lines
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot


@dataclass(frozen=True, slots=True)
class Misfit:
    """Root mean square [% PV] of PV less a simulation with its mean freed, and the share of PV's motion it fits."""

    rmse: float
    fit_pct: float


@dataclass(frozen=True, slots=True)
class OnOther:
    """Misfit of models on one other recording, over the same windows, and its samples.

    baseline, explained : of the plain and the better model; without : of the better one with its effects taken out
    and the rest as it is, which tells whether the effects are there too, or only the better constants beside them.
    """

    baseline: Misfit
    explained: Misfit
    without: Misfit
    samples: int

    @property
    def share(self) -> float:
        """Part of the misfit (mean square) that the effects remove there."""
        return 1.0 - self.explained.rmse**2 / max(self.baseline.rmse**2, 1e-30)


def anchored(y: Floats, simulated: Floats, window: int) -> Floats:
    """A simulation begun anew in each window of so many samples: a straight line of load is added there, shape (n,).

    With 0 the whole is one window with a free bias. A level that integrates drifts in open loop under its load, and
    then shows the load and not the model; over a window of some time constants it shows the model.
    """
    left = y - simulated
    if window <= 0 or window >= y.size:
        return simulated + left.mean()
    return y - without_lines(left, window)


def misfit(y: Floats, simulated: Floats, window: int = 0) -> Misfit:
    """Misfit of a simulation anchored in windows; fit_pct is 100 (1 - rms error / rms of PV so anchored itself)."""
    return _of_what_is_left(y - anchored(y, simulated, window), without_lines(y, window))


def _of_what_is_left(left: Floats, still: Floats) -> Misfit:
    rmse = float(np.std(left))
    return Misfit(rmse, 100.0 * (1.0 - rmse / max(float(np.std(still)), 1e-12)))


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Before and after on the held-out part: gain of the innovations, and misfit of the simulations.

    overall : misfit over the whole record of the models fitted to all of it, which is what pages draw, and drawn :
    their constants, shape (SIZE,) each; window : samples after which the simulations begin anew, 0 for one run over
    all; placed : whether the stem of a valve with friction is then placed anew too (restarts.py); least_plain : least
    held-out misfit of a plain loop by either criterion [% PV].
    """

    gain: float
    fitted: tuple[Misfit, Misfit]
    held: tuple[Misfit, Misfit]
    overall: tuple[Misfit, Misfit]
    drawn: tuple[Floats, Floats] = field(repr=False)
    window: int = 0
    placed: bool = False
    least_plain: float = np.inf
    limits: ProofLimits = LIMITS.proof

    @property
    def falls(self) -> bool:
        """Whether the misfit falls over the whole."""
        return self.overall[1].rmse < self.overall[0].rmse

    @property
    def follows(self) -> bool:
        """Whether the better model goes with PV at all on held-out data, and not merely less far astray."""
        return self.held[1].fit_pct >= self.limits.least_fit

    @property
    def carries(self) -> bool:
        """Whether the misfit falls, over the whole and on held-out data against any plain loop, to less than PV's own
        motion; what is seen plainly one step ahead has only to simulate nearly as well as any."""
        before, after = min(self.held[0].rmse, self.least_plain), self.held[1].rmse
        return self.follows and ((after < before and self.falls) or self.seen_ahead)

    @property
    def seen_ahead(self) -> bool:
        """Whether innovations of held-out data show the effect, and no plain loop simulates far better."""
        most, (plain, better) = self.limits.astray, self.overall
        near = self.held[1].rmse <= most * min(self.held[0].rmse, self.least_plain)
        return self.gain > self.limits.seen_ahead and near and better.rmse <= most * plain.rmse

    @property
    def share(self) -> float:
        """Part of the held-out misfit (mean square) that the effect removes."""
        before, after = (m.rmse**2 for m in self.held)
        return 1.0 - after / max(before, 1e-30)


def course(p: Problem, c: Floats, window: int, placed: bool) -> Floats:
    """PV's deviation [% PV], shape (n,), as drawn and judged: anchored in windows, the stem placed anew or not."""
    return anchored(p.y, simulated_anew(p, c, window) if placed else simulate(p.inputs, c), window)


@dataclass(frozen=True, slots=True)
class Criterion:
    """How simulations are drawn and judged: begun anew after `window` samples, 0 for never, the stem `placed` anew or
    not."""

    p: Problem
    window: int
    placed: bool

    def misfit(self, c: Floats, part: slice) -> Misfit:
        """What constants, shape (SIZE,), leave of a part of PV."""
        left = self.p.y - course(self.p, c, self.window, self.placed)
        return _of_what_is_left(left[part], without_lines(self.p.y, self.window)[part])

    def least(self, models: Iterable[Floats], part: slice) -> Floats:
        """Of models' constants those that leave least of a part."""
        return min(models, key=lambda c: self.misfit(c, part).rmse)

    def nearer(self, model: Model, judged: Mask) -> Floats:
        """Constants of a model, its plain loop's moved to where they leave least; an effect's stay as told."""
        told = tuple(replace(row, params=()) for row in model.added)
        q = replace(self.p, edges=NO_NOISE, window=self.window, weight=judged.astype(float))
        return descend(q, Model(told, model.c), q.limits.search.full_steps).model.c

    def candidates(self, plain: Model, better: Model, judged: Mask) -> tuple[list[Floats], list[Floats]]:
        """Constants of the plain and of the better model by both criteria, each from several starts."""
        plains = [plain.c, self.nearer(plain, judged)]
        process = simulated_best(self.p.y, self.p.inputs.op, judged, self.p.inputs.dt_s)
        c = plain.c.copy()
        c[Slot.K], c[Slot.T], c[Slot.L] = process.gain, process.time_constant_s, process.dead_time_s
        plains.append(self.nearer(Model((), c), judged))
        if not better.added:
            return plains, plains
        begun = better.c.copy()
        best = self.least(plains, slice(None))
        for slot in (Slot.K, Slot.T, Slot.L, Slot.BIAS, Slot.START):
            begun[slot] = best[slot]
        starts = [better.c] if any(row.replaces for row in better.added) else [better.c, begun]
        return plains, [better.c, *(self.nearer(replace(better, c=c), judged) for c in starts)]


def held_out(p: Problem, worse: Fitted, better: Fitted, cycle: int = 0) -> HeldOut:
    """Both models fitted anew to the first part of the record and compared on the rest.

    cycle : samples of a cycle of a loop whose cycles show a valve with friction, 0 for any other; they are compared
    over such windows too, the stem placed anew in each.

    They are compared over the whole rest, and where load drowns the difference there, over windows of some time
    constants of the plain loop.
    """
    fits = fitted_early(p, worse, better)
    c, limits = fits[0].model.c, p.limits.proof
    memory = limits.window_times * float(c[Slot.T] + c[Slot.L]) / p.inputs.dt_s
    window = max(int(memory), limits.window_samples)
    whole = _compared(Criterion(p, 0, False), (worse, better), fits)
    if whole.carries:
        return whole
    windowed = _compared(Criterion(p, window, False), (worse, better), fits)
    if cycle:
        anew = _compared(Criterion(p, cycle, True), (worse, better), fits)
        return windowed if windowed.carries and windowed.share > anew.share else anew
    return windowed if windowed.carries else whole


def _compared(by: Criterion, final: tuple[Fitted, Fitted], early: tuple[Fitted, Fitted]) -> HeldOut:
    p = by.p
    _, cut = early_part(p)
    first, rest, whole = slice(cut), slice(cut, None), slice(None)
    seen = p.usable & (np.arange(p.y.size) < cut)
    plains, betters = by.candidates(early[0].model, early[1].model, seen)
    chosen = by.least(plains, first), by.least(betters, first)
    drawn = tuple(by.least(x, whole) for x in by.candidates(final[0].model, final[1].model, p.usable))
    fitted, held = (tuple(by.misfit(c, part) for c in chosen) for part in (first, rest))
    return HeldOut(
        held_out_gain(p, early),
        (fitted[0], fitted[1]),
        (held[0], held[1]),
        (by.misfit(drawn[0], whole), by.misfit(drawn[1], whole)),
        (drawn[0], drawn[1]),
        by.window,
        by.placed,
        min(by.misfit(c, rest).rmse for c in plains),
        p.limits.proof,
    )
