"""What was found in one recording: fits without and with effects, in which order, and which of them stand: those
larger than the recorder's grid that carry over to held-out data."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from identification.controller.check import Finding
from identification.controller.pi_regression import ControlLaw
from identification.estimation.prediction_error import Fitted, Problem, descended
from identification.mismatch.catalogue import EFFECTS, fault
from identification.mismatch.effect import Ends
from identification.mismatch.friction import is_friction
from identification.mismatch.proof import HeldOut, OnOther, held_out, is_one_move
from identification.mismatch.recording import STEP, SeenInCycles
from identification.mismatch.selection import Candidate, without
from identification.simulation.open_loop import simulate


@dataclass(frozen=True, slots=True)
class Explanation:
    """What was found.

    recorder, controller : what was found about them; p : the problem that the fits solve; plain, best : fits
    without and with the effects; accepted : the candidates taken, in order; first : the candidates of the first
    round; law : the control law recovered; late_s : PV's lateness that was taken out [s]; left : gain of what is
    left and has no name, 0 where nothing is, and left_by : the way of the reference that foretells it
    (reference.py); proof : plain and best on held-out data; refuted : names of effects that explain the fitted part
    and not the rest; unproven : whether OP moved once, so that nothing is left to prove the effects on; cycles :
    the faulty valve that the loop's cycles show; others : misfits on other recordings, where some were held out
    whole; by_innovations : in an experiment, what innovations alone explain; outside : physics of no name that
    explains it better than any that has one.
    """

    p: Problem = field(repr=False)
    plain: Fitted
    best: Fitted
    accepted: tuple[Candidate, ...] = ()
    first: tuple[Candidate, ...] = ()
    recorder: Finding | None = None
    controller: Finding | None = None
    law: ControlLaw | None = None
    late_s: float = 0.0
    left: float = 0.0
    left_by: str = ""
    proof: HeldOut | None = None
    refuted: tuple[str, ...] = ()
    unproven: bool = False
    cycles: SeenInCycles | None = None
    others: tuple[OnOther, ...] = ()
    outside: Candidate | None = None
    by_innovations: Explanation | None = field(default=None, repr=False)

    @property
    def proven(self) -> HeldOut:
        """The proof, which every explanation that is told of has."""
        if self.proof is None:
            raise ValueError("an explanation that was not put to the proof")
        return self.proof

    @property
    def finding(self) -> Finding | None:
        """The finding about recorder or controller that is named first; None where an effect stands before it, as one
        of valve or process does that is larger than the steps of PV's grid. A load says nothing against the grid."""
        ends = Ends.NOTHING if self.recorder is None else fault(self.recorder.name).ends
        lasting = bool(self.accepted) and not EFFECTS[self.accepted[0].name].timed
        if lasting and self.controller is None and ends is Ends.SMALLER:
            return None
        return self.recorder or self.controller


def beyond_the_grid(found: Explanation) -> Explanation:
    """The explanation without effects that move PV by less than the steps in which a recorder left it."""
    step = 0.0 if found.recorder is None else found.recorder.values.get(STEP, 0.0)
    if step <= 0.0:
        return found
    count, kept = len(found.accepted), found
    while count > int(by_cycles(found)) and mark(kept) < found.p.limits.recorder.grid_mark * step:
        count -= 1
        kept = first_effects(found, count)
    return kept


def by_cycles(found: Explanation) -> bool:
    """Whether the first effect is a faulty valve that the loop's cycles show."""
    return found.cycles is not None and bool(found.accepted) and is_friction(found.accepted[0].name)


def is_stack(found: Explanation) -> bool:
    """Whether a loop is given as many effects as are looked for: one that the catalogue lacks comes out as a stack of
    those it has. Rigs in open loop do have several."""
    return len(found.accepted) >= found.p.limits.search.rounds and not found.p.by_simulation


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
        cycling = count == 1 and by_cycles(found)
        proof = held_out(kept.p, kept.plain, kept.best, cycle_of(found) if cycling else 0)
        unproven = not proof.carries and proof.falls and is_one_move(found.p)
        timed = proof.falls and all(EFFECTS[name].timed for name in names[:count])
        if proof.carries or unproven or cycling or timed:
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
    model = without(found.best.model, (c.row for c in found.accepted[count:]))
    best = descended(found.p, model, found.p.limits.search.full_steps)
    return replace(found, best=best, accepted=found.accepted[:count], outside=None)
