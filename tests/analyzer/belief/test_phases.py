"""Phases over nights: an overshoot that grows is told with its batch, and one that only scatters is not."""

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
    """A night whose batches follow each other every hour."""
    start = [HOUR * (first + k) for k in range(overshoot.size)]
    told = {
        "begin": begin,
        "end": end,
        "start_s": start,
        "overshoot_pct": overshoot.tolist(),
        "settled_s": [],
    }
    return {"phases": json.dumps([told])}


def of_nights(overshoot: np.ndarray, a_night: int = 8) -> tuple[PhaseKnown, ...]:
    """What is known of a phase after nights of so many batches."""
    known: tuple[PhaseKnown, ...] = ()
    for k in range(0, overshoot.size, a_night):
        known = with_repetitions(known, row(k, overshoot[k : k + a_night]), MOST)
    return known


@pytest.mark.parametrize("seed", range(5))
def test_growth_is_told_with_the_batch_from_which_on(seed: int) -> None:
    """An overshoot of 4 % that grows by one in a hundred from batch 24 on is told so within a few batches."""
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
    """Of a hundred phases that stay, scatter by 3 %, or fall, none is told to grow."""
    for seed in range(100):
        rng = np.random.default_rng(seed)
        seen = 6.0 + rng.normal(0.0, 3.0, 48) - (seed % 2) * np.linspace(0.0, 4.0, 48)
        (phase,) = of_nights(np.maximum(seen, 0.0))
        assert growth(phase, LIMITS) is None


def test_a_night_twice_and_other_levels_are_kept_apart() -> None:
    """A night read again counts no batch twice; another move is another phase; new settings begin anew."""
    once = with_repetitions((), row(0, np.full(8, 3.0)), MOST)
    assert with_repetitions(once, row(0, np.full(8, 3.0)), MOST) == once
    both = with_repetitions(once, row(8, np.full(4, 3.0), begin=50.0, end=80.0), MOST)
    assert [p.count for p in both] == [8, 4]
    assert [(p.count, p.shown) for p in forgotten(both)] == [(8, ()), (4, ())]


def test_beliefs_of_a_version_without_phases_are_read() -> None:
    """What nights before this version believed goes on, its phases begun with the next night."""
    old = json.loads(kept_as(Belief("BIC1", "2026-03-02")))
    del old["phases"]
    assert belief_of(json.dumps(old)).phases == ()
