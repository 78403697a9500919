"""Three effects in one loop are not reported by name."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.estimation.model import Model
from identification.estimation.noise import NO_NOISE
from identification.mismatch.baseline import inputs_of, prepared
from identification.mismatch.catalogue import CANDIDATES
from identification.mismatch.explanation import Explanation, is_stack
from identification.mismatch.selection import Candidate
from tests.identification.plain_loop import Plant, recording


@pytest.mark.parametrize(("count", "stacked"), [(1, False), (2, False), (3, True)])
def test_three_effects_of_a_loop_are_too_many_and_two_are_not(count: int, stacked: bool) -> None:
    """Three effects of a closed loop count as a stack, one or two do not. Three effects of an experiment do
    not."""
    s = recording(Plant(), 1)
    p, fit = prepared(inputs_of(s), s.pv - s.pv.mean(), s.usable)
    rows = [next(r for r in CANDIDATES if r.name == n) for n in ("slow-mode", "backlash", "gain-drift")]
    taken = tuple(Candidate(replace(fit, model=Model((r,), fit.model.c)), 20.0, 10.0) for r in rows[:count])
    best = replace(fit, model=Model(tuple(rows[:count]), fit.model.c))
    assert is_stack(Explanation(p, fit, best, accepted=taken)) is stacked
    assert not is_stack(Explanation(replace(p, edges=NO_NOISE), fit, best, accepted=taken))
