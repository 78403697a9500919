"""Is a candidate's gain real: on spans that were not fitted, and without the one span that pays most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.candidate import Fitted, Problem, bounds, gain
from identification.estimation.noise import whitened
from identification.estimation.prediction_error import descend
from identification.mismatch.effect import Effect, Friction
from identification.mismatch.starts.screening import at_inlet
from identification.record import Floats
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

BLOCKS = 20
ENDS_OF_SIGNAL = ("opspan", "pvspan")
"""Scales of constants that are places in a signal's range."""


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


def early_part(p: Problem) -> tuple[Problem, int]:
    """The problem with the first part of the record alone to be fitted, and the first sample held out."""
    cut = int((1.0 - p.limits.proof.held_out) * p.y.size)
    return replace(p, weight=np.where(np.arange(p.y.size) < cut, p.weight, 0.0)), cut


def held_out_gain(p: Problem, fits: tuple[Fitted, Fitted]) -> float:
    """Gain in log likelihood [nat] on the part held out, of two models fitted to the first part, worse and better."""
    early, cut = early_part(p)
    late = p.weight[cut:]
    whitenings = [whitened(p.y - simulate(p.inputs, fit.model.c), fit.ar, p.edges)[cut:] for fit in fits]
    losses = [float((late * e) @ e) for e in whitenings]
    won = 0.5 * (losses[0] - losses[1]) / max(fits[1].loss, 1e-30)
    return won * fits[1].count / max(early.count, 1)


def fitted_early(p: Problem, worse: Fitted, better: Fitted) -> tuple[Fitted, Fitted]:
    """Both models fitted anew to the first part of the record; a model's START is of its first sample."""
    early, _ = early_part(p)
    steps = p.limits.search.screen_steps
    return descend(early, worse.model, steps), descend(early, better.model, steps)


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
    return held_out_gain(p, fitted_early(p, worse, better)) > least
