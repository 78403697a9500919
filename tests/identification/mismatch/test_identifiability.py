"""A record that cannot give an answer states what it needs and what it has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer import ANSWERS, answer, gain_by_op, too_short, unanswered
from identification.mismatch.baseline import inputs_of, prepared
from identification.mismatch.explanation import Explanation, carried_over
from identification.mismatch.recording import Recording
from identification.simulation.parameters import Slot
from tests.identification.recordings import noise, recording


def baseline_fit(s: Recording) -> Explanation:
    """The fit of the baseline model alone."""
    inputs = inputs_of(s)
    p, plain = prepared(inputs, s.pv - inputs.level, s.usable)
    return carried_over(Explanation(p, plain, plain))


def test_loop_with_moves_is_identifiable() -> None:
    """A loop with a time constant of 20 s over 5,000 s with set-point moves is identifiable, and its verdict is
    none."""
    s = recording(1)
    found = baseline_fit(s)
    assert unanswered(found) == too_short(found, s) == ""
    found_answer = answer(found, s)
    assert (found_answer.verdict, found_answer.caution) == ("none", "")


def test_op_without_a_pv_response_gives_no_verdict() -> None:
    """A moving OP with a PV of pure noise gives no gain, and the answer states what is needed."""
    s = recording(2)
    rng = np.random.default_rng(3)
    insensitive = replace(s, pv=50 + noise(77), op=50 + np.cumsum(rng.normal(0, 0.2, s.pv.size)))
    found = baseline_fit(insensitive)
    assert "needs moves of OP to which PV responds" in unanswered(found)
    found_answer = answer(found, insensitive)
    assert (found_answer.verdict, found_answer.block) == ("unexplained", "none")
    assert "without OP the fit is as good" in found_answer.note


def test_slow_level_is_identifiable_although_its_gain_is_unknown() -> None:
    """A near integrator is identifiable, although only the ratio of its gain and time constant is known."""
    s = recording(5)
    found = baseline_fit(s)
    assert gain_by_op(found.p, found.plain) > 10 * ANSWERS


@pytest.mark.parametrize(("kind", "too_short_expected"), [("temperature", True), ("level", False)])
def test_short_record_is_reported_unless_the_process_may_integrate(
    kind: str, too_short_expected: bool
) -> None:
    """A record of 2.5 time constants is too short for a self-regulating process. It is not too short for a
    level, which may integrate."""
    s = replace(recording(4), kind=kind)
    found = baseline_fit(s)
    slow = found.plain.model.c.copy()
    slow[Slot.T] = s.pv.size * s.dt_s / 2.5
    model = replace(found.plain.model, c=slow)
    found = replace(found, plain=replace(found.plain, model=model))
    assert ("needs 5 time constants, has 2.5" in too_short(found, s)) is too_short_expected
