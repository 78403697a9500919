"""All pages of a night: the morning page, one for each loop, and morning pages of earlier dates."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache

from analyzer.explain.night import known
from analyzer.pages import groups, loop, morning, work
from analyzer.pages.groups import GROUP_LOOPS
from analyzer.pages.loop_pictures import trend_block
from analyzer.pages.morning import HISTORY
from analyzer.pages.reading import (
    NIGHT_COLUMNS,
    SIDE_BY_SIDE,
    USUAL_NIGHTS,
    ShownNight,
    Thinned,
    by_loop,
    read_night,
    read_nights,
    read_trends,
    remembered_columns,
)
from analyzer.pages.words import ALL_LOOPS, pv_scale_of
from analyzer.plantwide.view import GroupView, read_groups
from analyzer.store.notes import read_notes
from analyzer.store.store import Store
from identification.errors import InputError
from reports.page_file import loads
from reports.pages import Beside, Page, Section
from reports.texts import slug

DATED = 31  # Nights that have a page; the store has the others [nights]: a month
DATED_LOOPS = 50  # Loops worth a look that a dated page lists at most [loops]

LATEST = ("Latest night", "index.html")
BUCKETS = 720
"""Maximum buckets of a trend in a side-by-side view; ours: two minutes of a day, and some kilobytes per loop."""


def pages_of_night(store: Store, name: str | None = None, top: int = 200) -> Iterator[Page]:
    """The morning page of a night (the latest by default), its sheets, and the pages of its groups and loops.

    Raises
    ------
    InputError
        The store has no such night.
    """
    night = read_night(store, name, top)
    shared = read_groups(store, night.name)
    nights = [n for n in store.nights() if n <= night.name]
    links = nights_around(nights[-DATED:], night.name)
    about = morning.morning_page(night, shared, morning.read_sums(store, night.name), links)
    yield replace(about, choices=nights_to_choose(nights[-DATED:], night.name))
    yield work.maintenance_page(night)
    yield side_by_side(store, night)
    yield work.work_page(store, night)
    members = {r["loop"] for g in shared for r in g.rows[:GROUP_LOOPS]}
    trends = read_trends(store, members, [night.name])
    for g in shared:
        yield groups.group_page(g, trends, night)
    yield from _loop_pages(store, night, nights[-HISTORY:], shared, {**trends, **night.trends})


def pages_of_loop(store: Store, name: str | None, tag: str) -> Iterator[Page]:
    """The pages of one loop of a night (the latest by default). Raises InputError where it has no such loop."""
    night = name or store.require()
    rows = tuple(read_nights(store, [night], NIGHT_COLUMNS, {tag}))
    if not rows:
        near = get_close_matches(tag, store.read("nights", night, ["loop"]).column(0).to_pylist(), 3)
        seen = f"loop {tag} is not in the night {night}"
        raise InputError(seen, f"one of its loops ({', '.join(near) or 'none is near'})", "correct --loop")
    shown = ShownNight(night, rows, {}, "", (), notes=read_notes(store.path), paged=(tag,))
    shared = [g for g in read_groups(store, night) if any(r["loop"] == tag for r in g.rows)]
    members = {r["loop"] for g in shared for r in g.rows[:GROUP_LOOPS]}
    nights = [n for n in store.nights() if n <= night][-HISTORY:]
    yield from _loop_pages(store, shown, nights, shared, read_trends(store, members, [night]))


def side_by_side(store: Store, night: ShownNight) -> Page:
    """The page on which the loops with a page are shown below each other on one time axis."""
    trends = read_trends(store, night.paged, [night.name])
    scales = {r["loop"]: pv_scale_of(r) for r in night.rows}
    blocks = tuple(
        trend_block(f"beside-{slug(loop)}", loop, trends[loop].coarser(BUCKETS), (), scales[loop])
        for loop in night.paged
        if loop in trends and trends[loop].time_s.size > 1
    )
    caption = "Each loop in its own unit. Zoom or move one, and all follow; the address keeps the choice."
    section = Section("Side by side", (Beside("beside", "Loops, up to six", blocks, caption),))
    return Page(SIDE_BY_SIDE, "Loops side by side", f"the night of {night.name}", (section,), (ALL_LOOPS,))


def _loop_pages(
    store: Store,
    night: ShownNight,
    nights: Sequence[str],
    shared: Sequence[GroupView],
    around: Mapping[str, Thinned],
) -> Iterator[Page]:
    """The pages of the loops, each with its compared settings and its explanation, if the night has any."""
    rows = by_loop(read_nights(store, nights, loop.COLUMNS, night.paged))
    trends = read_trends(store, night.paged, nights[-loop.WEEK :])
    by_number = {g.number: g for g in shared}
    explained = {r["loop"]: r for r in known(store, night.name)}
    columns, there = ("loop", "settings_page"), store.file("compared", night.name).exists()
    tried = store.own_rows("compared", night.name, columns, night.paged) if there else []
    compared = {r["loop"]: r["settings_page"] for r in tried}
    for tag in night.paged:
        own = rows[tag]
        found = explained.get(tag)
        drawn, settings = (loads(text or "") for text in (found and found.get("page"), compared.get(tag)))
        group = by_number.get(own[-1]["group"] or "")
        notes = [n.as_line(night.zone) for n in night.notes.get(tag, ())]
        part = None if group is None else groups.member_section(group, tag, around)
        about = loop.loop_page(own, trends.get(tag), found, drawn, part, notes, settings)
        yield about
        for more in (settings, drawn):
            if more is not None:
                yield replace(more, links=(*about.links[:1], (tag, f"{about.name}.html")))


def dated_pages(store: Store, name: str | None, written: Callable[[str], bool]) -> Iterator[Page]:
    """Morning pages by date, up to a night (the latest by default). Except for the last two, nights are skipped if
    `written` reports that their page is newer than their results."""
    last = name or store.require()
    nights = [n for n in store.nights() if n <= last][-DATED:]
    sums, read_earlier = morning.read_sums(store, last), lru_cache(USUAL_NIGHTS)(remembered_columns)
    for night in nights:
        if night in nights[-2:] or not written(night):
            # loops' pages are those of the latest night
            shown = replace(read_night(store, night, DATED_LOOPS, read_earlier=read_earlier), paged=())
            own = [s for s in sums if s.name <= night]
            found = morning.morning_page(shown, read_groups(store, night), own)
            links, choices = (*nights_around(nights, night), LATEST), nights_to_choose(nights, night)
            yield replace(found, name=name_of(night), links=links, choices=choices)


def name_of(night: str) -> str:
    """The file of a night's page, without its ending."""
    return f"morning-{night}"


def nights_around(nights: Sequence[str], night: str) -> tuple[tuple[str, str], ...]:
    """Links from a night to the previous and the next among some, oldest first."""
    at = list(nights).index(night)
    around = (("Previous night", at - 1), ("Next night", at + 1))
    return tuple((text, f"{name_of(nights[k])}.html") for text, k in around if 0 <= k < len(nights))


def nights_to_choose(nights: Sequence[str], night: str) -> tuple[tuple[str, str], ...]:
    """Nights with a page, the latest first, with their pages; '' for the one shown."""
    pages = {n: f"{name_of(n)}.html" for n in nights} | {nights[-1]: LATEST[1], night: ""}
    return tuple((n, pages[n]) for n in reversed(nights)) if len(nights) > 1 else ()
