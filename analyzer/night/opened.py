"""The opened export of a request: its loops, notes on them, and the worker that reads it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import Any
from weakref import finalize

from analyzer.config import WorkerLimits
from analyzer.finder.as_csv import Row
from analyzer.finder.draft import MA_HIGH, MA_LOW, draft, found_text
from analyzer.history.export import Export, ReadOptions, open_export
from analyzer.history.files import own_scratch
from analyzer.history.series import Series
from analyzer.locations import is_remote
from analyzer.loops.changes import TuningChange
from analyzer.loops.spec import ROLES, LoopSpec, unknown_columns
from analyzer.loops.tags import find_loops, match, read_loops
from analyzer.night.nights import Plant
from analyzer.night.request import ExportRequest
from analyzer.night.workers import WorkerDeath, Workers
from identification.errors import InputError

MA_LOOPS = 20  # Loops whose OPs are tested; the first in percent ends the test [loops]

MOST_NAMES = 10
"""Maximum number of loops listed in a note; the others are counted."""


def opened(request: ExportRequest) -> Plant:
    """The export and its loops, found by their tags' endings without a loops.csv, and notes on them and on the
    changes."""
    stated = (
        ()
        if request.loops is None
        else read_loops(request.loops, request.zone, request.reading.get("day_first"))
    )
    tags = frozenset(tag for s in stated for role in ROLES if (tag := getattr(s, role)))
    source = open_export(list(request.export), ReadOptions(**request.reading, stated=tags))
    notes: tuple[str, ...] = ()
    if request.loops is None and request.finding:
        rows = draft(source, (), request.span)
        specs = tuple(row.as_run for row in rows if row.sure)
        notes = found_text(rows)
    elif request.loops is None:
        specs = find_loops(source.tags)
    else:
        specs, notes = match(stated, source.tags)
        own = unknown_columns(stated)
        if own:
            note = f"{request.loops}: columns {', '.join(own)} are not used and are kept as the plant's own"
            notes = (note, *notes)
    specs, currents = in_milliamperes(source, specs)
    notes = (*notes, *currents, *_of_no_loop(request.changes, specs))
    return Plant(source, specs, request.config, request.span, request.changes, request.zone, notes)


def drafted(request: ExportRequest, report: Callable[[int, int], None]) -> list[Row]:
    """The rows of a draft of loops.csv, those of a given one first; `report` is called with the number of tags read,
    and of all. Raises InputError where the export cannot be used."""
    plant = guarded(request)
    return draft(plant.export, () if request.loops is None else plant.specs, request.span, report)


def in_milliamperes(
    source: Export, specs: tuple[LoopSpec, ...]
) -> tuple[tuple[LoopSpec, ...], tuple[str, ...]]:
    """The loops, marked if their OPs look like currents, and a note on that: if no range of OP is stated, for two or
    more loops, and each tested OP is within the range of a signal of 4 to 20 mA."""
    unstated = [
        s for s in specs if s.op and s.pv and s.stated.isdisjoint(("op_lo", "op_hi")) and s.op_hi == 100.0
    ]
    looked_at = unstated[:MA_LOOPS]
    if len(unstated) < 2 or not all(_lies_within(source, str(s.op), MA_LOW, MA_HIGH) for s in looked_at):
        return specs, ()
    note = (
        f"OP of {len(unstated)} loops lies between 4 and 20, like mA: nothing is reported in % of OP; state "
    )
    marked = tuple(replace(s, in_ma=True) if s in unstated else s for s in specs)
    return marked, (f"{note}op_lo 4 and op_hi 20 in loops.csv, or 0 and 100 where it is percent",)


def _lies_within(source: Export, tag: str, low: float, high: float) -> bool:
    """Whether all good values of a tag are between two others."""
    with suppress(InputError):  # a damaged file is reported where its loop is assessed
        series = source.read([tag])[tag]
        value = series.value[~series.bad]
        return value.size > 0 and bool(low <= value.min() and value.max() <= high)
    return False


def _of_no_loop(changes: Sequence[TuningChange], specs: Sequence[LoopSpec]) -> tuple[str, ...]:
    """A note on changes of loops that are not read."""
    strange = sorted({change.loop for change in changes} - {spec.loop for spec in specs})
    more = f" and {len(strange) - MOST_NAMES} more" if len(strange) > MOST_NAMES else ""
    text = f"{', '.join(strange[:MOST_NAMES])}{more}: no such loop is read; these changes are ignored"
    return (f"--changes: {text}: correct the name",) if strange else ()


def opened_apart(request: ExportRequest) -> Plant:
    """The request, opened in a worker process, because a damaged file may need unlimited memory or time. Raises
    InputError if the export cannot be used, or the process that read it died."""
    with Workers(1, opened_with_spans, _allowed(request)) as workers:
        workers.submit(request)
        (found,) = workers.results()
    if isinstance(found, WorkerDeath):
        raise _ended(request.export[0], found.why)
    return found


def _ended(path: Path, why: str) -> InputError:
    seen = f"{path}: reading it ended without a result ({why})"
    remedy = "export them again or in parts; 'triage check FILE' on each finds the one"
    return InputError(seen, "files that are whole and fit into memory", remedy)


def guarded(request: ExportRequest) -> Plant:
    """The same, with its samples also read in a worker process; errors as of `opened_apart`, also on reading
    samples."""
    scratch = request.reading.get("scratch") or own_scratch()  # removed with this process in any case
    plant = opened_apart(replace(request, reading={**request.reading, "scratch": scratch}))
    return replace(plant, export=Guarded.of(plant.export, request.config.workers))


class Guarded(Export):
    """An export whose samples are read in a worker process with limits of memory and time."""

    __slots__ = ("__weakref__", "_plain", "_sent", "_worker")
    _plain: Export
    _sent: list[Export]
    _worker: Workers[Any, dict[str, Series]]

    @classmethod
    def of(cls, plain: Export, limits: WorkerLimits) -> Guarded:
        """An export, read under limits; the worker ends with it."""
        export = cls(**{f.name: getattr(plain, f.name) for f in fields(plain)})
        worker = Workers(1, read_apart, limits)
        for name, value in (("_plain", plain), ("_sent", []), ("_worker", worker)):
            object.__setattr__(export, name, value)
        finalize(export, worker.__exit__)
        return export

    def read(self, tags: Sequence[str]) -> dict[str, Series]:
        self._check_known(tags)
        self._worker.submit((None if self._sent else self._plain, tuple(tags)))
        (found,) = self._worker.results()
        if isinstance(found, WorkerDeath):
            self._sent.clear()
            raise _ended(self.sources[self._homes[tags[0]][0]].path, found.why)
        self._sent[:] = [self._plain]
        self._met.update({tag: series.found for tag, series in found.items() if series.found})
        return found


_reading: list[Export] = []
"""The export that a worker process reads."""


def read_apart(given: tuple[Export | None, Sequence[str]], began: Callable[[int], None]) -> dict[str, Series]:
    """Result of a worker's read of an export, which it receives once."""
    _be_silent()
    export, tags = given
    if export is not None:
        _reading[:] = [export]
    return _reading[0].read(tags)


def _be_silent() -> None:
    """Suppress all terminal output of libraries, such as that of an aborting reader."""
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)


def _allowed(request: ExportRequest) -> WorkerLimits:
    """Limits for opening the export, by its size; for shared storage the copying is not known beforehand."""
    near = [path for path in request.export if not is_remote(path)]
    files = [file for path in near for file in (path.rglob("*") if path.is_dir() else [path])]
    limits = request.config.opening
    more_s = sum(file.stat().st_size for file in files if file.is_file()) / limits.bytes_per_s
    more_s += limits.fetched_s * (len(near) < len(request.export))
    taking = {"processor_s": limits.processor_s + more_s, "wall_s": limits.wall_s + 6.0 * more_s}
    return replace(request.config.workers, memory_mb=limits.memory_mb, **taking)


def opened_with_spans(request: ExportRequest, began: Callable[[int], None]) -> Plant:
    """Open an export in a worker, including its span of time."""
    _be_silent()
    plant = opened(request)
    for spec in plant.specs:
        if spec.pv is not None:
            plant.export.span(spec.pv)
    with suppress(InputError):  # files without a loop are not an error
        plant.export.span()
    return plant
