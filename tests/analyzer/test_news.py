"""What changed overnight stands under the heading that an engineer expects."""

from __future__ import annotations

import pytest

from analyzer.lanes.lanes import FIGURE
from analyzer.pages.news import news_lines, news_table
from analyzer.pages.reading import ShownNight

NO_LANES: dict[str, object] = {"lanes": None, **dict.fromkeys(FIGURE.values(), 0.0)}
CALM = {"loop": "L", "status": "ok", "oscillating_pct": 0.0, "oscillation_significance": 0.0, "cause": "none"}
ROW = NO_LANES | CALM | {"kp_new": None, "ti_new": None, "action": "none", "judged_since_s": None}
LOST = {"status": "not assessed", "oscillating_pct": None, "oscillation_significance": None}
CYCLING = {"oscillating_pct": 95.0, "oscillation_significance": 20.0, "cause": "valve"}


def told(before: dict[str, object], now: dict[str, object]) -> tuple[list[str], list[str]]:
    """News of one loop under New and under Better."""
    night = ShownNight("2026-03-03", (ROW | now,), {"L": ROW | before}, "2026-03-02", ())
    tables = [news_table(night, tones, "t", "T") for tones in (("worse", "unclear"), ("better",))]
    return tuple([row[1].text for row in t.rows] for t in tables)  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("before", "now", "new", "better"),
    [
        (CYCLING, {}, [], ["stopped oscillating"]),
        ({}, CYCLING, ["began to oscillate"], []),
        ({"cause": "valve"}, {}, [], []),
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


def night_by_night(nights: list[dict[str, object]]) -> list[str]:
    """The news of one loop on each of some nights but the first, '' where there are none."""
    rows = [ROW | n for n in nights]
    found = []
    for k in range(1, len(rows)):
        night = ShownNight("x", (rows[k],), {"L": rows[k - 1]}, "y", (), earlier={"L": rows[: k - 1]})
        found.append("; ".join(news_lines(night)).removeprefix("L "))
    return found


def swing(significance: float, share: float = 95.0, cause: str = "valve") -> dict[str, object]:
    """A night of a loop that oscillates so much."""
    return {"oscillating_pct": share, "oscillation_significance": significance, "cause": cause}


def test_a_cured_loop_neither_begins_nor_stops_again():
    """What is left of a cycle after a retune, between nothing and a sixth of what there was, is no news; the night of
    the change is, with what was typed in, and a cycle that comes back."""
    typed = {"settings_changed": "Ti 40 \u2192 1100 s at 09:30", "judged_since_s": 1.0}
    cured = [swing(58.0), swing(57.0), swing(4.0) | typed, {"cause": "valve"}, swing(7.0), {}, swing(9.0)]
    assert night_by_night([*cured, swing(60.0)]) == [
        "",
        "oscillates 7 % as much as before since Ti 40 \u2192 1100 s at 09:30",
        *[""] * 4,
        "began to oscillate",
    ]


def test_a_loop_that_cycles_for_a_part_of_the_night_has_not_stopped():
    """From 95 % to 40 % of the time is no end of an oscillation, to 10 % it is."""
    assert night_by_night([swing(20.0), swing(12.0, 40.0), swing(20.0)]) == ["", ""]
    assert night_by_night([swing(20.0), swing(12.0, 10.0)]) == ["stopped oscillating"]


def test_a_cause_that_was_told_before_is_no_news():
    """One night without a fault, or with another cause, makes no news when the old one is told again; two nights
    without one do."""
    calm = {"cause": "none"}
    assert night_by_night([{"cause": "valve"}, calm, {"cause": "valve"}]) == ["", ""]
    gone = "no fault is seen any more (cause was valve)"
    assert night_by_night([{"cause": "valve"}, calm, calm, calm]) == ["", gone, ""]


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


def test_a_lane_that_is_inferred_is_told_by_the_second_night():
    """Sluggish for one night is no news, nor is one night without; manual is told at once."""
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
