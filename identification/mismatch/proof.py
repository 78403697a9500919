"""Is a rival's gain real: on spans that were not fitted, and without the one span that pays most."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch.fitting import Fitted, Model, Problem, descend, gain
from identification.mismatch.noise import whitened
from identification.mismatch.simulation import simulate
from identification.mismatch.starting import at_inlet
from identification.mismatch.thresholds import (
    HELD_OUT,
    HELD_OUT_LOSS,
    HELD_OUT_SHARE,
    ONE_MOVE,
    SCREEN_STEPS,
    SPREAD,
)
from identification.record import Floats

TIMED = ("load-step", "gain-drift", "supply-variation", "load-oscillation")
"""Effects bound to a time: what they will do later does not follow from what they did, so no span is held out."""
BLOCKS = 20


@dataclass(frozen=True, slots=True)
class Misfit:
    """Root mean square [% PV] of PV less a simulation with its mean freed, and the share of PV's motion it fits."""

    rmse: float
    fit_pct: float


def misfit(y: Floats, simulated: Floats) -> Misfit:
    """Misfit of a simulation with a free bias; fit_pct is 100 (1 - rms error / rms of PV about its mean)."""
    left = y - simulated
    rmse = float(np.std(left))
    return Misfit(rmse, 100.0 * (1.0 - rmse / max(float(np.std(y)), 1e-12)))


def gains_by_block(p: Problem, better: Fitted, worse: Fitted) -> Floats:
    """Doubled log-likelihood gain of each of BLOCKS parts of the record, shape (BLOCKS,)."""
    won = p.weight * (worse.e**2 - better.e**2) / max(better.loss, 1e-30)
    return np.array([part.sum() for part in np.array_split(won, BLOCKS)])


def is_spread(p: Problem, better: Fitted, worse: Fitted) -> bool:
    """Whether a share of the gain remains without the two parts that pay most; True where OP moves in two alone."""
    travel = np.sort([float(np.abs(np.diff(part)).sum()) for part in np.array_split(p.scene.op, BLOCKS)])
    if float(travel[-2:].sum()) > ONE_MOVE * float(travel.sum()):
        return True
    parts = np.sort(gains_by_block(p, better, worse))
    return float(parts[:-2].sum()) > SPREAD * float(parts.sum())


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Before and after on the held-out part: gain of the innovations, and misfit of the simulations."""

    gain: float
    fitted: tuple[Misfit, Misfit]
    held: tuple[Misfit, Misfit]

    @property
    def share(self) -> float:
        """Part of the held-out misfit (mean square) that the effect removes."""
        before, after = (m.rmse**2 for m in self.held)
        return 1.0 - after / max(before, 1e-30)


def held_out(p: Problem, worse: Fitted, better: Fitted) -> HeldOut:
    """Both models fitted anew to the first part of the record and compared on the rest.

    A model's START is of the first sample, so the rest is simulated from the beginning.
    """
    cut = int((1.0 - HELD_OUT) * p.y.size)
    early = replace(p, weight=np.where(np.arange(p.y.size) < cut, p.weight, 0.0))
    fits = [_refit(early, m.model) for m in (worse, better)]
    late = p.weight[cut:]
    losses, seen, unseen = [], [], []
    for fit in fits:
        simulated = simulate(p.scene, fit.model.c)
        e = whitened(p.y - simulated, fit.ar, p.edges)[cut:]
        losses.append(float((late * e) @ e))
        seen.append(misfit(p.y[:cut], simulated[:cut]))
        unseen.append(misfit(p.y[cut:], simulated[cut:]))
    won = (losses[0] - losses[1]) / max(fits[1].loss, 1e-30)
    return HeldOut(won, (seen[0], seen[1]), (unseen[0], unseen[1]))


def _refit(p: Problem, model: Model) -> Fitted:
    return descend(p, model, SCREEN_STEPS)


def passes(p: Problem, worse: Fitted, better: Fitted, name: str) -> bool:
    """Whether the effect stands: spread over the record and, where it is bound to no time, on held-out spans."""
    if name == "load-step":
        return at_inlet(p, worse)
    if name in TIMED:
        return True
    if name not in ("saturation", "overflow") and not is_spread(p, better, worse):
        return False
    return held_out(p, worse, better).gain > HELD_OUT_LOSS - HELD_OUT_SHARE * gain(better, worse)
