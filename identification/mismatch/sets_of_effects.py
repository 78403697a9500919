"""Effects taken one by one, looked at again as a set: one in another's place, one that the others have made idle."""

from __future__ import annotations

from identification.estimation.candidate import Fitted, Model, Problem, gain
from identification.estimation.prediction_error import descend
from identification.mismatch.catalogue import CANDIDATES, EFFECTS
from identification.mismatch.cross_validation import passes
from identification.mismatch.forward_selection import Candidate, Progress, compete, penalty
from identification.mismatch.starts.screening import CandidateInputs
from identification.record import Floats
from identification.simulation.effect import Variant
from identification.simulation.parameters import neutral


def replacement_step(
    x: CandidateInputs, best: Fitted, accepted: list[Candidate], tell: Progress
) -> tuple[Fitted, list[Candidate]]:
    """The accepted effects, each given up once for whatever does better beside the others.

    Effects are added one at a time, so the first may have been taken in the place of two that act together.
    """
    limits = x.p.limits.search
    for i, old in enumerate(accepted):
        others = tuple(r for r in best.model.added if r.name != old.name)
        near = descend(x.p, Model(others, cleared(best.model.c, old.row)), limits.full_steps)
        least = max(gain(best, near) - penalty(x.p, old.row) + limits.tie, 0.0)
        candidates = [r for r in compete(x, near, CANDIDATES, tell, least) if may_replace(x.p, r, old)]
        if not candidates:
            continue
        first = candidates[0]
        if first.penalised > least and passes(x.p, near, first.fit, EFFECTS[first.name]):
            best = descend(x.p, first.fit.model, limits.full_steps)
            accepted = [*accepted[:i], first, *accepted[i + 1 :]]
    return best, accepted


def may_replace(p: Problem, new: Candidate, old: Candidate) -> bool:
    """Whether a candidate may stand in an effect's place: another, or another way of the same; in an experiment none
    bound to a time for one that lasts, for through whatever a model lacks a course can be drawn."""
    bound = EFFECTS[new.name].timed and not EFFECTS[old.name].timed
    return (new.name, new.row.label) != (old.name, old.row.label) and not (bound and p.by_simulation)


def without_the_idle(
    p: Problem, best: Fitted, accepted: list[Candidate], kept: int
) -> tuple[Fitted, list[Candidate]]:
    """The accepted effects less those that the others have made idle, the first `kept` of them left alone.

    An effect may have been taken in the place of one that came after it.
    """
    for old in accepted[kept:]:
        if len(accepted) == 1:
            break
        others = tuple(r for r in best.model.added if r.name != old.name)
        near = descend(p, Model(others, cleared(best.model.c, old.row)), p.limits.search.full_steps)
        if gain(best, near) < penalty(p, old.row):
            best, accepted = near, [c for c in accepted if c.name != old.name]
    return best, accepted


def cleared(c: Floats, row: Variant) -> Floats:
    """Constants with those of a row at rest, shape (SIZE,)."""
    out, rest = c.copy(), neutral()
    for slot in [p.slot for p in row.params] + [int(s) for s in row.fixed or {}]:
        out[slot] = rest[slot]
    return out
