"""Exports: one or many files of one historian, read a few tags at a time.

export = open_export([Path("export.parquet")])
series = export.read(["FIC101.PV", "FIC101.OP"])["FIC101.PV"]
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from difflib import get_close_matches
from pathlib import Path

import pyarrow as pa

from analyzer.history.clock import is_of_day
from analyzer.history.files import Mark, export_files, is_parquet, mark_of, unpacked, unsupported_archives
from analyzer.history.layouts import Source, source_of, tag_column
from analyzer.history.parquet import converted, open_parquet
from analyzer.history.plant_clock import zone_of
from analyzer.history.series import MainSpan, NoStampError, Series, joined_pieces
from analyzer.history.sheet import WHOLE_BYTES, Sheet
from analyzer.history.sniff import open_sheet
from analyzer.history.table import ReadOptions
from analyzer.locations import fetch_missing, is_remote, local_copies
from identification.errors import InputError

WHOLE_ROWS = 2000000
"""Rows from which a long Parquet file is split by loop once, instead of being searched again for each loop
[rows]."""

DOUBT = "; state "
"""Text in notes between a reading and the option for another possible reading."""
__all__ = ["Export", "ReadOptions", "open_export"]


@dataclass(frozen=True, slots=True)
class Export:
    """Paths and layouts, no samples; small enough to send to a worker process.

    Parameters
    ----------
    sources : tuple of Source
        One per file.
    tags : tuple of str
        All tags, in the order of their first occurrence.
    skipped : tuple of str
        Files of a folder that could not be read, each with the reason.
    origins : mapping of Path to str
        URLs of the files that were copied from shared storage.
    marks : mapping of Path to Mark
        Marks of the files when they were opened.
    """

    sources: tuple[Source, ...]
    tags: tuple[str, ...]
    _homes: dict[str, tuple[int, ...]] = field(repr=False, compare=False)
    skipped: tuple[str, ...] = ()
    origins: Mapping[Path, str] = field(default_factory=dict, repr=False, compare=False)
    marks: Mapping[Path, Mark] = field(default_factory=dict, repr=False, compare=False)
    _met: dict[str, Counter[str]] = field(default_factory=dict, repr=False, compare=False)
    _spans: dict[int, MainSpan] = field(default_factory=dict, repr=False, compare=False)

    def read(self, tags: Sequence[str]) -> dict[str, Series]:
        """Samples of some tags, each oldest first; no other columns are touched.

        Raises
        ------
        InputError
            A tag is not in the export, or a file changed so that it cannot be read.
        """
        self._check_known(tags)
        homes = sorted({home for tag in tags for home in self._homes[tag]})
        pieces = []
        for home in homes:
            fetch_missing(self.sources[home].path, self.origins)
            with _reported_errors(self.sources[home].path):
                pieces.append(self.sources[home].read(tags))
        series = {}
        for tag in tags:
            series[tag] = joined_pieces([piece[tag] for piece in pieces if tag in piece])
            if series[tag].found:
                self._met[tag] = series[tag].found
        return series

    def span(self, tag: str | None = None) -> tuple[float, float]:
        """First and last stamp of all files, or of those with a tag [s since 1970-01-01 UTC].

        Stray stamps, far from the rest of their file, are excluded and reported in the notes.
        """
        homes = range(len(self.sources)) if tag is None else self._homes[tag]
        for home in homes:
            if home not in self._spans:
                with _reported_errors(self.sources[home].path):
                    self._spans[home] = self.sources[home].span()
        spans = [self._spans[home] for home in homes]
        return min(s.first_s for s in spans), max(s.last_s for s in spans)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was detected, one sentence each: for every file, and for the samples of all tags read so far."""
        return (*self.file_notes, *problems_text(self.met(self._met)))

    @property
    def file_notes(self) -> tuple[str, ...]:
        """What was detected in every file, and excluded stamps; ambiguous readings first."""
        files: dict[str, list[str]] = {}
        for source in self.sources:
            for note in source.notes:
                files.setdefault(note, []).append(source.path.name)
        notes = [*self.skipped, *(f"{_some(names)}: {note}" for note, names in files.items())]
        if stray := sum(s.stray for s in self._spans.values()):
            notes.append(f"{stray} stamps lie far from the rest of their file and are set aside")
        return tuple(sorted(notes, key=lambda note: DOUBT not in note))

    def met(self, tags: Iterable[str]) -> Counter[str]:
        """Number of occurrences of each reportable problem in the samples of some tags that were read."""
        return sum((self._met[tag] for tag in tags if tag in self._met), Counter())

    def _check_known(self, tags: Sequence[str]) -> None:
        missing = next((tag for tag in tags if tag not in self._homes), None)
        if missing is not None:
            near = ", ".join(get_close_matches(missing, self.tags, n=3))
            expected = f"one of its {len(self.tags)} tags" + (f" (near: {near})" if near else "")
            seen = f"tag {missing} is not in the export"
            raise InputError(seen, expected, "correct the tag in loops.csv or export it too")


def open_export(paths: Sequence[Path], options: ReadOptions | None = None) -> Export:
    """Detect the contents of files without reading their values.

    Parameters
    ----------
    paths : sequence of Path
        Files, or folders of them; those of shared storage (locations.py) are copied first.
    options : ReadOptions
        What the user states; the rest is detected.

    Raises
    ------
    InputError
        A file is missing, closed, empty, or no export.
    """
    options = options or ReadOptions()
    _check_stated(options)
    paths, origins = local_copies(paths, options.place) if any(map(is_remote, paths)) else (paths, {})
    marks = _marks(export_files(paths))
    opened, skipped = _readable_files(paths, options)
    sources = _agreed(opened)
    homes: dict[str, tuple[int, ...]] = {}
    for i, source in enumerate(sources):
        homes.update({tag: (*homes.get(tag, ()), i) for tag in source.tags})
    return Export(sources, tuple(homes), homes, (*skipped, *unsupported_archives(paths)), origins, marks)


def _marks(paths: Iterable[Path]) -> dict[Path, Mark]:
    """Marks of files; an unreadable one is reported when it is opened."""
    marks = {}
    for path in paths:
        with suppress(OSError):
            marks[path] = mark_of(path)
    return marks


def _check_stated(options: ReadOptions) -> None:
    """Raise InputError for options with which no file could be read."""
    if options.timezone is not None:
        zone_of(options.timezone or "nowhere")
    _ = options.interval_s
    mark, encoding, written = options.delimiter, options.encoding, options.date_format
    if mark is not None and (len(mark) != 1 or mark in '\r\n"\0'):
        raise InputError(f"--delimiter {mark!r}", "one character, no quote and no end of line", "correct it")
    if encoding is not None and not _is_encoding(encoding):
        raise InputError(
            f"--encoding {encoding!r}", "an encoding of text such as utf-8 or cp1252", "correct it"
        )
    if written is not None and not _is_format(written):
        raise InputError(f"--date-format {written!r}", "a format such as '%d-%b-%y %H:%M:%S'", "correct it")


def _is_encoding(name: str) -> bool:
    try:
        return codecs.lookup(name)._is_text_encoding
    except LookupError:
        return False


def _is_format(written: str) -> bool:
    try:
        again = datetime.strptime(datetime(2026, 5, 12, 8, 9, 10).strftime(written), written)
    except (ValueError, re.error):
        return False
    return again.year == 2026 or is_of_day(written)  # a format without a year reads as 1900


def _readable_files(paths: Sequence[Path], options: ReadOptions) -> tuple[list[Source], list[str]]:
    """The readable files, and why others of a folder are not: only their loops are lost."""
    sources: list[Source] = []
    skipped: list[InputError] = []
    named = {Path(path) for path in paths}
    for path in export_files(paths):
        found, failed = _opened_tables(path, options)
        if path in named and not found:
            raise failed[0]
        sources += found
        skipped += failed if found else failed[:1]
    if not sources:
        raise skipped[0]
    return sources, [f"left out: {error}" for error in skipped]


def _opened_tables(path: Path, options: ReadOptions) -> tuple[list[Source], list[InputError]]:
    """The tables of a file, one except for workbooks, and the errors of it or of other sheets of a workbook."""
    try:
        with _reported_errors(path):
            parts = unpacked(path, options.place)
    except InputError as error:
        return [], [error]
    found: list[Source] = []
    failed: list[InputError] = []
    for part in parts:
        try:
            with _reported_errors(path):
                found.append(_table_source(part, options))
        except InputError as error:
            seen = error.seen.replace(str(part), str(path.with_name(part.name)))
            failed.append(InputError(seen, error.expected, error.remedy))
    return found, failed


def _table_source(plain: Path, options: ReadOptions) -> Source:
    table = open_parquet(plain) if is_parquet(plain) else open_sheet(plain, options)
    tag = tag_column(table)
    whole = table.bytes < WHOLE_BYTES if isinstance(table, Sheet) else tag < 0 or table.rows < WHOLE_ROWS
    return source_of(table if whole else converted(table, tag, options.place), options)


def _agreed(sources: Sequence[Source]) -> tuple[Source, ...]:
    """Files whose dates are ambiguous get the order of a file of the same export whose dates are not; and all keep
    winter time if one file shows that its clock does."""
    winter_s = next((s.clock.winter_s for s in sources if s.clock.winter_s is not None), None)
    if winter_s is not None:
        sources = [s.with_clock(winter_s=winter_s) if s.clock.local else s for s in sources]
    orders = ((s.clock.order, s.path.name) for s in sources)
    sure = next((replace(order, why=f"as in {name}") for order, name in orders if order and order.sure), None)
    if sure is None:
        return tuple(sources)
    doubtful = (s.clock.order is not None and not s.clock.order.sure for s in sources)
    return tuple(s.with_clock(order=sure) if d else s for s, d in zip(sources, doubtful, strict=True))


def problems_text(met: Counter[str]) -> list[str]:
    """Sentences on problems in samples, the most frequent first."""
    return [f"{count} {what}" for what, count in met.most_common()]


def _some(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more files"


@contextmanager
def _reported_errors(path: Path) -> Iterator[None]:
    """Report file errors that appear only on reading: missing, truncated, damaged, too large, without a stamp."""
    try:
        yield
    except MemoryError as error:
        seen = f"{path}: needs more memory than is available"
        raise InputError(seen, "files that fit into memory", "export it in parts") from error
    except NoStampError as error:
        expected = "dates and times that exist in the time zone"
        raise InputError(f"{path}: no readable time stamp", expected, "check dates and --timezone") from error
    except KeyError as error:
        seen = f"{path}: has no column {error} any more"
        raise InputError(
            seen, "an export that stays as it is", "run it when the historian has finished"
        ) from error
    except (OSError, pa.ArrowException, UnicodeError, csv.Error) as error:
        why = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(f"{path}: {why}", "a whole file", "export it again") from error
