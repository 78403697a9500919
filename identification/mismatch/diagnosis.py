"""From one recording to its explanation: recorder, controller, then effect by effect until nothing passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.controller.check import LATE_SAMPLES, judge
from identification.controller.pi_regression import ControlLaw, shifted, unstated_law
from identification.estimation.candidate import Fitted, Model, Problem, gain
from identification.estimation.prediction_error import descend
from identification.mismatch import recording_faults
from identification.mismatch.catalogue import CANDIDATES, CONTROLLER_FAULTS, EFFECTS, RECORDER_FAULTS, fault
from identification.mismatch.cross_validation import passes
from identification.mismatch.effect import Ends, Friction
from identification.mismatch.experiment import agreed, is_experiment
from identification.mismatch.explanation import Explanation
from identification.mismatch.forward_selection import (
    Candidate,
    Clip,
    Progress,
    compete,
    integrating_or_first_order,
    penalty,
    prepared,
    silent,
)
from identification.mismatch.kept_effects import beyond_the_grid, carried_over
from identification.mismatch.lack_of_fit import ceiling
from identification.mismatch.outside import OUTSIDE, RIVALS, about
from identification.mismatch.recording import Finding, Recording, SeenInCycles
from identification.mismatch.sets_of_effects import replacement_step, without_the_idle
from identification.mismatch.starts.from_cycles import from_cycles, is_friction
from identification.mismatch.starts.screening import candidate_inputs
from identification.models import Stiction
from identification.record import Floats, Mask
from identification.simulation.open_loop import ModelInputs
from identification.simulation.parameters import Slot


def recorder_finding_of(s: Recording) -> Finding | None:
    """The first thing that the recorder did to the trends."""
    for effect in RECORDER_FAULTS:
        found = effect.find(s) if effect.find is not None else None
        if found is not None:
            return replace(found, name=effect.name)
    return None


def controller_finding_of(s: Recording, recorder: Finding | None) -> tuple[Finding | None, ControlLaw | None]:
    """What clock and controller did, where there is a controller to judge and a recording fit for it, and the law
    that gives OP, stated or not."""
    if s.sp is None or ends(recorder) is Ends.ALL:
        return None, None
    if any(recording_faults.straightened(x, s.limits.recorder.straight_law) for x in (s.pv, s.op)):
        return None, None
    free = s.usable & (s.op > 0.05) & (s.op < 99.95)
    if s.stated is None:
        return None, unstated_law(s.sp, s.pv, s.op, free, s.limits.controller)
    found, law = judge(s.sp, s.pv, s.op, free, s.stated, s.limits.controller)
    if found is None:
        return None, law
    return Finding(found.values, found.where, CONTROLLER_FAULTS[found.fault].name), law


def ends(finding: Finding | None) -> Ends:
    """What a finding leaves to be asked. After one about the controller the physics is still asked, for whatever made
    OP, PV answers it."""
    return Ends.NOTHING if finding is None else fault(finding.name).ends


def inputs_of(s: Recording) -> ModelInputs:
    """What drives the model of a recording."""
    level = float(np.mean(s.pv))
    neighbour = s.neighbours[0] - s.neighbours[0].mean() if s.neighbours else None
    span = (float(s.pv.min()), float(s.pv.max()))
    return ModelInputs(s.op, s.dt_s, float(s.op.mean()), level, span, (), neighbour, pv=s.pv - level)


def without_spikes(pv: Floats, usable: Mask) -> Mask:
    """Usable samples less single values that stand far off both neighbours."""
    rise = np.diff(pv)
    alone = np.zeros(pv.size, dtype=bool)
    size = np.median(np.abs(rise)) + 1e-9
    away = np.minimum(np.abs(rise[:-1]), np.abs(rise[1:]))
    alone[1:-1] = (away > 20 * size) & (np.sign(rise[:-1]) != np.sign(rise[1:]))
    return usable & ~alone


def transmitter_end(recorder: Finding | None, pv: Floats) -> Clip | None:
    """Where a transmitter's range ends, if it does."""
    if recorder is None or not fault(recorder.name).censors:
        return None
    (value,) = recorder.values.values()
    return Clip(value, value > float(np.median(pv)), recorder.where)


def explain(s: Recording, tell: Progress = silent, brought: Floats | None = None) -> Explanation:
    """Explain where a plain loop and a recording differ.

    Parameters
    ----------
    s : Recording
    tell : callable
        Is told what is tried, for progress.
    brought : ndarray of shape (SIZE,) or None
        Constants of the user's own model, with which the plain loop's search begins beside its own starts.

    Returns
    -------
    Explanation
    """
    s = replace(
        s, usable=s.usable & ~recording_faults.unlogged(s.stamp_s, s.pv.size, s.dt_s, s.limits.recorder)
    )
    recorder = recorder_finding_of(s)
    controller, law = controller_finding_of(s, recorder)
    usable = without_spikes(s.pv, s.usable)
    late_s = 0.0
    pv = s.pv
    late = 0.0 if controller is None else controller.values.get(LATE_SAMPLES, 0.0)
    if late:
        late_s, pv = late * s.dt_s, shifted(pv, late)
    inputs = inputs_of(replace(s, pv=pv))
    tell("plain loop")
    clip = transmitter_end(recorder, pv)
    p, plain = prepared(inputs, pv - inputs.level, usable, brought, clip, s.limits)
    found = Explanation(
        p,
        plain,
        plain,
        recorder=recorder,
        cycles=s.cycles,
        controller=controller,
        law=law,
        late_s=late_s,
    )
    if any(ends(x) is Ends.ALL for x in (recorder, controller)):
        return carried_over(found)
    told = beyond_the_grid(physics(found, tell, s))
    if not is_experiment(s):
        return carried_over(told)
    p, plain = prepared(inputs, pv - inputs.level, usable, brought, clip, s.limits, experiment=True)
    by_misfit = carried_over(beyond_the_grid(physics(replace(found, p=p, plain=plain, best=plain), tell, s)))
    return agreed(told, by_misfit)


def physics(found: Explanation, tell: Progress, s: Recording) -> Explanation:
    """Add effects of the catalogue one by one, as long as one passes; first a valve that the cycles show."""
    limits = found.p.limits.search
    p, best = integrating_or_first_order(found.p, found.plain, s.kind)
    found = replace(found, p=p, plain=best)
    accepted: list[Candidate] = []
    first: tuple[Candidate, ...] = ()
    candidates: list[Candidate] = []
    outside: Candidate | None = None
    rows = (*CANDIDATES, *RIVALS) if has_rivals(s) else CANDIDATES
    for _ in range(limits.rounds):
        x = candidate_inputs(p, best, s.circumstances)
        candidates = compete(x, best, rows, tell)
        if s.cycles is not None and not accepted:
            candidates = with_cycles(x.p, best, s.cycles, candidates)
        first = first or tuple(c for c in candidates if c.name in EFFECTS)
        winner = shown_by_cycles(s, candidates) if not accepted else None
        winner = winner or proven(x.p, best, candidates)
        if winner is not None and winner.name in OUTSIDE:
            if winner.penalised > limits.ceiling_share * gain(best, found.plain):
                outside = winner
                break
            winner = proven(x.p, best, [c for c in candidates if c.name in EFFECTS])
        if winner is None:
            break
        accepted.append(winner)
        p, best = x.p, descend(x.p, winner.fit.model, limits.full_steps)
    if len(accepted) > 1:
        told = shown_by_cycles(s, [accepted[0]]) is not None
        if not told:
            tell("other sets of effects")
            x = candidate_inputs(p, best, s.circumstances)
            best, accepted = replacement_step(x, best, accepted, tell)
        best, accepted = without_the_idle(p, best, accepted, int(told))
    won, weights = ceiling(p, best)
    least = max(limits.ceiling_penalty, limits.ceiling_share * gain(best, found.plain))
    left = won - 0.5 * weights - least
    if not accepted and any(r.row.needs == "steps" and r.penalised > 0 for r in candidates):
        left = max(left, candidates[0].penalised)
    if outside is not None:
        left = max(left, outside.penalised)
    found = replace(found, p=p, best=best, accepted=tuple(accepted), first=first, outside=outside)
    return replace(found, left=left if left > 0 else 0.0)


def has_rivals(s: Recording) -> bool:
    """Whether physics of no name, which goes with PV as recorded, may be what acts.

    In a loop that cycles, PV of any while ago tells PV, whatever makes it cycle; in an experiment, which is judged by
    its simulation, what is fed with recorded PV is no simulation.
    """
    return s.cycles is None and not s.free_valve and not is_experiment(s)


def with_cycles(p: Problem, near: Fitted, seen: SeenInCycles, candidates: list[Candidate]) -> list[Candidate]:
    """The candidates and those begun where the cycles show a valve, best first; of each name the better."""
    begun = []
    for fit in from_cycles(p, near, seen, CANDIDATES):
        won = gain(fit, near)
        begun.append(Candidate(fit, won, won - penalty(p, fit.model.added[-1])))
    best: dict[str, Candidate] = {}
    for c in sorted([*candidates, *begun], key=lambda c: -c.penalised):
        best.setdefault(f"{c.name} {c.row.label}", c)
    return list(best.values())


def shown_by_cycles(s: Recording, candidates: list[Candidate]) -> Candidate | None:
    """The best play or stick-slip, where the loop's cycles show a faulty valve; None where they do not.

    Cycles that show a jump are believed: a slip now and then late hides it from one constant friction. Where there is
    no cycle, a slip or two say no more than run read from them.
    """
    if s.cycles is None:
        return None
    rubs = [c for c in candidates if is_friction(c.name)]
    if isinstance(s.cycles.valve, Stiction) or not s.cycles.cycling:
        wanted = Friction.STICKS if isinstance(s.cycles.valve, Stiction) else Friction.PLAY
        rubs = [*(c for c in rubs if about(c.name).friction is wanted), *rubs]
    return rubs[0] if rubs else None


def proven(p: Problem, near: Fitted, candidates: list[Candidate]) -> Candidate | None:
    """The best candidate with a gain left after its penalty that passes the proof.

    In an experiment one that is bound to a time is taken where none that lasts does anything: a course of the load
    can be drawn through whatever the model lacks, and no data can be held out from it.
    """
    gains = [c for c in candidates if c.penalised > 0]
    if p.by_simulation:
        lasts = any(not about(name).timed for name in near.names)
        gains = [c for c in gains if not (lasts and about(c.name).timed)]
        gains.sort(key=lambda c: about(c.name).timed)
    for candidate in gains[: p.limits.proof.proven]:
        if passes(p, near, candidate.fit, about(candidate.name)):
            return candidate
    return None


def alternatives(found: Explanation) -> tuple[str, ...]:
    """Names that the data cannot tell from the first effect: as good, or of the same mark by their nature."""
    if not found.accepted:
        return ()
    winner = found.accepted[0]
    close = [
        r.name for r in found.first if r.penalised > max(winner.penalised - found.p.limits.search.tie, 0.0)
    ]
    names = dict.fromkeys((*close, *EFFECTS[winner.name].indistinguishable))
    return tuple(n for n in names if n != winner.name)


def restored(model: Model) -> dict[str, float]:
    """The plain loop's constants of a model: gain, time constant [s], dead time [s]."""
    c = model.c
    return {"gain": float(c[Slot.K]), "time_constant_s": float(c[Slot.T]), "dead_time_s": float(c[Slot.L])}
