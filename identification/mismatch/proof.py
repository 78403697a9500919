"""Does a model with an effect do better on data it was not fitted to than without: asked of each candidate as it is
taken, by what it foretells one step ahead, and of the explanation as it is told, by what its simulation misses.

A model has two optima: of what it foretells one step ahead, which a load in a closed loop does not bias, and of what
its simulation misses of PV, which pictures and tables show. Names are found by the first. What is told as gained is
measured by the second, against the plain loop that leaves least of PV by either.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from identification.estimation.noise import NO_NOISE, whitened
from identification.estimation.prediction_error import Fitted, Model, Problem, bounds, descended, gain
from identification.estimation.search import simulated_best
from identification.limits import LIMITS, ExplainLimits
from identification.mismatch.effect import Effect
from identification.mismatch.friction import WEARS, simulated_anew
from identification.mismatch.starts import Round, at_inlet, early_part, fitted_early
from identification.record import Floats, Mask
from identification.signals.filters import in_band, without_lines
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

ENDS_OF_SIGNAL = ("opspan", "pvspan")
"""Scales of constants that are places in a signal's range."""


def passes(x: Round, better: Fitted, effect: Effect) -> bool:
    """Whether the effect that a candidate adds to a round's fit stands: its constants within their range, no valve in
    good order, spread over the record and, where it is bound to no time, on held-out spans.

    What an effect that is bound to a time will do later does not follow from what it did, so no span is held out.
    """
    p, worse, limits = x.p, x.near, x.p.limits.proof
    sound = effect.friction in WEARS and better.model.c[Slot.STICKBAND] < limits.sound_valve
    if sound or runs_out(p, better):
        return False
    if effect.needs == "steps":
        return at_inlet(p, worse)
    if effect.timed:
        return True
    if not effect.local and not is_spread(p, better, worse):
        return False
    least = limits.held_out_loss - limits.held_out_share * gain(better, worse)
    return held_out_gain(p, (x.early, fitted_early(p, better))) > least


def runs_out(p: Problem, fit: Fitted) -> bool:
    """Whether a constant of the effect added last ran to the far end of what it may be: the data want another name.

    A bound at zero, and one that is an end of a signal's range, is where an effect begins, and no far end.
    """
    edge = p.limits.proof.bound_share
    for q in fit.model.added[-1].params:
        if q.scale in ENDS_OF_SIGNAL:
            continue
        value, (low, high) = float(fit.model.c[q.slot]), bounds(p.inputs, fit.model.c, q)
        near = edge * (high - low)
        at_high = high != 0.0 and value > (high * (1.0 - edge) if q.log else high - near)
        at_low = not q.log and low != 0.0 and value < low + near
        if at_high or at_low:
            return True
    return False


def is_one_move(p: Problem) -> bool:
    """Whether OP moves in two parts of the record alone: one experiment, of which no part is left to prove it on."""
    limits = p.limits.proof
    parts = np.array_split(p.inputs.op, limits.parts)
    travel = np.sort([float(np.abs(np.diff(part)).sum()) for part in parts])
    return float(travel[-2:].sum()) > limits.one_move * float(travel.sum())


def is_spread(p: Problem, better: Fitted, worse: Fitted) -> bool:
    """Whether a share of the gain remains without the two parts that pay most; True where OP moves in two."""
    if is_one_move(p):
        return True
    won = 0.5 * p.weight * (worse.e**2 - better.e**2) / max(better.loss, 1e-30)
    parts = np.sort([part.sum() for part in np.array_split(won, p.limits.proof.parts)])
    return float(parts[:-2].sum()) > p.limits.proof.spread * float(parts.sum())


def held_out_gain(p: Problem, fits: tuple[Fitted, Fitted]) -> float:
    """Gain in log likelihood [nat] on the part held out, of two models fitted to the first part, worse and better."""
    early, cut = early_part(p)
    late = p.weight[cut:]
    whitenings = [whitened(p.y - simulate(p.inputs, fit.model.c), fit.ar, p.edges)[cut:] for fit in fits]
    losses = [float((late * e) @ e) for e in whitenings]
    won = 0.5 * (losses[0] - losses[1]) / max(fits[1].loss, 1e-30)
    return won * fits[1].count / max(early.count, 1)


@dataclass(frozen=True, slots=True)
class Misfit:
    """Root mean square [% PV] of PV less a simulation with its mean freed, and the share of PV's motion it fits, None
    where PV does not move by more than it leaves anyway: such a span judges no model."""

    rmse: float
    fit_pct: float | None


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


def misfit(y: Floats, simulated: Floats, window: int = 0, part: slice = slice(None)) -> Misfit:
    """Misfit of a simulation anchored in windows, in a part of it; fit_pct is 100 (1 - rms error / rms of PV so
    anchored itself)."""
    left, still = y - anchored(y, simulated, window), without_lines(y, window)
    rmse, moves = float(np.std(left[part])), float(np.std(still[part]))
    if moves <= LIMITS.proof.spreads * float(np.std(still)):
        return Misfit(rmse, None)
    return Misfit(rmse, 100.0 * (1.0 - rmse / max(moves, 1e-12)))


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Before and after on the held-out part: gain of the innovations, and misfit of the simulations.

    overall : misfit over the whole record of the models fitted to all of it, which is what pages draw, and drawn :
    their constants, shape (SIZE,) each; window : samples after which the simulations begin anew, 0 for one run over
    all; placed : whether the stem of a valve with friction is then placed anew too (friction.py); least_plain : least
    held-out misfit of a plain loop by either criterion [% PV]; band : shortest and longest period [s] of the loop's
    own band, and banded : held-out misfits there, None where no band is known.
    """

    gain: float
    fitted: tuple[Misfit, Misfit]
    held: tuple[Misfit, Misfit]
    overall: tuple[Misfit, Misfit]
    drawn: tuple[Floats, Floats] = field(repr=False)
    window: int = 0
    placed: bool = False
    least_plain: float = np.inf
    band: tuple[float, float] | None = None
    banded: tuple[Misfit, Misfit] | None = None
    limits: ExplainLimits = LIMITS

    @property
    def falls(self) -> bool:
        """Whether the misfit falls over the whole."""
        return self.overall[1].rmse < self.overall[0].rmse

    @property
    def is_blind(self) -> bool:
        """Whether PV stands still in what was held out, which then judges no model."""
        return self.held[1].fit_pct is None

    @property
    def follows(self) -> bool:
        """Whether the better model goes with PV at all on held-out data, and not merely less far astray."""
        fit_pct = self.held[1].fit_pct
        return fit_pct is not None and fit_pct >= self.limits.proof.least_fit

    @property
    def carries(self) -> bool:
        """Whether the misfit falls, over the whole and on held-out data against any plain loop, to less than PV's own
        motion; what is seen plainly one step ahead has only to simulate nearly as well as any."""
        before, after = min(self.held[0].rmse, self.least_plain), self.held[1].rmse
        return self.follows and ((after < before and self.falls) or self.seen_ahead)

    @property
    def seen_ahead(self) -> bool:
        """Whether innovations of held-out data show the effect, and no plain loop simulates far better."""
        most, (plain, better) = self.limits.proof.astray, self.overall
        near = self.held[1].rmse <= most * min(self.held[0].rmse, self.least_plain)
        return self.gain > self.limits.search.one_constant and near and better.rmse <= most * plain.rmse

    @property
    def share(self) -> float:
        """Part of the held-out misfit (mean square) that the effect removes."""
        before, after = (m.rmse**2 for m in self.held)
        return 1.0 - after / max(before, 1e-30)

    @property
    def share_in_band(self) -> float:
        """The same in the loop's own band where one is known: beyond it the load drowns what a model says."""
        before, after = (m.rmse**2 for m in self.banded or self.held)
        return 1.0 - after / max(before, 1e-30)


def course(p: Problem, c: Floats, window: int, placed: bool) -> Floats:
    """PV's deviation [% PV], shape (n,), as drawn and judged: anchored in windows, the stem placed anew or not."""
    return anchored(p.y, simulated_anew(p, c, window) if placed else simulate(p.inputs, c), window)


@dataclass(frozen=True, slots=True)
class Pair:
    """The plain and the better model as fitted to what is judged, bool, shape (n,), and least squares' plain loop."""

    plain: Model
    better: Model
    simulated: Model
    judged: Mask


def pair_of(p: Problem, fits: tuple[Fitted, Fitted], judged: Mask) -> Pair:
    """The models of two fits, the worse first."""
    process, c = simulated_best(p.y, p.inputs.op, judged, p.inputs.dt_s), fits[0].model.c.copy()
    c[Slot.K], c[Slot.T], c[Slot.L] = process.gain, process.time_constant_s, process.dead_time_s
    return Pair(fits[0].model, fits[1].model, Model((), c), judged)


@dataclass(frozen=True, slots=True)
class Criterion:
    """How simulations are drawn and judged: begun anew after `window` samples, 0 for never, the stem `placed` anew or
    not; band : shortest and longest period [samples] of the loop's own band, None where none is known."""

    p: Problem
    window: int = 0
    placed: bool = False
    band: tuple[float, float] | None = None

    def free(self, c: Floats) -> Floats:
        """PV as constants, shape (SIZE,), simulate it."""
        return simulated_anew(self.p, c, self.window) if self.placed else simulate(self.p.inputs, c)

    def misfit(self, c: Floats, part: slice = slice(None)) -> Misfit:
        """What constants, shape (SIZE,), leave of a part of PV."""
        return misfit(self.p.y, self.free(c), self.window, part)

    def banded(
        self, models: Iterable[Floats], band: tuple[float, float], first: slice, rest: slice
    ) -> Misfit:
        """What models' constants, those that leave least of the first part in a band, leave of the rest there."""
        y = self.p.y
        left = min((in_band(y - self.free(c), *band) for c in models), key=lambda x: float(np.std(x[first])))
        rmse, moves = (float(np.std(x[rest])) for x in (left, in_band(y, *band)))
        return Misfit(rmse, 100.0 * (1.0 - rmse / max(moves, 1e-12)))

    def least(self, models: Iterable[Floats], part: slice = slice(None)) -> Floats:
        """Of models' constants those that leave least of a part."""
        return min(models, key=lambda c: self.misfit(c, part).rmse)

    def nearer(self, model: Model, judged: Mask) -> Floats:
        """Constants of a model, its plain loop's moved to where they leave least; an effect's stay as told."""
        told = tuple(replace(row, params=()) for row in model.added)
        q = replace(self.p, edges=NO_NOISE, window=self.window, weight=judged.astype(float))
        return descended(q, Model(told, model.c), q.limits.search.full_steps).model.c

    def candidates(self, pair: Pair) -> tuple[list[Floats], list[Floats]]:
        """Constants of the plain and of the better model by both criteria, each from several starts."""
        better = pair.better
        plains = [pair.plain.c, *(self.nearer(model, pair.judged) for model in (pair.plain, pair.simulated))]
        if not better.added:
            return plains, plains
        begun, best = better.c.copy(), self.least(plains)
        for slot in (Slot.K, Slot.T, Slot.L, Slot.BIAS, Slot.START):
            begun[slot] = best[slot]
        starts = [better.c] if any(row.replaces for row in better.added) else [better.c, begun]
        return plains, [better.c, *(self.nearer(replace(better, c=c), pair.judged) for c in starts)]

    def compared(self, early: Pair, final: Pair, won: float) -> HeldOut:
        """Both models as fitted to the first part, on the rest; `won` is what innovations gain there [nat]."""
        _, cut = early_part(self.p)
        first, rest = slice(cut), slice(cut, None)
        plains, betters = self.candidates(early)
        chosen = self.least(plains, first), self.least(betters, first)
        drawn_plain, drawn_better = (self.least(models) for models in self.candidates(final))
        band, dt_s = self.band, self.p.inputs.dt_s
        return HeldOut(
            won,
            (self.misfit(chosen[0], first), self.misfit(chosen[1], first)),
            (self.misfit(chosen[0], rest), self.misfit(chosen[1], rest)),
            (self.misfit(drawn_plain), self.misfit(drawn_better)),
            (drawn_plain, drawn_better),
            self.window,
            self.placed,
            min(self.misfit(c, rest).rmse for c in plains),
            band and (band[0] * dt_s, band[1] * dt_s),
            band and (self.banded(plains, band, first, rest), self.banded(betters, band, first, rest)),
            self.p.limits,
        )


def held_out(
    p: Problem, worse: Fitted, better: Fitted, cycle: int = 0, band: tuple[float, float] | None = None
) -> HeldOut:
    """Both models fitted anew to the first part of the record and compared on the rest: over the whole of it, and
    where load drowns the difference there, over windows of some time constants of the plain loop; a plain loop beside
    itself over the whole alone.

    cycle : samples of a cycle of a loop whose cycles show a valve with friction, 0 for any other; they are compared
    over such windows too, the stem placed anew in each; band : as in Criterion.
    """
    first = fitted_early(p, worse)
    fits = first, first if better is worse else fitted_early(p, better)
    _, cut = early_part(p)
    early = pair_of(p, fits, p.usable & (np.arange(p.y.size) < cut))
    told = early, pair_of(p, (worse, better), p.usable), held_out_gain(p, fits)
    whole = Criterion(p, band=band).compared(*told)
    if whole.carries or better is worse:
        return whole
    c, limits = early.plain.c, p.limits.proof
    memory = limits.window_times * float(c[Slot.T] + c[Slot.L]) / p.inputs.dt_s
    windowed = Criterion(p, max(int(memory), limits.window_samples), False, band).compared(*told)
    if cycle:
        anew = Criterion(p, cycle, True, band).compared(*told)
        return windowed if windowed.carries and windowed.share > anew.share else anew
    return windowed if windowed.carries else whole
