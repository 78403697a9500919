"""The morning on one screen: first actions for a shift leader, changes, the worst loops with new settings."""

from __future__ import annotations

from collections.abc import Sequence

from analyzer.lanes.lanes import FIGURE, lanes_in
from analyzer.loop.cost import SIGNIFICANCE, cost, cost_column
from analyzer.loop.decisions import CAUSES, Action, Cause, Due, GroupRole, Lane, Status
from analyzer.pages import words
from analyzer.pages.reading import ShownNight, action_text, needs_a_look, oscillates, read_night
from analyzer.plantwide.view import GroupView, read_groups
from analyzer.store.store import Store
from analyzer.words import orders
from analyzer.words.orders import order
from analyzer.words.units import changed_settings
from reports.pages import Block, Cell, Page, Section, Table, Text, section, without_none

SENTENCES = 3  # Sentences of a summary at most
NAMED = 3  # Loops that a sentence names; the rest is counted [loops]
SUMMARY_LOOPS = 10  # Loops that a summary lists [loops]
NEWS = 8  # Changes that it lists
LANE_NIGHTS = 2
"""Nights in a row in or out of an inferred lane after which it is reported [nights]: one night can miss
it."""

CALM = "No loop needs action this morning."


def listed(names: Sequence[str]) -> str:
    """Names in a sentence, only the first few."""
    more = len(names) - NAMED
    return ", ".join(names[:NAMED]) + f" and {more} more" if more > 0 else words.enumerated(list(names))


def first_things(rows: Sequence[words.Row], groups: Sequence[GroupView] = ()) -> tuple[str, ...]:
    """At most three sentences, the largest improvement first; or one that there is nothing to do."""
    by_loop, by = {r["loop"]: r for r in rows}, cost_column(rows)
    named: set[str] = set()
    found: list[tuple[float, str]] = []
    for group in groups:
        source = by_loop.get(group.source["loop"]) if group.source else None
        others = [r["loop"] for r in group.rows if r["role"] == GroupRole.FOLLOWER and r["loop"] in by_loop]
        if source is None or not others:
            continue
        members = [source["loop"], *others]
        named |= set(members)
        found.append((sum(cost(by_loop[m], by) for m in members), _of_group(source, others)))
    remaining = sorted((r for r in rows if r["loop"] not in named), key=lambda r: (-cost(r, by), r["loop"]))
    for work in orders.texts("work"):
        of_work = [r for r in remaining if orders.kind_of_work(r) == work]
        if of_work:  # a repair at the next shutdown is not for tonight
            worth = 0.0 if work == Due.SHUTDOWN else sum(cost(r, by) for r in of_work)
            found.append((worth, orders.work_sentence(work, of_work, listed([r["loop"] for r in of_work]))))
    ordered = sorted(found, key=lambda pair: -pair[0])
    return tuple(text for _, text in ordered[:SENTENCES]) or (CALM,)


def _of_group(source: words.Row, others: Sequence[str]) -> str:
    name, moved = source["loop"], f"it also moves {listed(others)}"
    unasked = source["action"] is None and source["cause"] == Cause.VALVE  # from a night without advice
    if source["action"] == Action.REPAIR_VALVE or unasked:
        return f"Fix {name}'s valve: {moved}."
    if source["action"] == Action.RETUNE:
        return f"Type new settings into {name}: {moved}."
    if source["cause"] == Cause.LOAD:
        return (
            f"Find the external disturbance of {name}, every {words.duration(source['period_s'])}: {moved}."
        )
    return f"Look at {name} first: {moved}."


def _news(night: ShownNight) -> list[words.Row]:
    """Loops with changes since the previous night: the change, and its colour."""
    found: list[words.Row] = []
    for row in night.rows:
        earlier = night.earlier.get(row["loop"])
        news = _lane_news([*earlier, row]) if earlier and not row["news"] else {}
        if earlier and (row["news"] or news):
            found.append({**row, **news})
    return found


def _lane_news(nights: Sequence[words.Row]) -> words.Row:
    """Lanes other than oscillation that a loop entered or left, among those with figures in both nights."""
    old, row = nights[-2:]
    known = [x for x in Lane if x is not Lane.OSCILLATION and None not in (old[FIGURE[x]], row[FIGURE[x]])]
    states = {x: _inside(nights, x)[-2:] for x in known}
    came, left = ([x for x in known if states[x] == change] for change in ([False, True], [True, False]))
    if came:
        return {"news": f"new: {', '.join(came)}", "news_tone": "worse"}
    return {"news": f"no more: {', '.join(left)}", "news_tone": "better"} if left else {}


def _inside(nights: Sequence[words.Row], lane: Lane) -> list[bool]:
    """Whether a loop was in a lane in each night; an inferred lane must be reported in several consecutive nights."""
    inside = [lane in lanes_in(row) for row in nights]
    if lane is not Lane.SLUGGISH:
        return inside
    states = inside[:1]
    for k in range(1, len(inside)):
        last = inside[max(k + 1 - LANE_NIGHTS, 0) : k + 1]
        states.append(inside[k] if len(set(last)) == 1 else states[-1])
    return states


def news_lines(night: ShownNight) -> list[str]:
    """Changes since the previous night, one line per loop, deteriorations first."""
    order = {"worse": 0, "unclear": 1, "better": 2}
    news = sorted((order[row["news_tone"]], row["loop"], row["news"]) for row in _news(night))
    return [f"{loop} {text}" for _, loop, text in news]


def news_table(night: ShownNight, tones: Sequence[str], name: str, title: str) -> Table:
    """Loops with changes of the given colours."""

    def own(row: words.Row) -> dict[str, words.CellContent]:
        before, now = (words.cell(r, SIGNIFICANCE) for r in (night.earlier[row["loop"]][-1], row))
        news = Cell(row["news"], kind=row["news_tone"])
        return {"news": news, "before": before, "now": now, "action": Cell(action_text(row))}

    rows = [row for row in _news(night) if row["news_tone"] in tones]
    return night.table("news", rows, own, name=name, title=f"{title} ({len(rows)})")


def since(night: ShownNight) -> Section:
    """The section of what changed overnight."""
    if not night.before_name:
        return Section("Since the night before", (Text(("This is the first night in the store.",)),))
    blocks: list[Block] = []
    for title, tones in {"New": ("worse", "unclear"), "Better": ("better",)}.items():
        table = news_table(night, tones, title.lower(), title)
        blocks.append(table if table.rows else Text((f"{title}: nothing.",), "note"))
    return Section(f"Since {night.before_name}", tuple(blocks))


def _do(row: words.Row) -> str:
    """The action with the new settings, otherwise with the first line of its order; '' if there is none."""
    if row["kp_new"] is not None or row["ti_new"] is not None:
        return f"{row['action']}: {changed_settings(row)}"
    return "" if row["action"] in (None, Action.NONE) else f"{row['action']}: {dict(order(row))['Do']}"


def _counts(night: ShownNight) -> str:
    assessed = [r for r in night.rows if r["status"] == Status.OK]
    swinging = [r for r in assessed if oscillates(r)]
    of = ", ".join(f"{sum(r['cause'] == c for r in swinging)} by {c}" for c in CAUSES)
    return f"{len(assessed)} of {words.with_noun(len(night.rows), 'loop')} assessed, {len(swinging)} oscillate: {of}."


def summary_page(store: Store, name: str | None = None) -> Page:
    """The summary of a night, the latest by default.

    Raises
    ------
    InputError
        The store has no such night.
    """
    night = read_night(store, name, SUMMARY_LOOPS, drawn=False)
    seen = [r for r in night.rows if r["loop"] not in night.hidden]
    first = words.listing(first_things(seen, read_groups(store, night.name)))
    not_listed, lines, most = sum(map(needs_a_look, seen)) - len(night.worst), news_lines(night), NEWS
    news = [*lines[:most], f"{len(lines) - most} more"] if len(lines) > most else lines
    news_block = words.listing(news) if news else Text(("Nothing new.",))
    sections = without_none(
        Section("First", (first, Text((_counts(night),)))),
        section(f"Since {night.before_name}", news_block) if night.before_name else None,
        Section("Loops worth a look", (_worst(night, not_listed) if night.worst else Text(("None.",)),)),
    )
    return Page("summary", f"Loops in the morning of {night.name}", "", sections)


def _worst(night: ShownNight, not_listed: int) -> Table:
    """The worst loops with their actions, and the number of those left out; their notes if there are any."""

    def own(row: words.Row) -> dict[str, words.CellContent]:
        return {"loop": Cell(row["loop"], kind="strong"), "do": _do(row), "note": night.note(row["loop"])}

    noted = any(night.note(r["loop"]) for r in night.worst)
    shown = words.page_columns("summary")[: 4 if noted else 3]
    more = f"{not_listed} more in the list." if not_listed > 0 else ""
    return night.table("summary", night.worst, own, columns=shown, note=more)
