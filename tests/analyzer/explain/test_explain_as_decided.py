"""An explanation keeps what the night decided of the valve, which knows the loops beside it and the nights before."""

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


def test_a_valve_that_the_night_clears_is_not_blamed() -> None:
    """A loop that by itself looks worn and follows another has no valve at fault in its explanation either."""
    assert as_decided(ALONE, Fault.NONE).cause is Cause.UNDECIDED
    assert as_decided(ALONE, Fault.NONE).fault is Fault.NONE


@pytest.mark.parametrize("fault", [None, Fault.UNDECIDED])
def test_without_a_decision_the_loop_stands_by_itself(fault: Fault | None) -> None:
    """Where no night assessed the valve, or it left it open, the loop's own verdict is explained."""
    assert as_decided(ALONE, fault) is ALONE


def test_the_kind_is_the_nights() -> None:
    """The fault that nights name takes the place of the one that one day shows."""
    assert as_decided(ALONE, Fault.BACKLASH) == replace(ALONE, fault=Fault.BACKLASH)


@pytest.mark.parametrize(
    ("status", "told", "fault"),
    [("ok", "none", Fault.NONE), ("ok", None, None), ("not assessed", "backlash", None)],
)
def test_only_an_assessed_row_decides(status: str, told: str | None, fault: Fault | None) -> None:
    """A row without a valve's verdict, or of a loop that was not assessed, decides nothing."""
    assert decided_fault({"status": status, "valve_fault": told}) == fault
    assert decided_fault(None) is None


@pytest.mark.parametrize(("valve", "taken"), [(Backlash(2.0), "backlash"), (Stiction(2.0, 1.0), "stiction")])
def test_the_effect_is_of_the_nights_kind(valve: Backlash | Stiction, taken: str) -> None:
    """Of play and stick-slip that of the night's kind is taken, also where the other leaves less; a positioner's dead
    band is neither."""
    seen = SeenInCycles(Fopdt(1.0, 10.0, 1.0), valve, 10, 0.9, 100.0)
    x = np.zeros(4)
    s = Recording(None, x, x, x == 0.0, 1.0, x, cycles=seen)
    row = SimpleNamespace(params=())
    order: list[Any] = [
        SimpleNamespace(name=name, row=row) for name in ("positioner", "stiction", "backlash")
    ]
    for candidates in (order, order[::-1]):
        assert shown_by_cycles(s, candidates).name == taken  # type: ignore[union-attr]
