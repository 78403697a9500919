"""Proof of one candidate on held-out data, by one-step-ahead prediction."""

from __future__ import annotations

import numpy as np

from identification.estimation.model import Fitted, gain
from identification.estimation.noise import whitened
from identification.estimation.prediction_error import bounds
from identification.estimation.problem import Problem
from identification.mismatch.effect import Effect
from identification.mismatch.friction import WEARS
from identification.mismatch.starts import Round, at_inlet, early_part, fitted_early
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

HELD_OUT_LOSS = -1.0
"""Gain on the held-out part under which an effect falls [nat]: chance moves it by about a half."""
HELD_OUT_SHARE = 0.1
"""Further loss that is allowed, as a share of the whole gain: two thirds of a record determine a slow
effect's constants less precisely."""
SPREAD = 0.15
"""Share of the gain that must remain when the best tenth of the record is left out (loads excepted)."""
ONE_MOVE = 0.8
"""Share of OP's travel in two parts of twenty of the record from which it is one experiment without
spread."""
FAULT_FREE_PCT = 0.1
"""Backlash or stickband below which a valve has no fault [% OP]. Source: the narrowest dead band that a
positioner can be set to (Siemens, SIPART PS2 operating instructions, A5E00074631, parameter DEBA: 0.1 to 10
%)."""
BOUND_SHARE = 0.005  # Part of a constant's range within which it counts as at the range's end
PARTS = 20  # Parts of a record over which a gain, or OP's travel, has to be spread
ENDS_OF_SIGNAL = ("opspan", "pvspan")
"""Scales of constants that are positions in a signal's range."""


def passes(x: Round, better: Fitted, effect: Effect) -> bool:
    """Whether a round's candidate passes: its constants are inside their range, its valve is not fault-free, and its
    gain is spread over the record and, unless it is time-bound, present on held-out spans.

    The past of a time-bound effect does not predict its future, so no span is held out.
    """
    p, worse = x.p, x.near
    is_fault_free = effect.friction in WEARS and better.model.c[Slot.STICKBAND] < FAULT_FREE_PCT
    if is_fault_free or runs_out(p, better):
        return False
    if effect.needs == "steps":
        return at_inlet(p, worse)
    if effect.timed:
        return True
    if not effect.local and not is_spread(p, better, worse):
        return False
    least = HELD_OUT_LOSS - HELD_OUT_SHARE * gain(better, worse)
    return held_out_gain(p, (x.early, fitted_early(p, better))) > least


def runs_out(p: Problem, fit: Fitted) -> bool:
    """Whether a constant of the last added effect is at the far end of its range: the data need another name.

    A bound at zero, or at an end of a signal's range, is where an effect begins, not a far end.
    """
    for q in fit.model.added[-1].params:
        if q.scale in ENDS_OF_SIGNAL:
            continue
        value, (low, high) = float(fit.model.c[q.slot]), bounds(p.inputs, fit.model.c, q)
        near = BOUND_SHARE * (high - low)
        at_high = high != 0.0 and value > (high * (1.0 - BOUND_SHARE) if q.log else high - near)
        at_low = not q.log and low != 0.0 and value < low + near
        if at_high or at_low:
            return True
    return False


def is_one_move(p: Problem) -> bool:
    """Whether OP moves in only two parts of the record: one experiment, with no part left for a proof."""
    parts = np.array_split(p.inputs.op, PARTS)
    travel = np.sort([float(np.abs(np.diff(part)).sum()) for part in parts])
    return float(travel[-2:].sum()) > ONE_MOVE * float(travel.sum())


def is_spread(p: Problem, better: Fitted, worse: Fitted) -> bool:
    """Whether a share of the gain remains without the two parts that gain most; True where OP moves in two."""
    if is_one_move(p):
        return True
    won = 0.5 * p.weight * (worse.e**2 - better.e**2) / max(better.loss, 1e-30)
    parts = np.sort([part.sum() for part in np.array_split(won, PARTS)])
    return float(parts[:-2].sum()) > SPREAD * float(parts.sum())


def held_out_gain(p: Problem, fits: tuple[Fitted, Fitted]) -> float:
    """Gain in log likelihood [nat] on the held-out part, of two models fitted to the first part, worse and better.

    The mean of the innovations there is free: the level of a later load is not known, and an integrator
    adds it up.
    """
    early, cut = early_part(p)
    late = p.weight[cut:]
    whitenings = [whitened(p.y - simulate(p.inputs, fit.model.c), fit.ar, p.edges)[cut:] for fit in fits]
    losses = [float((late * e) @ e - (late @ e) ** 2 / max(late.sum(), 1e-300)) for e in whitenings]
    won = 0.5 * (losses[0] - losses[1]) / max(fits[1].loss, 1e-30)
    return won * fits[1].count / max(early.count, 1)
