"""What changed overnight stands under the heading that an engineer expects."""

from __future__ import annotations

import pytest

from analyzer.lane_figures import FIGURE
from analyzer.pages.news import news_table
from analyzer.pages.view import Night

NO_LANES: dict[str, object] = {"lanes": None, **dict.fromkeys(FIGURE.values(), 0.0)}
CALM = {"loop": "L", "status": "ok", "oscillating_pct": 0.0, "oscillation_significance": 0.0, "cause": "none"}
ROW = NO_LANES | CALM | {"kp_new": None, "ti_new": None, "action": "none"}
LOST = {"status": "not assessed", "oscillating_pct": None, "oscillation_significance": None}
CYCLING = {"oscillating_pct": 95.0, "oscillation_significance": 20.0, "cause": "valve"}


def told(before: dict[str, object], now: dict[str, object]) -> tuple[list[str], list[str]]:
    """News of one loop under New and under Better."""
    night = Night("2026-03-03", (ROW | now,), {"L": ROW | before}, "2026-03-02", ())
    tables = [news_table(night, tones, "t", "T") for tones in (("worse", "unclear"), ("better",))]
    return tuple([row[1].text for row in t.rows] for t in tables)  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("before", "now", "new", "better"),
    [
        (CYCLING, {}, [], ["stopped oscillating"]),
        ({}, CYCLING, ["began to oscillate"], []),
        ({"cause": "valve"}, {}, [], ["no fault is seen any more (cause was valve)"]),
        ({}, {"cause": "valve"}, ["a fault is seen: cause valve"], []),
        (CYCLING, CYCLING | {"cause": "load"}, ["the cause is now told as load (was valve)"], []),
        (CYCLING, CYCLING | {"oscillation_significance": 5.0}, [], ["oscillates less than half as much"]),
        (CYCLING, {"oscillating_pct": None, "cause": "undecided"}, [], []),
        ({}, {}, [], []),
    ],
)
def test_news_stand_where_they_belong(before, now, new, better):
    """A cured loop is good news, a fault that comes is new, and a night that could not tell is no news."""
    assert told(before, now) == (new, better)


@pytest.mark.parametrize(
    ("before", "now", "new", "better"),
    [
        ({"lanes": None}, {"lanes": "manual"}, ["new: manual"], []),
        ({"lanes": "at limit, lasting error"}, {"lanes": "at limit"}, [], ["no more: lasting error"]),
        ({"lanes": "sluggish"}, {"lanes": "sluggish"}, [], []),
        ({}, LOST | {"lanes": "manual", "manual_pct": 100.0}, ["new: manual"], []),
        ({"lanes": "valve travel"}, LOST | {"valve_travel_pct_per_h": None}, [], []),
        (LOST | {"frozen_pct": None}, {"lanes": "frozen", "frozen_pct": 9.0}, [], []),
        (LOST | {"lanes": "manual", "manual_pct": 100.0}, {}, [], ["no more: manual"]),
    ],
)
def test_lanes_are_news_too(before, now, new, better):
    """A loop at its limit or in manual is new, one that left a lane better; what a night cannot tell is neither."""
    assert told(before, now) == (new, better)
