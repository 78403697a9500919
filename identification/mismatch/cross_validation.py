"""Is a candidate's gain real: on spans that were not fitted, and without the one span that pays most."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.limits import (
    HELD_OUT,
    HELD_OUT_LOSS,
    HELD_OUT_SHARE,
    ONE_MOVE,
    SCREEN_STEPS,
    SPREAD,
    WINDOW_SAMPLES,
    WINDOW_TIMES,
)
from identification.estimation.noise import whitened
from identification.estimation.prediction_error import Fitted, Model, Problem, descend, gain
from identification.mismatch.effect import Effect
from identification.mismatch.starts.screening import at_inlet
from identification.record import Floats
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

BLOCKS = 20


@dataclass(frozen=True, slots=True)
class Misfit:
    """Root mean square [% PV] of PV less a simulation with its mean freed, and the share of PV's motion it fits."""

    rmse: float
    fit_pct: float


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
    return float(travel[-2:].sum()) > ONE_MOVE * float(travel.sum())


def is_spread(p: Problem, better: Fitted, worse: Fitted) -> bool:
    """Whether a share of the gain remains without the two parts that pay most; True where OP moves in two alone."""
    if is_one_move(p):
        return True
    parts = np.sort(gains_by_block(p, better, worse))
    return float(parts[:-2].sum()) > SPREAD * float(parts.sum())


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Before and after on the held-out part: gain of the innovations, and misfit of the simulations.

    overall : misfit over the whole record of the models fitted to all of it, which is what pages draw; window :
    samples after which the simulations begin anew, 0 for one run over all.
    """

    gain: float
    fitted: tuple[Misfit, Misfit]
    held: tuple[Misfit, Misfit]
    overall: tuple[Misfit, Misfit]
    window: int = 0

    @property
    def falls(self) -> bool:
        """Whether the misfit falls over the whole."""
        return self.overall[1].rmse < self.overall[0].rmse

    @property
    def carries(self) -> bool:
        """Whether the misfit falls, on held-out data and over the whole."""
        return self.share > 0.0 and self.falls

    @property
    def share(self) -> float:
        """Part of the held-out misfit (mean square) that the effect removes."""
        before, after = (m.rmse**2 for m in self.held)
        return 1.0 - after / max(before, 1e-30)


def held_out(p: Problem, worse: Fitted, better: Fitted) -> HeldOut:
    """Both models fitted anew to the first part of the record and compared on the rest.

    A model's START is of the first sample, so the rest is simulated from the beginning. They are compared over the
    whole rest, and where load drowns the difference there, over windows of some time constants of the plain loop.
    """
    cut = int((1.0 - HELD_OUT) * p.y.size)
    early = replace(p, weight=np.where(np.arange(p.y.size) < cut, p.weight, 0.0))
    fits = [_refit(early, m.model) for m in (worse, better)]
    simulated = [simulate(p.inputs, fit.model.c) for fit in fits]
    late = p.weight[cut:]
    whitenings = [whitened(p.y - x, fit.ar, p.edges)[cut:] for x, fit in zip(simulated, fits, strict=True)]
    losses = [float((late * e) @ e) for e in whitenings]
    won = 0.5 * (losses[0] - losses[1]) / max(fits[1].loss, 1e-30)
    c = fits[0].model.c
    window = max(int(WINDOW_TIMES * float(c[Slot.T] + c[Slot.L]) / p.inputs.dt_s), WINDOW_SAMPLES)
    final = [simulate(p.inputs, m.model.c) for m in (worse, better)]
    whole, windowed = (_compared(p.y, simulated, final, cut, won, size) for size in (0, window))
    return windowed if windowed.carries and not whole.carries else whole


def _compared(
    y: Floats, simulated: list[Floats], final: list[Floats], cut: int, won: float, window: int
) -> HeldOut:
    seen = [misfit(y[:cut], x[:cut], window) for x in simulated]
    unseen = [misfit(y[cut:], x[cut:], window) for x in simulated]
    drawn = [misfit(y, x, window) for x in final]
    return HeldOut(won, (seen[0], seen[1]), (unseen[0], unseen[1]), (drawn[0], drawn[1]), window)


def _refit(p: Problem, model: Model) -> Fitted:
    return descend(p, model, SCREEN_STEPS)


def passes(p: Problem, worse: Fitted, better: Fitted, effect: Effect) -> bool:
    """Whether the effect stands: spread over the record and, where it is bound to no time, on held-out spans.

    What an effect that is bound to a time will do later does not follow from what it did, so no span is held out.
    """
    if effect.needs == "steps":
        return at_inlet(p, worse)
    if effect.timed:
        return True
    if not effect.local and not is_spread(p, better, worse):
        return False
    return held_out(p, worse, better).gain > HELD_OUT_LOSS - HELD_OUT_SHARE * gain(better, worse)
