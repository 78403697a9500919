"""A record that cannot answer says what it needs and what it has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer import ANSWERS, answer, brings, too_short, unanswered
from identification.mismatch.explanation import Explanation, carried_over
from identification.mismatch.plain_loop import inputs_of, prepared
from identification.mismatch.recording import Recording
from identification.simulation.parameters import Slot
from tests.identification.recordings import noise, recording


def plainly(s: Recording) -> Explanation:
    """The plain fit alone."""
    inputs = inputs_of(s)
    p, plain = prepared(inputs, s.pv - inputs.level, s.usable)
    return carried_over(Explanation(p, plain, plain))


def test_loop_with_moves_is_informed() -> None:
    """A loop of 20 s time constant over 5,000 s with set-point moves lacks nothing, and its verdict is none."""
    s = recording(1)
    found = plainly(s)
    assert unanswered(found) == too_short(found, s) == ""
    said = answer(found, s)
    assert (said.verdict, said.caution) == ("none", "")


def test_output_that_pv_does_not_answer_is_an_abstention() -> None:
    """OP that wanders beside a PV of pure noise gives no gain, and the verdict says what is needed."""
    s = recording(2)
    rng = np.random.default_rng(3)
    deaf = replace(s, pv=50 + noise(77), op=50 + np.cumsum(rng.normal(0, 0.2, s.pv.size)))
    found = plainly(deaf)
    assert "needs moves of OP to which PV responds" in unanswered(found)
    said = answer(found, deaf)
    assert (said.verdict, said.block) == ("unexplained", "none")
    assert "without OP the fit is as good" in said.note


def test_slow_level_answers_although_its_gain_is_open() -> None:
    """A near integrator, whose gain and time constant are known by their ratio alone, answers OP all the same."""
    s = recording(5)
    found = plainly(s)
    assert brings(found.p, found.plain) > 10 * ANSWERS


@pytest.mark.parametrize(("kind", "told"), [("temperature", True), ("level", False)])
def test_short_record_is_told_unless_it_may_integrate(kind: str, told: bool) -> None:
    """A record of 2.5 time constants is too short for a process that settles; a level need not settle."""
    s = replace(recording(4), kind=kind)
    found = plainly(s)
    slow = found.plain.model.c.copy()
    slow[Slot.T] = s.pv.size * s.dt_s / 2.5
    model = replace(found.plain.model, c=slow)
    found = replace(found, plain=replace(found.plain, model=model))
    assert ("needs 5 time constants, has 2.5" in too_short(found, s)) is told
