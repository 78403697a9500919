"""Phases over nights: an overshoot that grows is reported with its batch, and an overshoot that only scatters is not
reported.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from analyzer.belief.belief import Belief, belief_of, kept_as
from analyzer.belief.wear import PhaseKnown, forgotten, growth, with_repetitions
from analyzer.config import WearLimits

LIMITS, HOUR, MOST = WearLimits(), 3600.0, 60


def row(first: int, overshoot: np.ndarray, begin: float = 20.0, end: float = 50.0) -> dict[str, Any]:
    """A night with one batch every hour."""
    start = [HOUR * (first + k) for k in range(overshoot.size)]
    phase = {
        "begin": begin,
        "end": end,
        "start_s": start,
        "overshoot_pct": overshoot.tolist(),
        "settled_s": [],
    }
    return {"phases": json.dumps([phase])}


def of_nights(overshoot: np.ndarray, a_night: int = 8) -> tuple[PhaseKnown, ...]:
    """The phases known after nights with `a_night` batches each."""
    known: tuple[PhaseKnown, ...] = ()
    for k in range(0, overshoot.size, a_night):
        known = with_repetitions(known, row(k, overshoot[k : k + a_night]), MOST)
    return known


@pytest.mark.parametrize("seed", range(5))
def test_growth_is_reported_with_the_batch_at_which_it_begins(seed: int) -> None:
    """An overshoot of 4 % that grows by 1 % per batch from batch 24 on is found within five batches."""
    x = np.arange(48)
    seen = 4.0 + np.maximum(x - 23, 0) * 1.0 + np.random.default_rng(seed).normal(0.0, 1.0, 48)
    (phase,) = of_nights(seen)
    found = growth(phase, LIMITS)
    assert phase.count == 48
    assert found is not None
    assert abs(found.number - 24) <= 5
    assert found.before == pytest.approx(4.0, abs=2.0)
    assert found.now == pytest.approx(26.0, abs=2.0)
    assert found.start_s == HOUR * (found.number - 1)


def test_what_scatters_falls_or_jumps_once_is_no_growth() -> None:
    """Of a hundred phases that stay constant, scatter by 3 %, or fall, none is reported as growing."""
    for seed in range(100):
        rng = np.random.default_rng(seed)
        seen = 6.0 + rng.normal(0.0, 3.0, 48) - (seed % 2) * np.linspace(0.0, 4.0, 48)
        (phase,) = of_nights(np.maximum(seen, 0.0))
        assert growth(phase, LIMITS) is None


def test_a_night_twice_and_other_levels_are_kept_apart() -> None:
    """A night read again counts no batch twice, other levels are another phase, and new settings start the
    repetitions again.
    """
    once = with_repetitions((), row(0, np.full(8, 3.0)), MOST)
    assert with_repetitions(once, row(0, np.full(8, 3.0)), MOST) == once
    both = with_repetitions(once, row(8, np.full(4, 3.0), begin=50.0, end=80.0), MOST)
    assert [p.count for p in both] == [8, 4]
    assert [(p.count, p.shown) for p in forgotten(both)] == [(8, ()), (4, ())]


def test_beliefs_of_a_version_without_phases_are_read() -> None:
    """Beliefs stored by a version without phases are read; their phases start empty."""
    old = json.loads(kept_as(Belief("BIC1", "2026-03-02")))
    del old["phases"]
    assert belief_of(json.dumps(old)).phases == ()
