"""Is a candidate's gain real: on spans that were not fitted, and without the one span that pays most."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.candidate import Fitted, Model, Problem, bounds, gain
from identification.estimation.noise import whitened
from identification.estimation.prediction_error import descend
from identification.limits.explain import LIMITS
from identification.mismatch.effect import Effect, Friction
from identification.mismatch.restarts import simulated_anew
from identification.mismatch.starts.screening import at_inlet
from identification.record import Floats
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

BLOCKS = 20
ENDS_OF_SIGNAL = ("opspan", "pvspan")
"""Scales of constants that are places in a signal's range."""


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
    out = np.empty_like(simulated)
    for part in np.array_split(np.arange(y.size), max(y.size // window, 1)):
        slope, bias = np.polyfit(part - part[0], left[part], 1)
        out[part] = simulated[part] + bias + slope * (part - part[0])
    return out


def misfit(y: Floats, simulated: Floats, window: int = 0) -> Misfit:
    """Misfit of a simulation anchored in windows; fit_pct is 100 (1 - rms error / rms of PV so anchored itself)."""
    rmse = float(np.std(y - anchored(y, simulated, window)))
    moves = float(np.std(y - anchored(y, np.zeros(y.size), window)))
    return Misfit(rmse, 100.0 * (1.0 - rmse / max(moves, 1e-12)))


def gains_by_block(p: Problem, better: Fitted, worse: Fitted) -> Floats:
    """Gain in log likelihood [nat] of each of BLOCKS parts of the record, shape (BLOCKS,)."""
    won = 0.5 * p.weight * (worse.e**2 - better.e**2) / max(better.loss, 1e-30)
    return np.array([part.sum() for part in np.array_split(won, BLOCKS)])


def is_one_move(p: Problem) -> bool:
    """Whether OP moves in two parts of the record alone: one experiment, of which no part is left to prove it on."""
    travel = np.sort([float(np.abs(np.diff(part)).sum()) for part in np.array_split(p.inputs.op, BLOCKS)])
    return float(travel[-2:].sum()) > p.limits.proof.one_move * float(travel.sum())


def is_spread(p: Problem, better: Fitted, worse: Fitted) -> bool:
    """Whether a share of the gain remains without the two parts that pay most; True where OP moves in two alone."""
    if is_one_move(p):
        return True
    parts = np.sort(gains_by_block(p, better, worse))
    return float(parts[:-2].sum()) > p.limits.proof.spread * float(parts.sum())


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Before and after on the held-out part: gain of the innovations, and misfit of the simulations.

    overall : misfit over the whole record of the models fitted to all of it, which is what pages draw; window :
    samples after which the simulations begin anew, 0 for one run over all; placed : whether the stem of a valve with
    friction is then placed anew too (restarts.py); least_fit : fit on held-out data from which a model goes with PV.
    """

    gain: float
    fitted: tuple[Misfit, Misfit]
    held: tuple[Misfit, Misfit]
    overall: tuple[Misfit, Misfit]
    window: int = 0
    placed: bool = False
    least_fit: float = LIMITS.proof.least_fit

    @property
    def falls(self) -> bool:
        """Whether the misfit falls over the whole."""
        return self.overall[1].rmse < self.overall[0].rmse

    @property
    def follows(self) -> bool:
        """Whether the better model goes with PV at all on held-out data, and not merely less far astray."""
        return self.held[1].fit_pct >= self.least_fit

    @property
    def carries(self) -> bool:
        """Whether the misfit falls, on held-out data and over the whole, to less than PV's own motion."""
        return self.share > 0.0 and self.falls and self.follows

    @property
    def share(self) -> float:
        """Part of the held-out misfit (mean square) that the effect removes."""
        before, after = (m.rmse**2 for m in self.held)
        return 1.0 - after / max(before, 1e-30)


def held_out(p: Problem, worse: Fitted, better: Fitted, cycle: int = 0) -> HeldOut:
    """Both models fitted anew to the first part of the record and compared on the rest.

    cycle : samples of a cycle of a loop whose cycles show a valve with friction, 0 for any other; they are compared
    over such windows too, the stem placed anew in each.

    A model's START is of the first sample, so the rest is simulated from the beginning. They are compared over the
    whole rest, and where load drowns the difference there, over windows of some time constants of the plain loop.
    """
    cut = int((1.0 - p.limits.proof.held_out) * p.y.size)
    early = replace(p, weight=np.where(np.arange(p.y.size) < cut, p.weight, 0.0))
    fits = [_refit(early, m.model) for m in (worse, better)]
    simulated = [simulate(p.inputs, fit.model.c) for fit in fits]
    late = p.weight[cut:]
    whitenings = [whitened(p.y - x, fit.ar, p.edges)[cut:] for x, fit in zip(simulated, fits, strict=True)]
    losses = [float((late * e) @ e) for e in whitenings]
    won = 0.5 * (losses[0] - losses[1]) / max(fits[1].loss, 1e-30) * fits[1].count / max(early.count, 1)
    c = fits[0].model.c
    limits = p.limits.proof
    memory = limits.window_times * float(c[Slot.T] + c[Slot.L]) / p.inputs.dt_s
    window = max(int(memory), limits.window_samples)
    final = [simulate(p.inputs, m.model.c) for m in (worse, better)]
    whole, windowed = (_compared(p, simulated, final, cut, won, size) for size in (0, window))
    if whole.carries:
        return whole
    if cycle:
        anew = _by_cycle(p, [worse, better], fits, cut, won, cycle)
        return windowed if windowed.carries and windowed.share > anew.share else anew
    return windowed if windowed.carries else whole


def course(p: Problem, c: Floats, window: int, placed: bool) -> Floats:
    """PV's deviation [% PV], shape (n,), as drawn and judged: anchored in windows, the stem placed anew or not."""
    return anchored(p.y, simulated_anew(p, c, window) if placed else simulate(p.inputs, c), window)


def _part_misfit(left: Floats, still: Floats) -> Misfit:
    """Misfit of what a simulation leaves of a part of PV, and of what a straight line of load alone leaves."""
    rmse = float(np.std(left))
    return Misfit(rmse, 100.0 * (1.0 - rmse / max(float(np.std(still)), 1e-12)))


def _by_cycle(
    p: Problem, final: list[Fitted], early: list[Fitted], cut: int, won: float, window: int
) -> HeldOut:
    """Compared from cycle to cycle, the stem placed anew in each."""

    still = p.y - anchored(p.y, np.zeros(p.y.size), window)
    parts = (slice(cut), slice(cut, None), slice(None))

    def misfits(fit: Fitted) -> list[Misfit]:
        left = p.y - course(p, fit.model.c, window, True)
        return [_part_misfit(left[part], still[part]) for part in parts]

    (seen0, unseen0, _), (seen1, unseen1, _) = misfits(early[0]), misfits(early[1])
    drawn = (misfits(final[0])[2], misfits(final[1])[2])
    return HeldOut(won, (seen0, seen1), (unseen0, unseen1), drawn, window, True, p.limits.proof.least_fit)


def _compared(
    p: Problem, simulated: list[Floats], final: list[Floats], cut: int, won: float, window: int
) -> HeldOut:
    y, least = p.y, p.limits.proof.least_fit
    seen = [misfit(y[:cut], x[:cut], window) for x in simulated]
    unseen = [misfit(y[cut:], x[cut:], window) for x in simulated]
    drawn = [misfit(y, x, window) for x in final]
    misfits = (seen[0], seen[1]), (unseen[0], unseen[1]), (drawn[0], drawn[1])
    return HeldOut(won, *misfits, window, least_fit=least)


def _refit(p: Problem, model: Model) -> Fitted:
    return descend(p, model, p.limits.search.screen_steps)


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


def in_sound_valves(p: Problem, fit: Fitted, effect: Effect) -> bool:
    """Whether an effect is play or stick-slip no wider than a valve in good order has."""
    wears = effect.friction in (Friction.PLAY, Friction.STICKS)
    return wears and float(fit.model.c[Slot.STICKBAND]) < p.limits.proof.sound_valve


def passes(p: Problem, worse: Fitted, better: Fitted, effect: Effect) -> bool:
    """Whether the effect stands: its constants within their range, no valve in good order, spread over the record
    and, where it is bound to no time, on held-out spans.

    What an effect that is bound to a time will do later does not follow from what it did, so no span is held out.
    """
    if runs_out(p, better) or in_sound_valves(p, better, effect):
        return False
    if effect.needs == "steps":
        return at_inlet(p, worse)
    if effect.timed:
        return True
    if not effect.local and not is_spread(p, better, worse):
        return False
    limits = p.limits.proof
    least = limits.held_out_loss - limits.held_out_share * gain(better, worse)
    return held_out(p, worse, better).gain > least
