"""An explanation keeps the night's decision on the valve, which includes neighbouring loops and earlier nights."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analyzer.explain.case import as_decided
from analyzer.loop.cause.verdict import Verdict
from analyzer.loop.decisions import Cause, Fault, decided_fault
from identification.mismatch.diagnosis import shown_by_cycles
from identification.mismatch.recording import Recording, SeenInCycles
from identification.models import Backlash, Fopdt, Stiction

ALONE = Verdict(Cause.VALVE, {Cause.VALVE: 90.0}, Fault.STICTION)


def test_a_valve_without_fault_in_the_night_has_none_in_the_explanation() -> None:
    """If the night finds no valve fault, the explanation of the loop, whose own cycle suggests one, finds none
    either.
    """
    assert as_decided(ALONE, Fault.NONE).cause is Cause.UNDECIDED
    assert as_decided(ALONE, Fault.NONE).fault is Fault.NONE


@pytest.mark.parametrize("fault", [None, Fault.UNDECIDED])
def test_without_a_decision_the_own_verdict_of_the_loop_is_used(fault: Fault | None) -> None:
    """If no night assessed the valve, or the night was undecided, the loop's own verdict is explained."""
    assert as_decided(ALONE, fault) is ALONE


def test_the_kind_of_fault_is_that_of_the_nights() -> None:
    """The kind of fault that the nights name replaces the kind that one day shows."""
    assert as_decided(ALONE, Fault.BACKLASH) == replace(ALONE, fault=Fault.BACKLASH)


@pytest.mark.parametrize(
    ("status", "stated_fault", "fault"),
    [("ok", "none", Fault.NONE), ("ok", None, None), ("not assessed", "backlash", None)],
)
def test_only_an_assessed_row_decides(status: str, stated_fault: str | None, fault: Fault | None) -> None:
    """A row without a valve verdict, or of a loop that was not assessed, decides nothing."""
    assert decided_fault({"status": status, "valve_fault": stated_fault}) == fault
    assert decided_fault(None) is None


@pytest.mark.parametrize(("valve", "taken"), [(Backlash(2.0), "backlash"), (Stiction(2.0, 1.0), "stiction")])
def test_the_effect_is_of_the_nights_kind(valve: Backlash | Stiction, taken: str) -> None:
    """Of backlash and stiction, the effect of the night's kind is chosen, also if it is not the first candidate.

    The dead band of a positioner counts as neither.
    """
    seen = SeenInCycles(Fopdt(1.0, 10.0, 1.0), valve, 10, 0.9, 100.0)
    x = np.zeros(4)
    s = Recording(None, x, x, x == 0.0, 1.0, x, cycles=seen)
    row = SimpleNamespace(params=())
    order: list[Any] = [
        SimpleNamespace(name=name, row=row) for name in ("positioner", "stiction", "backlash")
    ]
    for candidates in (order, order[::-1]):
        assert shown_by_cycles(s, candidates).name == taken  # type: ignore[union-attr]
