"""What is new since the night before, and what got better."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analyzer.lanes.lanes import FIGURE, lanes_in
from analyzer.loop.decisions import Cause, Lane, Status
from analyzer.pages.reading import ShownNight, action_text, linked, oscillates
from analyzer.pages.words import Row, cell, page_columns
from reports.pages import Block, Cell, Section, Table, Text

HALVED = 0.5
"""A loop got better where its significance fell to this share of what is usual for it [-]; ours."""
COMES_BACK, DIES_AWAY = 0.25, 0.125
"""Significance over the largest of the nights in memory from which a loop begins to oscillate again, and below which
it no longer does [-]; ours: of five loops of the sample mill that a retune calmed, whose significance fell from 12 to
58 to between 0 and a sixth of that, none begins or stops again."""
SELDOM_PCT = 25.0
"""Share of the time below which a loop stopped oscillating [%]: half of that from which it counts."""
CONFIRMED = 2
"""Nights in a row without a cause after which a fault is told to be gone, and in or out of a lane that is inferred;
ours: one night can miss it."""
NOTHING = ("", "")
"""No news, in no colour."""


def _news(night: ShownNight, row: Row) -> tuple[str, str]:
    """What is new about a loop since the night before, and its colour; '' where nothing is."""
    old = night.before.get(row["loop"])
    if old is None:
        return NOTHING
    known = [r for r in (*night.earlier.get(row["loop"], ()), old, row) if _is_known(r)]
    told = _swing_news(known) if _is_known(row) and _is_known(old) else NOTHING
    return told if told != NOTHING else _lane_news([*night.earlier.get(row["loop"], ()), old, row])


def _is_known(row: Row) -> bool:
    """Whether a night tells if the loop oscillated."""
    return row["status"] == Status.OK and row["oscillating_pct"] is not None


def _significance_of(row: Row) -> float:
    return float(row["oscillation_significance"] or 0.0)


def _states(known: Sequence[Row]) -> list[bool]:
    """Whether the loop oscillated in each night, with a memory: what is small beside what there was neither ends nor
    begins an oscillation."""
    states: list[bool] = []
    top = 0.0
    for row in known:
        now = _significance_of(row)
        top = max(top, now)
        loud = oscillates(row) and now >= COMES_BACK * top
        quiet = row["oscillating_pct"] < SELDOM_PCT or now < DIES_AWAY * top
        states.append(loud if loud or quiet or not states else states[-1])
    return states


def _swing_news(known: Sequence[Row]) -> tuple[str, str]:
    """What oscillation and cause have become, by the nights that tell, oldest first."""
    states, row = _states(known), known[-1]
    then, now = states[-2:]
    if now and not then:
        return "began to oscillate", "worse"
    usual = float(
        np.median([_significance_of(r) for r, on in zip(known[:-1], states, strict=False) if on] or [0.0])
    )
    ratio = _significance_of(row) / usual if usual > 0.0 else 1.0
    after = "" if row["judged_since_s"] is None else f" since {row['settings_changed']}"
    if then and not now:
        left = (
            f"oscillates {100 * ratio:.0f} % as much as before" if oscillates(row) else "stopped oscillating"
        )
        return left + after, "better"
    if now and ratio < HALVED and _significance_of(known[-2]) >= HALVED * usual:
        return f"oscillates less than half as much{after}", "better"
    return _cause_news([r["cause"] or Cause.UNDECIDED for r in known])


def _lane_news(nights: Sequence[Row]) -> tuple[str, str]:
    """Lanes beside oscillation that a loop came into or left, of those whose figures both nights know."""
    old, row = nights[-2:]
    known = [x for x in Lane if x is not Lane.OSCILLATION and None not in (old[FIGURE[x]], row[FIGURE[x]])]
    states = {x: _inside(nights, x) for x in known}
    came = [x for x in known if states[x][-1] and not states[x][-2]]
    left = [x for x in known if states[x][-2] and not states[x][-1]]
    if came:
        return f"new: {', '.join(came)}", "worse"
    return (f"no more: {', '.join(left)}", "better") if left else NOTHING


def _inside(nights: Sequence[Row], lane: Lane) -> list[bool]:
    """Whether a loop was in a lane in each night; one that is inferred has to be told CONFIRMED nights in a row."""
    told = [lane in lanes_in(row) for row in nights]
    if lane is not Lane.SLUGGISH:
        return told
    states = told[:1]
    for k in range(1, len(told)):
        last = told[max(k + 1 - CONFIRMED, 0) : k + 1]
        states.append(told[k] if len(set(last)) == 1 else states[-1])
    return states


def _cause_news(causes: Sequence[str]) -> tuple[str, str]:
    """What another cause than the nights' before means: a fault gone, one come, or one told otherwise; a cause that
    one of them has told is no news."""
    now, before = causes[-1], causes[:-1]
    then = next((c for c in reversed(before) if c != Cause.NONE), Cause.NONE)
    if now == Cause.NONE:
        gone = then != Cause.NONE and list(causes[-CONFIRMED:]) == [Cause.NONE] * CONFIRMED
        is_new = gone and causes[-CONFIRMED - 1] != Cause.NONE
        return (f"no fault is seen any more (cause was {then})", "better") if is_new else NOTHING
    if now in before:
        return NOTHING
    if then == Cause.NONE:
        return f"a fault is seen: cause {now}", "worse"
    return f"the cause is now told as {now} (was {then})", "unclear"


def news_lines(night: ShownNight) -> list[str]:
    """What is new since the night before, a line a loop, what got worse first."""
    found = [(row["loop"], *_news(night, row)) for row in night.rows]
    order = {"worse": 0, "unclear": 1, "better": 2}
    told = sorted((order[tone], loop, text) for loop, text, tone in found if text)
    return [f"{loop} {text}" for _, loop, text in told]


def news_table(night: ShownNight, tones: Sequence[str], name: str, title: str) -> Table:
    """Loops of which there is something new, of the colours asked for."""
    found = [(row, *_news(night, row)) for row in night.rows]
    rows = tuple(
        (
            linked(night, row["loop"]),
            Cell(text, kind=tone),
            *(cell(r, "oscillation_significance") for r in (night.before[row["loop"]], row)),
            Cell(action_text(row)),
        )
        for row, text, tone in found
        if text and tone in tones
    )
    return Table(name, f"{title} ({len(rows)})", page_columns("news"), rows)


def _news_blocks(night: ShownNight) -> tuple[Block, ...]:
    tables = (
        news_table(night, ("worse", "unclear"), "new", "New"),
        news_table(night, ("better",), "better", "Better"),
    )
    return tuple(t if t.rows else Text((f"{t.title.split(' (')[0]}: nothing.",), "note") for t in tables)


def since(night: ShownNight) -> Section:
    """The section of what changed overnight."""
    if not night.before_name:
        return Section("Since the night before", (Text(("This is the first night in the store.",)),))
    return Section(f"Since {night.before_name}", _news_blocks(night))
