"""The page on which loops of a night are laid beside each other on one time axis."""

from __future__ import annotations

from analyzer.pages.loop_pictures import trend_block
from analyzer.pages.reading import BESIDE, ShownNight, read_trends
from analyzer.pages.words import pv_scale_of
from analyzer.store.store import Store
from reports.pages import Beside, Page, Section
from reports.texts import slug

BUCKETS = 720
"""Buckets of a trend at most; ours: two minutes of a day, and some kilobytes a loop."""
CAPTION = "Each loop in its own unit. Zoom or move one, and all go with it; the address keeps the choice."


def page(store: Store, night: ShownNight) -> Page:
    """The page of a night's loops that have a page of their own."""
    trends = read_trends(store, night.paged, [night.name])
    rows = {r["loop"]: r for r in night.rows}
    blocks = tuple(
        trend_block(f"beside-{slug(loop)}", loop, trends[loop].coarser(BUCKETS), (), pv_scale_of(rows[loop]))
        for loop in night.paged
        if loop in trends and trends[loop].time_s.size > 1
    )
    beside = Beside("beside", "Loops, up to six", blocks, CAPTION)
    return Page(
        BESIDE,
        "Loops side by side",
        f"the night of {night.name}",
        (Section("Side by side", (beside,)),),
        (("All loops", "index.html"),),
    )
