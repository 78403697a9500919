"""Experiments in open loop: OP moved by hand or by a script, so that what a simulation misses is the model's lack.

Where a controller answers PV, a load moves OP too, and only innovations tell effect and load apart (noise.py). Where
none does, no load hides in OP; the innovations then see little of what is slow, for a noise model takes it up.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from identification.controller.pi_regression import fed_back
from identification.estimation.prediction_error import descended, gain
from identification.estimation.start_values import plain_processes
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.explanation import Explanation, carried_over
from identification.mismatch.proof import is_one_move
from identification.mismatch.recording import Recording
from identification.mismatch.selection import without


def is_experiment(s: Recording) -> bool:
    """Whether OP was moved by hand or by a script: nothing is known of a controller, and OP does not answer PV.

    In a loop that cycles, so that PV tells OP's moves and is told by them, OP must stand still nearly always.
    """
    if s.sp is not None or s.stated is not None or fed_back(s.op, s.pv) >= s.limits.controller.feedback:
        return False
    cycles = s.cycles is not None or s.free_valve
    return not cycles or float(np.mean(np.diff(s.op) != 0.0)) < s.limits.controller.by_hand


def coarser_by(s: Recording) -> int:
    """Of how many samples of an experiment one tells all there is to tell of its process; 1 where each is needed."""
    limits = s.limits.search
    most = s.pv.size // limits.experiment_samples
    if most < 2:
        return 1
    fast = min(x.time_constant_s + x.dead_time_s for x in plain_processes(s.pv, s.op, s.usable, s.dt_s))
    return max(min(most, int(fast / (limits.samples_a_lag * s.dt_s))), 1)


def agreed(told: Explanation, by_misfit: Explanation) -> Explanation:
    """Of an experiment's explanations by innovations and by the simulation's misfit the nearer one.

    What the misfit tells, innovations have to second. What is left is what both miss: a load that wanders is no lack
    of the model, and innovations see none in it.
    """
    by_misfit = replace(by_misfit, left=min(told.left, by_misfit.left), by_innovations=told)
    other = judged_by_simulation(told, by_misfit)
    return nearer(other, by_misfit) if is_seconded(by_misfit, told) else other


def most_telling_first(found: Explanation) -> Explanation:
    """The explanation with its effects in the order of what the simulation would miss without each."""
    full = found.p.limits.search.full_steps
    model = found.best.model
    if len(model.added) < 2:
        return found
    missed = {row.name: descended(found.p, without(model, [row]), full).loss for row in model.added}
    ordered = tuple(sorted(model.added, key=lambda row: -missed[row.name]))
    accepted = tuple(sorted(found.accepted, key=lambda c: -missed[c.name]))
    return replace(found, best=replace(found.best, model=replace(model, added=ordered)), accepted=accepted)


def nearer(one: Explanation, other: Explanation) -> Explanation:
    """Of two explanations the one whose simulation is nearer to PV: on held-out data, or over all where none could be
    held out, for OP moved once or an effect is bound to a time."""
    timed = any(EFFECTS[c.name].timed for c in (*one.accepted, *other.accepted))
    over_all = timed or is_one_move(one.p)

    def missed(found: Explanation) -> float:
        if found.proof is None:
            return math.inf
        return (found.proof.overall if over_all else found.proof.held)[1].rmse

    return min(one, other, key=missed)


def is_seconded(found: Explanation, told: Explanation) -> bool:
    """Whether innovations gain what one constant costs by the effects that a simulation's misfit tells: two signs."""
    limits = told.p.limits.search
    seen = descended(told.p, found.best.model, limits.full_steps)
    return gain(seen, told.plain) > limits.search_penalty + limits.parameter_penalty


def judged_by_simulation(found: Explanation, other: Explanation) -> Explanation:
    """An experiment's explanation by innovations, fitted anew to what its simulation misses, as the other one is."""
    best = descended(other.p, found.best.model, other.p.limits.search.full_steps)
    anew = replace(found, p=other.p, plain=other.plain, best=best, left=other.left, by_innovations=found)
    return carried_over(most_telling_first(anew))
