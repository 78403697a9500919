"""Explanation of one recording: recorder, controller, baseline model, then effects added one by one until none
passes.

The effects are then tested again as a set; an unexplained residual is reported.

Read on in the order of the analysis: recording, the faults of catalogue/, plain_loop, selection (with starts and
friction), proof, explanation; then answer, with where and location, and words.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identification.controller.check import LATE_SAMPLES, Finding, judge
from identification.controller.pi_regression import ControlLaw, Trends, shifted, unstated_law
from identification.estimation.model import gain
from identification.estimation.prediction_error import FULL_STEPS, descended
from identification.mismatch.answer import holds_zero
from identification.mismatch.baseline import Clip, inputs_of, prepared, without_spikes
from identification.mismatch.candidate_proof import passes
from identification.mismatch.catalogue import CANDIDATES, EFFECTS, RECORDER_FAULTS, fault
from identification.mismatch.effect import TIE, Ends, Friction
from identification.mismatch.explanation import (
    ROUNDS,
    Explanation,
    beyond_the_grid,
    by_cycles,
    carried_over,
    combined_explanation,
    ends,
)
from identification.mismatch.friction import from_cycles, is_friction
from identification.mismatch.outside import COMPETING_EFFECTS, OUTSIDE, about
from identification.mismatch.recording import Recording, SeenInCycles, is_experiment, straightened, unlogged
from identification.mismatch.reference import Prediction, best_prediction
from identification.mismatch.selection import (
    Candidate,
    Progress,
    integrating_or_first_order,
    longest_first,
    penalised,
    penalty,
    ranked_candidates,
    silent,
)
from identification.mismatch.starts import Round, round_of
from identification.models import Stiction
from identification.record import Floats
from identification.simulation.parameters import Slot

LEAST_RESIDUAL = 12.0
"""Gain of the reference's prediction of the last fit's innovations, from which a residual is reported [nat].
Source: proofs/concealed: of 120 explained loops the largest was 10.2, with a fault of the controller 15."""
RESIDUAL_SHARE = 0.05
"""The same over the gain of the named effects: a name is kept if the residual is small compared with it."""
UNTIMED_SHARE = 0.4
"""Part of the gain of timed effects that an untimed reference predicts on held-out data, from which they give
no name. Source: proofs/concealed: of loops whose gain drifts or whose supply varies the largest was .13, of
gains that travel wears half had .4."""
OUTSIDE_SHARE = 0.3
"""Part of the named effects' gain that unnamed physics has to exceed to be reported with them."""
OUTSIDE_NEAR = 0.75
"""Least ratio of the gain of a named effect to that of unnamed physics, for the name to be reported. In 14
sealed cases of such physics the best name has .61 at most. In six vessels that overflow it has .85 or more
of the gain of a load that recorded PV switches."""
PROVEN = 3  # Candidates that are put to the proof, best first, until one passes: bounds the time


def explain(s: Recording, progress: Progress = silent, user_model: Floats | None = None) -> Explanation:
    """Explain the difference between a baseline model and a recording.

    progress : called with each step; user_model : constants of the user's own model, shape (SIZE,), an
    additional start for the baseline fit.
    """
    held = unlogged(s.stamp_s, s.pv.size, s.dt_s, s.limits.recorder)
    s = replace(s, usable=s.usable & ~held)
    recorder = recorder_finding_of(s)
    controller, law = controller_finding_of(s, recorder)
    late = 0.0 if controller is None else controller.values.get(LATE_SAMPLES, 0.0)
    pv = shifted(s.pv, late) if late else s.pv
    inputs, usable = inputs_of(replace(s, pv=pv)), without_spikes(s.pv, s.usable, s.limits.recorder)
    clip = transmitter_end(recorder, pv)
    plain_loop = partial(prepared, inputs, pv - inputs.level, usable, user_model, clip, s.limits)
    progress("baseline model")
    p, plain = plain_loop()
    found = Explanation(
        p,
        plain,
        plain,
        recorder=recorder,
        controller=controller,
        law=law,
        late_s=late * s.dt_s,
        cycles=s.cycles,
        band=s.band,
        every_scan=s.every_scan,
    )
    if any(ends(x) is Ends.ALL for x in (recorder, controller)):
        return carried_over(found)
    explained = beyond_the_grid(with_physical_effects(found, progress, s))
    if not is_experiment(s):
        return without_zero_effects(carried_over(explained))
    p, plain = plain_loop(experiment=True)
    found = replace(found, p=p, plain=plain, best=plain)
    by_misfit = beyond_the_grid(with_physical_effects(found, progress, s))
    return without_zero_effects(combined_explanation(explained, carried_over(by_misfit)))


def without_zero_effects(found: Explanation) -> Explanation:
    """The explanation without effects whose size interval includes zero: there is no evidence of them."""
    kept = int(by_cycles(found))
    rows = zip(found.accepted[kept:], found.best.model.added[kept:], strict=True)
    void = [c for c, row in rows if holds_zero(found.p, found.best, row)]
    return carried_over(found.without_effects(void)) if void else found


def recorder_finding_of(s: Recording) -> Finding | None:
    """The first recorder finding in the trends."""
    found = ((effect.name, effect.find(s)) for effect in RECORDER_FAULTS if effect.find is not None)
    return next((replace(finding, name=name) for name, finding in found if finding is not None), None)


def controller_finding_of(s: Recording, recorder: Finding | None) -> tuple[Finding | None, ControlLaw | None]:
    """Findings about clock and controller, if there is a controller and the recording allows a check, and the control
    law that reproduces OP, stated or not."""
    if s.sp is None or ends(recorder) is Ends.ALL:
        return None, None
    recorder_limits, limits = s.limits.recorder, s.limits.controller
    if any(straightened(x, recorder_limits.straight_law, recorder_limits) for x in (s.pv, s.op)):
        return None, None
    free = s.usable & (s.op > limits.at_limit) & (s.op < 100.0 - limits.at_limit)
    x = Trends(s.sp, s.pv, s.op, free, limits)
    if s.stated is None:
        return None, unstated_law(x)
    return judge(x, s.stated)


def transmitter_end(recorder: Finding | None, pv: Floats) -> Clip | None:
    """End of the transmitter's range, if it clips."""
    if recorder is None or not fault(recorder.name).censors:
        return None
    (value,) = recorder.values.values()
    upper = value > float(np.median(pv))
    return Clip(value, Slot.CLIP_HI if upper else Slot.CLIP_LO, recorder.where)


def with_physical_effects(found: Explanation, progress: Progress, s: Recording) -> Explanation:
    """Add the effects of the catalogue that pass, and the gain [nat] of what remains beyond them: nothing in a record
    without every scan, where OP between the rows predicts PV too."""
    p, best = integrating_or_first_order(found.p, found.plain, s)
    found, last = one_by_one(replace(found, p=p, plain=best, best=best), progress, s)
    if len(found.accepted) > 1:
        found = tested_as_set(found, progress, s)
    residual = unnamed_residual(found, last) if s.every_scan or is_experiment(s) else Prediction()
    return replace(found, residual_nat=residual.gain, residual_by=residual.influence)


def one_by_one(found: Explanation, progress: Progress, s: Recording) -> tuple[Explanation, list[Candidate]]:
    """Effects added while one passes, first a valve identified from the cycles, and the candidates of the last round.

    An effect without a name uses recorded PV. It is excluded in a loop that cycles, because delayed PV
    predicts PV for any cause of the cycle. It is excluded in an experiment, which is judged by simulation,
    because a model with recorded PV as input is no simulation.
    Behind a faulty valve in a record without every scan no further effect is tried: OP
    moves the valve between the rows too, and what the model lacks there takes other names.
    """
    candidates = list[Candidate]()
    has_competitors = s.cycles is None and not s.free_valve and not is_experiment(s) and s.every_scan
    rows = (*CANDIDATES, *COMPETING_EFFECTS) if has_competitors else CANDIDATES
    for _ in range(ROUNDS if s.cycles is None or s.every_scan else 1):
        x = round_of(found.p, found.best, s)
        candidates = ranked_candidates(x, rows, progress)
        if s.cycles is not None and not found.accepted:
            candidates = with_cycles(x, s.cycles, candidates)
        if not found.first:
            found = replace(found, first=tuple(c for c in candidates if c.name in EFFECTS))
        winner = accepted_candidate(x, found, candidates)
        if winner is None:
            break
        if winner.name in OUTSIDE:
            return replace(found, outside=winner), candidates
        best = descended(x.p, longest_first(winner.fit.model), FULL_STEPS)
        found = replace(found, p=x.p, best=best, accepted=(*found.accepted, winner))
    return found, candidates


def accepted_candidate(x: Round, found: Explanation, candidates: list[Candidate]) -> Candidate | None:
    """The accepted candidate of a round. An effect without a name, which uses recorded PV, is accepted only if it is
    far better than the effects so far and than every named effect."""
    winner = None if found.accepted else shown_by_cycles(x.s, candidates)
    winner = winner or best_proven(x, candidates)
    if winner is None or winner.name not in OUTSIDE:
        return winner
    named = best_proven(x, [c for c in candidates if c.name in EFFECTS])
    little = winner.penalised <= OUTSIDE_SHARE * gain(found.best, found.plain)
    near = named is not None and named.penalised >= OUTSIDE_NEAR * winner.penalised
    return named if little or near else winner


def with_cycles(x: Round, seen: SeenInCycles, candidates: list[Candidate]) -> list[Candidate]:
    """The candidates, and those started from the valve that the cycles show, best first; of each name the better."""
    begun = [penalised(x, fit) for fit in from_cycles(x, seen, CANDIDATES)]
    best: dict[tuple[str, str], Candidate] = {}
    for c in sorted([*candidates, *begun], key=lambda c: -c.penalised):
        best.setdefault((c.name, c.row.label), c)
    return list(best.values())


def shown_by_cycles(s: Recording, candidates: Sequence[Candidate]) -> Candidate | None:
    """The best backlash or stick-slip if the loop's cycles show a faulty valve; otherwise None.

    Its kind is that of the batch run, and so are its figures where they exist. The batch run tests each stretch
    separately and allows for slip-to-slip scatter, which constant friction over hours does not.
    """
    if s.cycles is None:
        return None
    worn = [c for c in candidates if is_friction(c.name)]
    sticks = isinstance(s.cycles.valve, Stiction)
    same_kind = [c for c in worn if (about(c.name).friction is Friction.STICKS) == sticks]
    same_numbers = [c for c in same_kind if {q.name for q in c.row.params} == s.cycles.estimates.keys()]
    return next(iter([*same_numbers, *same_kind, *worn]), None)


def best_proven(x: Round, candidates: list[Candidate]) -> Candidate | None:
    """The best candidate that has a positive penalised gain and passes the proof.

    In an experiment a time-bound effect is accepted only if no lasting effect gains anything: a load course can
    absorb any model error, and no data can be held out from it.
    """
    gains = [c for c in candidates if c.penalised > 0]
    if x.p.by_simulation:
        lasts = any(not about(name).timed for name in x.near.names)
        gains = [c for c in gains if not (lasts and about(c.name).timed)]
        gains.sort(key=lambda c: about(c.name).timed)
    tried = gains[:PROVEN]
    return next((c for c in tried if passes(x, c.fit, about(c.name))), None)


def tested_as_set(found: Explanation, progress: Progress, s: Recording) -> Explanation:
    """Test several effects again as a set: replace one by another, remove those made redundant. A valve that the
    cycles show is kept."""
    has_valve = shown_by_cycles(s, found.accepted[:1]) is not None
    if not has_valve:
        progress("other sets of effects")
        found = replacement_step(found, progress, s)
    return without_redundant(found, int(has_valve))


def replacement_step(found: Explanation, progress: Progress, s: Recording) -> Explanation:
    """Replace each effect once by another effect or another variant that gains more together with the others.

    Effects are added one at a time, so the first may have been accepted instead of two that act together. In an
    experiment no time-bound effect replaces a lasting one, because a load course can absorb any model error.
    """
    x = round_of(found.p, found.best, s)
    # an accepted load step is at this round's positions
    found = replace(found, p=x.p)
    for old in found.accepted:
        lasts = x.p.by_simulation and not EFFECTS[old.name].timed
        rest = replace(x, near=found.without_effects([old]).best)
        least = max(gain(found.best, rest.near) - penalty(x.p, old.row) + TIE, 0.0)
        others = (
            c
            for c in ranked_candidates(rest, CANDIDATES, progress, least)
            if (c.name, c.row.label) != (old.name, old.row.label) and not (lasts and EFFECTS[c.name].timed)
        )
        first = next(others, None)
        if first is not None and first.penalised > least and passes(rest, first.fit, EFFECTS[first.name]):
            best = descended(x.p, first.fit.model, FULL_STEPS)
            kept = (c for c in found.accepted if c is not old)
            found = replace(found, best=best, accepted=(*kept, first))
    return found


def without_redundant(found: Explanation, kept: int) -> Explanation:
    """Remove effects that the others have made redundant, except the first `kept`.

    An effect may have been accepted instead of one that was added later.
    """
    for old in found.accepted[kept:]:
        rest = found.without_effects([old])
        if rest.accepted and gain(found.best, rest.best) < penalty(found.p, old.row):
            found = rest
    return found


def unnamed_residual(found: Explanation, candidates: list[Candidate]) -> Prediction:
    """The part of the residual that is predictable but has no name among the effects; zero if there is none.

    The residual is what an unnamed reference predicts of the innovations. If time-bound effects gain hardly more on
    all data, what it predicts of the baseline model's innovations on held-out data counts too: a load course can
    absorb any model error, and what can be predicted without time is not bound to time.
    """
    won = gain(found.best, found.plain)
    residual = best_prediction(found.p, found.best)
    if residual.gain <= max(LEAST_RESIDUAL, RESIDUAL_SHARE * won):
        residual = Prediction()
    if found.accepted and all(about(c.name).timed for c in found.accepted):
        untimed = best_prediction(found.p, found.plain, clock=False)
        residual = untimed if untimed.gain > max(UNTIMED_SHARE * won, LEAST_RESIDUAL) else residual
    if not found.accepted and any(c.row.needs == "steps" and c.penalised > 0 for c in candidates):
        residual = Prediction(residual.influence, max(residual.gain, candidates[0].penalised))
    if found.outside is not None:
        residual = Prediction(residual.influence, max(residual.gain, found.outside.penalised))
    return residual
