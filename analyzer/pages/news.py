"""What is new since the night before, and what got better."""

from __future__ import annotations

from collections.abc import Sequence

from analyzer.lanes.lanes import FIGURE, lanes_in
from analyzer.loop.decisions import Lane
from analyzer.pages.reading import ShownNight, action_text, linked
from analyzer.pages.words import Row, cell, page_columns
from reports.pages import Block, Cell, Section, Table, Text

CONFIRMED = 2
"""Nights in a row in or out of a lane that is inferred after which that is told; ours: one night can miss it."""
NOTHING = ("", "")
"""No news, in no colour."""


def _news(night: ShownNight, row: Row) -> tuple[str, str]:
    """What is new about a loop since the night before, and its colour; '' where nothing is."""
    old = night.before.get(row["loop"])
    if old is None:
        return NOTHING
    if row["news"]:
        return row["news"], row["news_tone"]
    return _lane_news([*night.earlier.get(row["loop"], ()), old, row])


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
