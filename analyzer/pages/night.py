"""All pages of a night: the morning page, then the worst loops one by one, each with its explanation if any."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from analyzer.explain.night import known
from analyzer.pages import archive, group_pictures, groups, loop, maintenance, morning
from analyzer.pages.plant_history import read_sums
from analyzer.pages.reading import read_nights, read_trends
from analyzer.pages.view import read_night
from analyzer.plantwide.view import read_groups
from analyzer.store.store import Store
from reports.page_file import PageFileError, loads
from reports.pages import Page

HISTORY = 60
"""Nights of history on a loop's page; ours: two months, as a maintenance round takes."""


def pages(store: Store, name: str | None = None, top: int = 50) -> Iterator[Page]:
    """The morning page of a night (the latest by default) and the pages of its worst loops.

    Raises
    ------
    InputError
        Where the store holds no such night.
    """
    night = read_night(store, name, top)
    shared = read_groups(store, night.name)
    dated = [n for n in store.nights() if n <= night.name][-archive.MOST :]
    yield morning.page(night, shared, read_sums(store, night.name), archive.neighbours(dated, night.name))
    yield maintenance.page(night)
    nights = [n for n in store.nights() if n <= night.name][-HISTORY:]
    rows = read_nights(store, nights, loop.COLUMNS, night.paged)
    trends = read_trends(store, night.paged, nights[-loop.WEEK :])
    beside = read_trends(
        store, {r["loop"] for g in shared for r in g.rows[: group_pictures.MOST]}, [night.name]
    )
    by_number = {g.number: g for g in shared}
    for g in shared:
        yield groups.page(g, beside, night.name, night.paged)
    explained = {r["loop"]: r for r in known(store, night.name)}
    compared = _compared(store, night.name)
    for worst in night.worst:
        tag = worst["loop"]
        own = [r for r in rows if r["loop"] == tag]
        drawn = explanation(explained.get(tag))
        settings = kept_page(compared.get(tag))
        group = by_number.get(own[-1]["group"] or "")
        said = [n.said(night.zone) for n in night.notes.get(tag, ())]
        part = None if group is None else groups.of_loop(group, tag, {**beside, **night.trends})
        about = loop.page(own, trends.get(tag), explained.get(tag), drawn, part, said, settings)
        yield about
        if settings is not None:
            yield replace(settings, links=(*about.links[:1], (tag, f"{about.name}.html")))
        if drawn is not None:
            yield replace(drawn, links=(*about.links[:1], (tag, f"{about.name}.html")))


def dated_pages(store: Store, name: str | None, written: Callable[[str], bool]) -> Iterator[Page]:
    """Morning pages under their dates, up to a night (the latest by default); those that stand already are left out.

    Parameters
    ----------
    store : Store
    name : str or None
    written : callable
        Told a night; True where its page was written after its results.
    """
    last = name or store.require()
    nights = [n for n in store.nights() if n <= last][-archive.MOST :]
    sums = read_sums(store, last)
    for night in nights:
        if night in nights[-2:] or not written(night):
            yield archive.page(store, night, nights, sums)


def _compared(store: Store, night: str) -> dict[str, str]:
    """Pages of settings that a night kept, by loop."""
    table = store.read_if_there("compared", night)
    rows = [] if table is None else table.select(["loop", "settings_page"]).to_pylist()
    return {r["loop"]: r["settings_page"] for r in rows}


def explanation(kept: Mapping[str, Any] | None) -> Page | None:
    """The page of an explanation as the night kept it; None where it kept none, or one of another version."""
    return None if kept is None else kept_page(kept.get("page"))


def kept_page(text: str | None) -> Page | None:
    """A page as a night kept it; None where it kept none, or one of another version."""
    try:
        return loads(text) if text else None
    except PageFileError:
        return None
