"""Whether day, month or year stands first in a file's dates, from as much of the column as it takes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pyarrow as pa

from analyzer.history import stamps
from analyzer.history.clock import Clock, as_text, is_text, joined
from analyzer.history.options import ReadOptions
from analyzer.history.table import Source, Table

DAY_FIRST_ZONES = ("Europe/", "Africa/", "Australia/", "Asia/")
"""Zones in which dates have the day first where figures alone would read either way."""
AHEAD_S = 2 * 86400.0
"""Stamps later than now by more than this are taken as read in a wrong order [s]."""


def with_day_order(table: Table, clock: Clock, options: ReadOptions) -> Clock:
    """Decide whether day or month stands first, from as much of the column as it takes."""
    if options.day_first is not None:
        return replace(clock, day_first=options.day_first, why="as stated")
    if clock.date_format is not None or clock.scale is not None:
        return clock
    head = _texts(table.head(clock.columns))
    parts = None if head is None else stamps.fields(head, clock.timezone)
    if parts is None or not parts.is_open:
        return clock
    return _decided(clock, stamps.fields(_texts(table.read(clock.columns)), clock.timezone), head)


def _texts(arrays: Sequence[pa.Array]) -> pa.Array | None:
    column = arrays[0] if len(arrays) == 1 else joined(arrays)
    return as_text(column) if is_text(column.type) else None


def _year_first(parts: stamps.Fields, mark: str) -> Clock | None:
    """What is decided of dates with years of two digits that may stand in front; None where they do not.

    Dates with points have the year in front only where no other reading fits as well; of others that read several
    ways the latest counts, for exports are of late.
    """
    if not stamps.may_be_year_first(parts):
        return None
    now = time.time() + AHEAD_S
    readings = {
        name: stamps.seconds(parts, name == "day", name == "year") for name in ("year", "day", "month")
    }
    possible = {
        name: found for name, found in readings.items() if np.isfinite(found).all() and found.max() <= now
    }
    if not possible or "year" not in possible:
        return None
    if len(possible) == 1:
        return Clock((0,), day_first=False, year_first=True, why="else the stamps would lie ahead of us")
    leaps = {name: float(np.max(np.abs(np.diff(found)), initial=0.0)) for name, found in possible.items()}
    if leaps["year"] < min(leap for name, leap in leaps.items() if name != "year"):
        return Clock((0,), day_first=False, year_first=True, why="so read, the stamps run without a leap")
    alike = {name: found.max() for name, found in possible.items() if leaps[name] == min(leaps.values())}
    if "year" not in alike:
        return None
    others = [name for name in alike if name != "year"]
    if mark == "." or max(alike[name] for name in others) > alike["year"]:
        first = others[0] if len(others) == 1 else ""
    else:
        first = "year"
    if not first:
        return None
    why = "the year may stand in front or behind; state --date-format if it is not so"
    return Clock((0,), day_first=first == "day", year_first=first == "year", ambiguous=True, why=why)


def _usual(parts: stamps.Fields, timezone: str | None) -> bool:
    """Whether dates that read either way have the day first: where the month first would lie ahead of us, or as
    is usual in the stated zone."""
    ahead = [bool((stamps.seconds(parts, first) > time.time() + AHEAD_S).any()) for first in (True, False)]
    if ahead[0] != ahead[1]:
        return ahead[1]
    return timezone is not None and timezone.startswith(DAY_FIRST_ZONES)


def _decided(clock: Clock, parts: stamps.Fields | None, head: pa.Array) -> Clock:
    if parts is None:
        return clock
    year = _year_first(parts, next((m for m in "-/." if m in str(head[0].as_py()).split(" ")[0]), ""))
    if year is not None:
        order = {"day_first": year.day_first, "year_first": year.year_first, "ambiguous": year.ambiguous}
        return replace(clock, why=year.why, **order)  # type: ignore[arg-type]
    seen = stamps.days_seen(parts)
    if seen is not None:
        which = "first" if seen else "second"
        return replace(clock, day_first=seen, why=f"the {which} number exceeds 12")
    running = stamps.days_by_gaps(parts)
    if running is not None:
        return replace(clock, day_first=running, why="so read, the stamps run without a leap")
    if "." in str(head[0].as_py()).split(" ")[0]:
        return replace(clock, day_first=True, why="dates with points; no day above 12 occurs")
    first = _usual(parts, clock.timezone)
    other = "--month-first" if first else "--day-first"
    return replace(
        clock, day_first=first, ambiguous=True, why=f"every date fits both orders; state {other} if so"
    )


def agreed(sources: Sequence[Source]) -> tuple[Source, ...]:
    """Files whose dates read either way follow a file of the same export whose dates do not; and all keep winter time
    where one file shows that its clock does."""
    winter = next((s.clock for s in sources if s.clock.winter_s is not None), None)
    if winter is not None:
        kept = winter.winter_s
        sources = [s.with_clock(replace(s.clock, winter_s=kept)) if s.clock.local else s for s in sources]
    sure = next((s for s in sources if s.clock.why and not s.clock.ambiguous), None)
    if sure is None:
        return tuple(sources)
    order = {
        "day_first": sure.clock.day_first,
        "year_first": sure.clock.year_first,
        "ambiguous": False,
        "why": f"as in {sure.path.name}",
    }
    return tuple(s.with_clock(replace(s.clock, **order)) if s.clock.ambiguous else s for s in sources)  # type: ignore[arg-type]
