"""Wear of a valve is found at the right night and predicted with intervals that contain the truth; a valve without
wear is not reported.
"""

from __future__ import annotations

from datetime import date, timedelta

import numpy as np
import pytest

from analyzer.belief.wear import wear
from analyzer.config import Config

LIMITS = Config().wear
FIRST = date(2026, 1, 1)


def widths(
    true: np.ndarray, seed: int, deviation: float = 0.06, missing: float = 0.0, alike: float = 0.0
) -> list[tuple[str, float, float]]:
    """Widths that nights report for the true widths, some of them missing; `alike` is the standard deviation of an
    error common to all.
    """
    rng = np.random.default_rng(seed)
    true = true * np.exp(alike * np.random.default_rng((seed, 1)).standard_normal())
    seen = true * np.exp(deviation * rng.standard_normal(true.size))
    there = rng.random(true.size) >= missing
    return [
        ((FIRST + timedelta(days=int(k))).isoformat(), float(seen[k]), deviation)
        for k in np.flatnonzero(there)
    ]


def growing(start: float, per_day: float, begins: int, nights: int) -> np.ndarray:
    """A width that is constant and then grows."""
    return start + per_day * np.maximum(np.arange(nights) - begins, 0)


@pytest.mark.parametrize(("missing", "alike"), [(0.0, 0.0), (0.4, 0.0), (0.0, 0.06)])
def test_forecasts_contain_the_truth(missing: float, alike: float) -> None:
    """For at least 20 of 24 wearing valves, the forecast interval contains the day on which the width reaches 5 %.

    The width grows from 0.3 to 3 % in sixty nights. The result holds too if all widths of a valve have a common
    error.
    """
    held = 0
    for seed in range(24):
        true = growing(0.3, 2.7 / 60, 0, 61)
        found = wear(widths(true, seed, missing=missing, alike=alike), LIMITS)
        assert found is not None
        assert found["reaches_pct"] == 5.0
        reached = (FIRST + timedelta(days=int(np.ceil((5.0 - 0.3) / (2.7 / 60))))).isoformat()
        held += bool((found["reaches_from"] or "") <= reached <= (found["reaches_by"] or "9999"))
    assert held >= 20


def test_the_night_from_which_it_grows_is_found() -> None:
    """For ten valves of 1 % that begin to wear on the thirtieth night, the median error of that night is at most six
    nights. The interval of the wear rate contains the truth in at least eight of the ten.
    """
    off, held = [], 0
    for seed in range(10):
        found = wear(widths(growing(1.0, 0.04, 30, 61), seed), LIMITS)
        assert found is not None
        off.append(abs((date.fromisoformat(found["wear_since"]) - FIRST).days - 30))
        held += found["wear_low_pct"] <= 1.2 <= found["wear_high_pct"]
    assert np.median(off) <= 6
    assert held >= 8


def test_a_valve_with_constant_width_is_not_reported_as_wearing() -> None:
    """Of 200 worn valves with constant width and an error 1.5 times the stated one, at most two are reported as
    wearing.
    """
    reported = 0
    for seed in range(200):
        seen = widths(np.full(60, 1.5), seed, deviation=0.09)
        reported += wear([(n, w, 0.06) for n, w, _ in seen], LIMITS) is not None
    assert reported <= 2


def test_few_nights_and_a_repaired_valve_show_no_wear() -> None:
    """Seven nights are too few; a width that falls is no wear."""
    assert wear(widths(growing(0.3, 0.05, 0, 7), 1), LIMITS) is None
    assert wear(widths(growing(3.0, -0.03, 10, 60), 1), LIMITS) is None
    assert wear([], LIMITS) is None
