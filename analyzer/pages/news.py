"""What is new since the night before, and what got better."""

from __future__ import annotations

from collections.abc import Sequence

from analyzer.decisions import Cause, Lane, Status
from analyzer.lane_figures import FIGURE, lanes_in
from analyzer.pages.headings import heading
from analyzer.pages.view import Night, Row, linked, oscillates, proposal
from analyzer.pages.words import number
from reports.pages import Block, Cell, Column, Section, Table, Text

HALVED = 0.5
"""A loop got better where its significance fell to this share of the night before [-]; ours."""
NOTHING = ("", "")
"""No news, in no colour."""


def _news(night: Night, row: Row) -> tuple[str, str]:
    """What is new about a loop since the night before, and its colour; '' where nothing is."""
    old = night.before.get(row["loop"])
    if old is None:
        return NOTHING
    told = _swing_news(row, old)
    return _lane_news(row, old) if told == NOTHING else told


def _swing_news(row: Row, old: Row) -> tuple[str, str]:
    """What oscillation and cause have become, where both nights tell."""
    unknown = any(r["status"] != Status.OK or r["oscillating_pct"] is None for r in (row, old))
    if unknown:
        return NOTHING
    now, then = (r["oscillation_significance"] or 0.0 for r in (row, old))
    if oscillates(row) and not oscillates(old):
        return "began to oscillate", "worse"
    if oscillates(old) and not oscillates(row):
        return "stopped oscillating", "better"
    if oscillates(old) and now < HALVED * then:
        return "oscillates less than half as much", "better"
    return _cause_news(row["cause"] or Cause.UNDECIDED, old["cause"] or Cause.UNDECIDED)


def _lane_news(row: Row, old: Row) -> tuple[str, str]:
    """Lanes beside oscillation that a loop came into or left, of those whose figures both nights know."""
    known = [x for x in Lane if x is not Lane.OSCILLATION and None not in (old[FIGURE[x]], row[FIGURE[x]])]
    now, then = lanes_in(row), lanes_in(old)
    came = [x for x in known if x in now and x not in then]
    left = [x for x in known if x in then and x not in now]
    if came:
        return f"new: {', '.join(came)}", "worse"
    return (f"no more: {', '.join(left)}", "better") if left else NOTHING


def _cause_news(now: str, then: str) -> tuple[str, str]:
    """What another cause than the night before's means: a fault gone, one come, or one told otherwise."""
    if now == then:
        return NOTHING
    if now == Cause.NONE:
        return f"no fault is seen any more (cause was {then})", "better"
    if then == Cause.NONE:
        return f"a fault is seen: cause {now}", "worse"
    return f"the cause is now told as {now} (was {then})", "unclear"


def news_lines(night: Night) -> list[str]:
    """What is new since the night before, a line a loop, what got worse first."""
    found = [(row["loop"], *_news(night, row)) for row in night.rows]
    order = {"worse": 0, "unclear": 1, "better": 2}
    told = sorted((order[tone], loop, text) for loop, text, tone in found if text)
    return [f"{loop} {text}" for _, loop, text in told]


def _significance(row: Row) -> Cell:
    return Cell(number(row["oscillation_significance"]), row["oscillation_significance"])


NEWS = (
    heading("loop"),
    Column("news", "Since the night before"),
    Column("before", "Signif. before", True),
    Column("now", "Signif. now", True),
    heading("action", wide=True),
)


def news_table(night: Night, tones: Sequence[str], name: str, title: str) -> Table:
    """Loops of which there is something new, of the colours asked for."""
    found = [(row, *_news(night, row)) for row in night.rows]
    rows = tuple(
        (
            linked(night, row["loop"]),
            Cell(text, kind=tone),
            _significance(night.before[row["loop"]]),
            _significance(row),
            Cell(proposal(row)),
        )
        for row, text, tone in found
        if text and tone in tones
    )
    return Table(name, f"{title} ({len(rows)})", NEWS, rows)


def _news_blocks(night: Night) -> tuple[Block, ...]:
    tables = (
        news_table(night, ("worse", "unclear"), "new", "New"),
        news_table(night, ("better",), "better", "Better"),
    )
    return tuple(t if t.rows else Text((f"{t.title.split(' (')[0]}: nothing.",), "note") for t in tables)


def since(night: Night) -> Section:
    """The section of what changed overnight."""
    if not night.before_name:
        return Section("Since the night before", (Text(("This is the first night in the store.",)),))
    return Section(f"Since {night.before_name}", _news_blocks(night))
