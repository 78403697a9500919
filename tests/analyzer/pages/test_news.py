"""A change of the night is listed under the heading that an engineer expects."""

from __future__ import annotations

import pytest

from analyzer.lanes.lanes import FIGURE
from analyzer.pages.reading import ShownNight
from analyzer.pages.summary import news_lines, news_table

NO_LANES: dict[str, object] = {"lanes": None, **dict.fromkeys(FIGURE.values(), 0.0)}
CALM = {"loop": "L", "status": "ok", "oscillating_pct": 0.0, "oscillation_significance": 0.0, "cause": "none"}
ROW = NO_LANES | CALM | {"kp_new": None, "ti_new": None, "action": "none", "news": None, "news_tone": None}
LOST = {"status": "not assessed", "oscillating_pct": None, "oscillation_significance": None}


def changes_of(before: dict[str, object], now: dict[str, object]) -> tuple[list[str], list[str]]:
    """Changes of one loop under New and under Better."""
    night = ShownNight("2026-03-03", (ROW | now,), {"L": [ROW | before]}, "2026-03-02", ())
    tables = [news_table(night, tones, "t", "T") for tones in (("worse", "unclear"), ("better",))]
    return tuple([row[1].text for row in t.rows] for t in tables)  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("now", "new", "better"),
    [
        ({"news": "stopped oscillating", "news_tone": "better"}, [], ["stopped oscillating"]),
        ({"news": "began to oscillate", "news_tone": "worse"}, ["began to oscillate"], []),
        (
            {"news": "the reported cause is now load", "news_tone": "unclear"},
            ["the reported cause is now load"],
            [],
        ),
        ({"news": "began to oscillate", "news_tone": "worse", "lanes": "manual"}, ["began to oscillate"], []),
        ({}, [], []),
    ],
)
def test_changes_are_listed_under_the_right_heading(now, new, better):
    """A changed belief is listed under New or Better, before the changes of lanes."""
    assert changes_of({}, now) == (new, better)


def night_by_night(nights: list[dict[str, object]]) -> list[str]:
    """The changes of one loop on each night after the first, '' if there are none."""
    rows = [ROW | n for n in nights]
    found = []
    for k in range(1, len(rows)):
        night = ShownNight("x", (rows[k],), {"L": rows[:k]}, "y", ())
        found.append("; ".join(news_lines(night)).removeprefix("L "))
    return found


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
def test_changes_of_lanes_are_listed_too(before, now, new, better):
    """A loop at its limit or in manual is listed under New, one that left a lane under Better; unknown figures give
    neither.
    """
    assert changes_of(before, now) == (new, better)


def test_an_inferred_lane_is_listed_on_the_second_night():
    """Sluggish for one night is not listed, and neither is one night without it; manual is listed at once."""
    slow, still, by_hand = {"lanes": "sluggish"}, {"lanes": None}, {"lanes": "manual"}
    assert night_by_night([still, slow, still, slow, slow, still, slow]) == [
        "",
        "",
        "",
        "new: sluggish",
        "",
        "",
    ]
    assert night_by_night([still, by_hand, still]) == ["new: manual", "no more: manual"]
