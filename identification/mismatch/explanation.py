"""The findings in one recording: fits without and with effects, their order, and the accepted effects. Accepted
effects are larger than the recorder's grid and carry over to held-out data, and to other recordings of the loop, in
which only a bias is fitted.

An experiment in open loop has two explanations. Where a controller responds to PV, a load moves OP too, and only
innovations distinguish effect and load (noise.py). Where OP is moved by hand or by a script, OP contains no load, and
the simulation error is the model error; innovations then show little of slow errors, because a noise model absorbs
them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identification.controller.check import Finding
from identification.controller.pi_regression import ControlLaw
from identification.estimation.model import Fitted, gain
from identification.estimation.prediction_error import FULL_STEPS, descended
from identification.estimation.problem import Problem, problem
from identification.mismatch.candidate_proof import is_one_move
from identification.mismatch.catalogue import EFFECTS, fault
from identification.mismatch.effect import ONE_CONSTANT, Ends
from identification.mismatch.friction import is_friction
from identification.mismatch.model_file import carried, constants, inputs_for, to_data
from identification.mismatch.proof import (
    WINDOW_SAMPLES,
    WINDOW_TIMES,
    HeldOut,
    Misfit,
    OnOther,
    anchored,
    course,
    held_out,
    misfit,
    removed,
)
from identification.mismatch.recording import STEP, Recording, SeenInCycles
from identification.mismatch.selection import Candidate, without
from identification.record import Floats
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

ROUNDS = 3  # Effects named at most: a record seldom shows more
LEAST_IN_BAND = 0.1
"""Share of the misfit that a further effect must remove, held out in the loop's band, or of a load over all data.
Source: a judgement: a tenth of the mean square is 5 % of the rms, which a trend hardly shows."""
LEAST_CYCLE = 20
"""Fewest samples of a window in which the stem is placed again: a line and the place are three numbers."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """The findings in one recording.

    recorder, controller : their findings; p : the problem that the fits solve; plain, best : fits without and with
    the effects; accepted : the accepted candidates, in the order of the best fit; first : the candidates of the first
    round; law : the identified control law; late_s : lateness of PV that was removed [s]; residual_nat : gain of the
    unnamed residual, 0 where there is none, and residual_by : the class of the reference that predicts it
    (reference.py); proof : plain and best on held-out data; refuted : names of effects that fit the first part but
    not the rest; unproven : whether OP moved only once, so that no data remain for a proof; cycles : the faulty valve
    that the loop's cycles show; band : the loop's band, and every_scan, as in Recording; others : misfits on other
    recordings, if some were held out whole; by_innovations : in an experiment, the explanation by innovations alone;
    outside : an effect outside the catalogue that explains it better than any named one.
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
    residual_nat: float = 0.0
    residual_by: str = ""
    proof: HeldOut | None = None
    refuted: tuple[str, ...] = ()
    unproven: bool = False
    cycles: SeenInCycles | None = None
    band: tuple[float, float] | None = None
    every_scan: bool = True
    others: tuple[OnOther, ...] = ()
    outside: Candidate | None = None
    by_innovations: Explanation | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Check that the accepted effects are those of the best fit, in its order; the first one is reported."""
        if tuple(c.name for c in self.accepted) != self.best.names:
            raise ValueError(f"taken {[c.name for c in self.accepted]}, fitted {list(self.best.names)}")

    @property
    def proven(self) -> HeldOut:
        """The proof; every reported explanation has one."""
        if self.proof is None:
            raise ValueError("an explanation that was not put to the proof")
        return self.proof

    def without_effects(self, removed_effects: Sequence[Candidate]) -> Explanation:
        """The explanation without some of its effects, the others refitted."""
        model = without(self.best.model, (c.row for c in removed_effects))
        best = descended(self.p, model, FULL_STEPS)
        gone = {c.name for c in removed_effects}
        return replace(self, best=best, accepted=tuple(c for c in self.accepted if c.name not in gone))

    @property
    def finding(self) -> Finding | None:
        """The finding about recorder or controller that is named first; None if an effect precedes it: one of valve
        or process that is larger than the steps of PV's grid. A load does not contradict the grid."""
        lasting = bool(self.accepted) and not EFFECTS[self.accepted[0].name].timed
        if lasting and self.controller is None and ends(self.recorder) is Ends.SMALLER:
            return None
        return self.recorder or self.controller


def ends(finding: Finding | None) -> Ends:
    """Which further tests a finding allows. After a controller finding the physics is still tested,
    because PV responds to OP independently of what moved it."""
    return Ends.NOTHING if finding is None else fault(finding.name).ends


def beyond_the_grid(found: Explanation) -> Explanation:
    """The explanation without effects on PV smaller than the steps of the recorder's grid."""
    step = 0.0 if found.recorder is None else found.recorder.values.get(STEP, 0.0)
    if step <= 0.0:
        return found
    count, kept, least = len(found.accepted), found, found.p.limits.recorder.grid_mark * step
    while count > int(by_cycles(found)) and joint_change(kept) < least:
        count -= 1
        kept = first_effects(found, count)
    return kept


def by_cycles(found: Explanation) -> bool:
    """Whether the first effect is a faulty valve identified from the loop's cycles."""
    return found.cycles is not None and bool(found.accepted) and is_friction(found.accepted[0].name)


def is_stack(found: Explanation) -> bool:
    """Whether a loop has as many effects as the search allows: an effect outside the catalogue is fitted by a stack
    of others. Rigs in open loop can have several effects."""
    return len(found.accepted) >= ROUNDS and not found.p.by_simulation


def joint_change(found: Explanation) -> float:
    """Standard deviation of the joint change that the effects make in the simulated PV [% PV]."""
    plain, best = (simulate(found.p.inputs, fit.model.c) for fit in (found.plain, found.best))
    return float(np.std(best - plain))


def carried_over(found: Explanation) -> Explanation:
    """The explanation with its proof: the longest sequence of effects, in order, that carries over to held-out data.

    A valve identified from the loop's cycles is proven by them. The phase of a periodic load drifts from its fit, so
    that held-out data in the band do not judge it.
    """
    names = tuple(r.name for r in found.accepted)
    cycle_s = 0.0 if found.cycles is None else found.cycles.cycle_s
    cycle = max(round(cycle_s / found.p.inputs.dt_s), LEAST_CYCLE)
    for count in range(len(names), 0, -1):
        kept = found if count == len(names) else first_effects(found, count)
        cycling = count == 1 and by_cycles(found)
        around = cycle if cycling else 0, found.band, found.every_scan
        proof = held_out(kept.p, kept.plain, kept.best, *around)
        unjudged = is_one_move(found.p) or proof.is_blind
        unproven = not proof.carries and proof.falls and unjudged
        timed = proof.falls and all(EFFECTS[name].timed for name in names[:count])
        timed = timed and (proof.holds_in_band or any(c.row.needs == "line" for c in kept.accepted))
        seen = proof.carries and adds_enough(kept, proof)
        if seen or unproven or cycling or timed:
            return replace(kept, proof=proof, refuted=names[count:], unproven=unproven)
    proof = held_out(found.p, found.plain, found.plain, band=found.band)
    outside = None if names else found.outside
    return replace(found, best=found.plain, accepted=(), proof=proof, refuted=names, outside=outside)


def adds_enough(found: Explanation, proof: HeldOut) -> bool:
    """Whether the last effect removes enough of the held-out misfit in the loop's band, if that is known; a load,
    which may be outside it, of the misfit over all data. A second effect takes up what the first one's model leaves,
    which is a deficit of the model everywhere; the first one only must not add to it."""
    if proof.in_band is None or not proof.holds_in_band:
        return proof.holds_in_band
    if len(found.accepted) == 1:
        return True
    less = first_effects(found, len(found.accepted) - 1)
    before = held_out(less.p, less.plain, less.best, band=found.band)
    if EFFECTS[found.accepted[-1].name].timed:
        return removed(before.overall[1], proof.overall[1]) >= LEAST_IN_BAND
    return before.in_band is None or removed(before.in_band.better, proof.in_band.better) >= LEAST_IN_BAND


def first_effects(found: Explanation, count: int) -> Explanation:
    """The explanation with its first `count` effects only; the others, and findings made with them, are removed."""
    return replace(found.without_effects(found.accepted[count:]), outside=None)


def combined_explanation(ahead: Explanation, by_misfit: Explanation) -> Explanation:
    """Combine an experiment's explanation by innovations, refitted to simulation error, with that by simulation
    misfit.

    The nearer one is chosen. Innovations must confirm an explanation by misfit with a gain of one constant's penalty.
    The residual is what both miss: a wandering load is no model error, and innovations show none.
    """
    residual = min(ahead.residual_nat, by_misfit.residual_nat)
    p = replace(by_misfit.p, inputs=replace(by_misfit.p.inputs, step_at=ahead.p.inputs.step_at))
    refitted = descended(p, ahead.best.model, FULL_STEPS)
    other = replace(
        ahead, p=p, plain=by_misfit.plain, best=refitted, residual_nat=residual, by_innovations=ahead
    )
    other = carried_over(by_importance(other))
    inputs = replace(ahead.p.inputs, step_at=by_misfit.p.inputs.step_at)
    seen = descended(replace(ahead.p, inputs=inputs), by_misfit.best.model, FULL_STEPS)
    is_seconded = gain(seen, ahead.plain) > ONE_CONSTANT
    seconded = replace(by_misfit, residual_nat=residual, by_innovations=ahead)
    return nearer(other, seconded) if is_seconded else other


def by_importance(found: Explanation) -> Explanation:
    """Sort the effects by the increase of the simulation misfit without each."""
    if len(found.accepted) < 2:
        return found
    missed, model = {c.name: found.without_effects([c]).best.loss for c in found.accepted}, found.best.model
    added = tuple(sorted(model.added, key=lambda row: -missed[row.name]))
    accepted = tuple(sorted(found.accepted, key=lambda c: -missed[c.name]))
    return replace(found, best=replace(found.best, model=replace(model, added=added)), accepted=accepted)


def nearer(one: Explanation, other: Explanation) -> Explanation:
    """The explanation whose simulation is nearer to PV: on held-out data, or over all data if none could be held out,
    because OP moved once or an effect is time-bound."""
    timed = any(EFFECTS[c.name].timed for c in (*one.accepted, *other.accepted))
    over_all = timed or is_one_move(one.p)

    def missed(found: Explanation) -> float:
        return (found.proven.overall if over_all else found.proven.held)[1].rmse

    return min(one, other, key=missed)


def on_other(found: Explanation, s: Recording, window: int) -> OnOther:
    """Misfit on another recording, anchored in windows, of the baseline model by either criterion, the better model,
    and the better model without its effects."""
    best = found.best.model

    def misfit_of(c: Floats) -> Misfit:
        data = to_data("", found.p.inputs, c, found.best.names, found.late_s, None)
        if not (window and found.proven.placed):
            return misfit(s.pv, anchored(s.pv, carried(data, s.op, s.pv, s.dt_s), window), window)
        c, here = constants(data), inputs_for(data, s.op, s.pv, s.dt_s)
        y = s.pv - here.level
        c[Slot.START] = float(y[0])
        return misfit(s.pv, here.level + course(problem(here, y, s.usable), c, window, True), window)

    models = (found.plain.model.c, found.proven.drawn[0], best.c, without(best, best.added).c)
    own, drawn, better, cleared = (misfit_of(c) for c in models)
    return OnOther(min(own, drawn, key=lambda x: x.rmse), better, cleared, s.pv.size)


def pooled_misfit(parts: Sequence[Misfit], samples: Sequence[int]) -> Misfit:
    """Misfits of several recordings combined, with equal weight per sample."""
    n = np.array(samples, dtype=np.float64)
    rmse = np.array([m.rmse for m in parts])
    moves = np.array([m.rmse / max(1.0 - (m.fit_pct or 0.0) / 100.0, 1e-9) for m in parts])
    rms, own = (float(np.sqrt(np.sum(n * x**2) / n.sum())) for x in (rmse, moves))
    return Misfit(rms, 100.0 * (1.0 - rms / max(own, 1e-12)))


def window_of(found: Explanation, s: Recording) -> int:
    """Window [samples] for comparing models where the whole shows the load alone, from the proof or the loop."""
    if found.proven.window:
        return max(round(found.proven.window * found.p.inputs.dt_s / s.dt_s), 1)
    c = found.plain.model.c
    memory = WINDOW_TIMES * float(c[Slot.T] + c[Slot.L]) / s.dt_s
    return max(math.ceil(min(memory, 1e9)), WINDOW_SAMPLES)


def compared(found: Explanation, others: Sequence[Recording]) -> tuple[HeldOut, tuple[OnOther, ...]]:
    """The proof on other recordings: over each whole, or over windows where the whole shows the load alone."""
    p, drawn, over_all = found.p, found.proven.drawn, [0] * len(others)
    own = [window_of(found, s) for s in others]
    for windows, placed in ((over_all, False), (own, found.proven.placed)):
        each = tuple(on_other(found, s, window) for s, window in zip(others, windows, strict=True))
        samples = [x.samples for x in each]
        held = (
            pooled_misfit([x.baseline for x in each], samples),
            pooled_misfit([x.explained for x in each], samples),
        )
        window = round(windows[0] * others[0].dt_s / p.inputs.dt_s)
        plain, better = (misfit(p.y, course(p, c, window, placed), window) for c in drawn)
        seen = plain, better
        proof = HeldOut(0.0, seen, held, seen, drawn, window, placed)
        if proof.carries:
            break
    return proof, each


def proven_on(found: Explanation, others: Sequence[Recording]) -> Explanation:
    """Keep the explanation if it carries over to other recordings, otherwise remove its effects.

    A time-bound effect has no meaning in another recording; a valve that the cycles there also show keeps its name.
    The others are of the same loop, in the percent of the fitted recording.
    """
    if not others or not found.accepted:
        return found
    proof, each = compared(found, others)
    names = tuple(c.name for c in found.accepted)
    cycling = by_cycles(found) and any(s.cycles is not None for s in others)
    samples = [x.samples for x in each]
    there = pooled_misfit([x.explained for x in each], samples).rmse
    bare = pooled_misfit([x.without for x in each], samples).rmse
    if (proof.share > 0.0 and proof.follows and there < bare) or cycling:
        return replace(found, proof=proof, others=each, unproven=False)
    if all(EFFECTS[name].timed for name in names):
        return replace(found, others=each)
    plain = replace(found, best=found.plain, accepted=(), refuted=names, unproven=False)
    proof, _ = compared(plain, others)
    return replace(plain, proof=proof, others=each)
