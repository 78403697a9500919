"""Which effects of an explanation stand: larger than the recorder's grid, and carried over to held-out data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.candidate import Model
from identification.estimation.prediction_error import descend
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.cross_validation import is_one_move
from identification.mismatch.explanation import Explanation
from identification.mismatch.proof import held_out
from identification.mismatch.recording import STEP
from identification.mismatch.sets_of_effects import cleared
from identification.mismatch.starts.from_cycles import is_friction
from identification.simulation.open_loop import simulate


def beyond_the_grid(found: Explanation) -> Explanation:
    """The explanation without effects that move PV by less than the steps in which a recorder left it."""
    step = 0.0 if found.recorder is None else found.recorder.values.get(STEP, 0.0)
    count, least = len(found.accepted), found.p.limits.recorder.grid_mark * step
    told = int(count > 0 and found.cycles is not None and is_friction(found.accepted[0].name))
    while (
        count > told
        and step > 0
        and mark(found if count == len(found.accepted) else first_effects(found, count)) < least
    ):
        count -= 1
    return found if count == len(found.accepted) else first_effects(found, count)


def mark(found: Explanation) -> float:
    """Standard deviation of what the effects together change in the simulated PV [% PV]."""
    plain, best = (simulate(found.p.inputs, fit.model.c) for fit in (found.plain, found.best))
    return float(np.std(best - plain))


def carried_over(found: Explanation) -> Explanation:
    """The explanation with its proof: as many effects, in the order taken, as carry over to held-out data.

    A valve that the loop's cycles show is proven by them.
    """
    names = tuple(r.name for r in found.accepted)
    for count in range(len(names), 0, -1):
        kept = found if count == len(names) else first_effects(found, count)
        by_cycles = count == 1 and found.cycles is not None and is_friction(names[0])
        proof = held_out(kept.p, kept.plain, kept.best, cycle_of(found) if by_cycles else 0)
        unproven = not proof.carries and proof.falls and is_one_move(found.p)
        timed = proof.falls and all(EFFECTS[name].timed for name in names[:count])
        if proof.carries or unproven or by_cycles or timed:
            return replace(kept, proof=proof, refuted=names[count:], unproven=unproven)
    proof = held_out(found.p, found.plain, found.plain)
    outside = None if names else found.outside
    return replace(found, best=found.plain, accepted=(), proof=proof, refuted=names, outside=outside)


def cycle_of(found: Explanation) -> int:
    """Samples of one cycle of a loop whose cycles show a faulty valve."""
    cycle_s = 0.0 if found.cycles is None else found.cycles.cycle_s
    return max(round(cycle_s / found.p.inputs.dt_s), found.p.limits.proof.least_cycle)


def first_effects(found: Explanation, count: int) -> Explanation:
    """The explanation with its first effects alone; the others, and what was found beside all, are given up."""
    c = found.best.model.c
    for candidate in found.accepted[count:]:
        c = cleared(c, candidate.row)
    names = {r.name for r in found.accepted[:count]}
    rows = tuple(r for r in found.best.model.added if r.name in names)
    best = descend(found.p, Model(rows, c), found.p.limits.search.full_steps)
    return replace(found, best=best, accepted=found.accepted[:count], outside=None)
