"""An effect that replaces another: the reported set of effects is the fitted one."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from identification.estimation.model import Model
from identification.estimation.prediction_error import descended, residual_fit
from identification.mismatch import diagnosis
from identification.mismatch.answer import alternatives
from identification.mismatch.baseline import inputs_of, prepared
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.diagnosis import replacement_step
from identification.mismatch.explanation import Explanation
from identification.mismatch.recording import Recording
from identification.mismatch.selection import Candidate, silent

N = 900


def with_load_step() -> Recording:
    """A lag under manual moves of OP with a load step: a difference equation, not the simulator."""
    rng = np.random.default_rng(3)
    op = 50 + np.repeat(rng.uniform(-6, 6, N // 60), 60)
    y, pv = 0.0, []
    for k in range(N):
        y += (1.2 * (op[max(k - 3, 0)] - 50 + (5.0 if k >= 500 else 0.0)) - y) / 12.0
        pv.append(50 + y + rng.normal(0, 0.05))
    return Recording(None, np.array(pv), op, np.ones(N, dtype=bool), 1.0, np.arange(N, dtype=float))


@cache
def replaced() -> Explanation:
    """The loop explained by two wrong effects, of which a load step replaces the first one."""
    s = with_load_step()
    inputs = inputs_of(s)
    p, plain = prepared(inputs, s.pv - inputs.level, s.usable)
    fit, taken = plain, []
    for name, value in (("gain-drift", 0.2), ("valve-characteristic", 0.1)):
        row = EFFECTS[name].candidates[0]
        c = fit.model.c.copy()
        c[row.params[0].slot] = value
        fit = descended(p, Model((*fit.model.added, row), c), 10)
        taken.append(Candidate(fit, 1.0, 1.0))
    with pytest.MonkeyPatch.context() as only:
        only.setattr(diagnosis, "CANDIDATES", EFFECTS["load-step"].candidates[:1])
        return replacement_step(Explanation(p, plain, fit, tuple(taken)), silent, s)


def test_load_step_that_replaces_another_effect_keeps_its_time() -> None:
    """A new simulation of the set has the residual of the fit, because its load step keeps the located time."""
    found = replaced()
    assert found.best.names == ("valve-characteristic", "load-step")
    assert residual_fit(found.p, found.best.model).loss == pytest.approx(found.best.loss, rel=1e-9)


def test_no_reported_effect_is_an_alternative() -> None:
    """No reported effect is among the alternatives to the first one."""
    found = replaced()
    first = tuple(Candidate(c.fit, 9e9, 9e9) for c in found.accepted)
    again = Explanation(found.p, found.plain, found.best, found.accepted, first)
    assert not set(alternatives(again)) & set(found.best.names)


def test_accepted_effects_have_the_order_of_the_fit() -> None:
    """The accepted effects have the order of the fitted ones; another order is an error."""
    found = replaced()
    assert tuple(c.name for c in found.accepted) == found.best.names
    with pytest.raises(ValueError, match="taken"):
        Explanation(found.p, found.plain, found.best, found.accepted[::-1])
