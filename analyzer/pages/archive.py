"""Morning pages under their dates, each with the night before and the night after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from analyzer.pages import morning
from analyzer.pages.plant_history import NightSum
from analyzer.pages.view import read_night
from analyzer.plantwide.view import read_groups
from analyzer.store.store import Store
from reports.pages import Block, Page, Section, Table, TreeMap

MOST = 31
"""Nights that have a page; the store has the others."""
SHOWN = 50
"""Loops worth a look that a page lists at most."""
LATEST = ("Latest night", "index.html")


def name_of(night: str) -> str:
    """The file of a night's page, without its ending."""
    return f"morning-{night}"


def neighbours(nights: Sequence[str], night: str) -> tuple[tuple[str, str], ...]:
    """Links from a night to those before and after it among some, oldest first."""
    at = list(nights).index(night)
    around = (("Previous night", at - 1), ("Next night", at + 1))
    return tuple((text, f"{name_of(nights[k])}.html") for text, k in around if 0 <= k < len(nights))


def page(store: Store, night: str, nights: Sequence[str], sums: Sequence[NightSum]) -> Page:
    """A night's morning page without links to loops' pages, which are those of the latest night alone.

    Parameters
    ----------
    store : Store
    night : str
    nights : sequence of str
        All nights that have a page, oldest first.
    sums : sequence of NightSum
        The plant's figures of these nights and others.
    """
    own = [s for s in sums if s.name <= night]
    found = morning.page(read_night(store, night, SHOWN), read_groups(store, night), own)
    links = (*neighbours(nights, night), LATEST)
    return replace(found, name=name_of(night), sections=tuple(map(_unlinked, found.sections)), links=links)


def _unlinked(section: Section) -> Section:
    return replace(section, blocks=tuple(map(_without_links, section.blocks)))


def _without_links(block: Block) -> Block:
    if isinstance(block, Table):
        rows = tuple(tuple(replace(c, href="") for c in row) for row in block.rows)
        return replace(block, rows=rows)
    if isinstance(block, TreeMap):
        groups = tuple(replace(g, tiles=tuple(replace(t, href="") for t in g.tiles)) for g in block.groups)
        return replace(block, groups=groups)
    return block
