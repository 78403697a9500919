"""Maintenance of a store: detection of damaged and leftover files, and deletion of old nights."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date, timedelta
from pathlib import Path

from analyzer.store import notes
from analyzer.store.lock import LEFT_OVER_S
from analyzer.store.store import MAKE_ONE, SCHEMA, Store, is_night
from analyzer.store.table import KEPT, DamagedError, stored_parts
from identification.errors import InputError, NotNowError
from reports.whole_file import SUFFIX

NEVER = "1900-01-01"
"""A day before all nights."""
AGAIN = "restore it from a backup, or delete it and run its night again"


@dataclass(frozen=True, slots=True)
class Problem:
    """A fault in a store: what was seen, and what to do."""

    seen: str
    remedy: str


def size_text(store: Store) -> str:
    """Size of a store: nights, tables, and total megabytes."""
    tables = sum(len(list((store.path / t.name).glob("*.parquet"))) for t in KEPT)
    total = sum(p.stat().st_size for p in store.path.rglob("*") if p.is_file())
    return f"{len(store.nights())} nights, {tables} tables, {total / 1e6:.1f} MB"


def problems(store: Store) -> Iterator[Problem]:
    """All faults of a store, with every table read completely. Raises InputError where there is no such directory."""
    if not store.path.is_dir():
        raise InputError(f"{store.path}: no such directory", "a store", MAKE_ONE)
    yield from _version(store)
    whole = set(store.nights())
    for table in KEPT:
        files = sorted((store.path / table.name).glob("*"))
        yield from filter(None, (_wrong(path, whole) for path in files))
    lines = notes.broken(store.path)
    if lines:
        seen = f"{store.path / notes.FILE}: {lines} lines are no notes"
        yield Problem(seen, "nothing: they are ignored")
    for night in store.begun():
        seen = f"{store.path / 'parts' / night}: a run that was begun and not finished"
        yield Problem(seen, "run it again with --resume; without it the next run starts again")


def _version(store: Store) -> Iterator[Problem]:
    try:
        found = store.version()
        store.require_known()
    except InputError as error:
        yield Problem(error.seen, error.remedy)
        return
    if found < SCHEMA and (store.path / "nights").is_dir():
        yield Problem(f"{store.path}: tables of version {found}", "the next run brings them up to date")


def _wrong(path: Path, whole: set[str]) -> Problem | None:
    """Fault of a file among the nights of a table, if any."""
    if path.suffix == SUFFIX:
        seen = f"{path}: remains of a process that died"
        return Problem(seen, "'triage store prune' deletes it after a day")
    if path.suffix == ".damaged":
        return Problem(f"{path}: a damaged table that a run has set aside", "delete it when nobody needs it")
    if path.suffix != ".parquet" or not is_night(path.stem):
        return Problem(f"{path}: not the name of a table of a night", "move it away")
    try:
        for _ in stored_parts(path):
            pass
    except DamagedError as error:
        return Problem(error.seen, AGAIN)
    except NotNowError as error:
        seen, _, remedy = str(error).partition("; ")
        return Problem(seen, remedy)
    if path.stem not in whole:
        return Problem(f"{path}: no night of that name in nights", "run the night again, or delete it")
    return None


def pruned(store: Store, keep_d: int, detail_d: int | None, dry: bool = False) -> list[Path]:
    """Delete nights more than `keep_d` days before the latest, and leftover files; return what was deleted.

    Large tables, hours and trends, are kept for `detail_d` days, None as long as the nights; a dry run only reports
    what would be deleted. A night in the future, from a wrong clock of a historian, is not used as the latest:
    without an earlier one nothing is deleted. The table of nights is deleted first, so that no reader finds an
    incomplete night. Notes stay. The caller holds the lock of the store.
    """
    tomorrow = (date.today() + timedelta(days=1)).isoformat()
    latest = date.fromisoformat(max((n for n in store.nights() if n <= tomorrow), default=NEVER))
    first = _days_before(latest, keep_d)
    detailed = first if detail_d is None else max(first, _days_before(latest, detail_d))
    outdated = [p for t in KEPT for p in store.files(t.name) if p.stem < (detailed if t.bulky else first)]
    half_written, before = sorted(store.path.rglob(f".*{SUFFIX}")), time.time() - LEFT_OVER_S
    outdated += [path for path in half_written if path.stat().st_mtime < before]
    if not dry:
        for path in outdated:
            path.unlink(missing_ok=True)
    return outdated


def _days_before(day: date, days: int) -> str:
    """A day so many days earlier, at least the first possible day."""
    return (day - timedelta(days=min(days, day.toordinal() - 1))).isoformat()
