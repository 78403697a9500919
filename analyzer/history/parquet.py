"""Parquet files: columns by projection, rows of one tag by filter."""

from __future__ import annotations

import contextlib
import os
import threading
import zlib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from analyzer.history.names import check_once
from analyzer.history.table import HEAD_ROWS, Table, one_array
from analyzer.limits import HISTORY
from identification.errors import InputError

OPEN_FILES = 4
PIECES = 64
"""Files of a long copy; ours: of 4,500 tags each holds seventy, and a loop's four lie in a sixteenth of all."""


@dataclass(frozen=True, slots=True)
class ParquetTable(Table):
    """A Parquet file, known by its footer; or a copy in a `folder` (converted.py), its columns named by position: one
    piece, or of a long table those in which a row is by its tag."""

    rows: int = 0
    folder: Path | None = None

    def head(self, columns: Sequence[int]) -> list[pa.Array]:
        names = self._stored(columns)
        batches = _opened(self._largest()).iter_batches(batch_size=HEAD_ROWS, columns=names)
        batch = next((b for b in batches if b.num_rows), None)
        if batch is None:
            seen = f"{self.path}: rows that its pages do not hold"
            raise InputError(seen, "a whole Parquet file", "export it again")
        return [batch.column(name) for name in names]

    def read(self, columns: Sequence[int], where: tuple[int, Sequence[str]] | None = None) -> list[pa.Array]:
        """Whole columns, or the rows where the tag's column holds one of some texts.

        Without `where`, of a long copy the rows of one piece stand for all: they are of all times.
        """
        if where is None:
            return self._columns(self._largest(), columns)
        kind, (key,), names = self.types[where[0]], self._stored(where[:1]), self._stored(columns)
        text = pa.types.is_string(kind) or pa.types.is_large_string(kind)
        kept = (pc.field(key) if text else pc.field(key).cast(pa.string())).isin([*where[1]])
        files = self._pieces({piece_of(tag) for tag in where[1]})
        table = pq.read_table(files, columns=names, filters=kept, partitioning=None)
        return [one_array(table.column(name)) for name in names]

    def each(self, columns: Sequence[int]) -> Iterator[list[pa.Array]]:
        return (self._columns(path, columns) for path in self._pieces())

    def _columns(self, path: Path, columns: Sequence[int]) -> list[pa.Array]:
        names = self._stored(columns)
        table = _opened(path).read(columns=names)
        return [one_array(table.column(name)) for name in names]

    def _stored(self, columns: Sequence[int]) -> list[str]:
        """Names of columns as they stand in the files."""
        return [self.names[i] if self.folder is None else str(i) for i in columns]

    def _pieces(self, wanted: Collection[int] | None = None) -> list[Path]:
        """The files, or those of some numbers."""
        if self.folder is None:
            return [self.path]
        return [p for p in sorted(self.folder.glob("*.parquet")) if wanted is None or int(p.stem) in wanted]

    def _largest(self) -> Path:
        return max(self._pieces(), key=lambda p: (p.stat().st_size, p.name))


@lru_cache(maxsize=100_000)
def piece_of(tag: str) -> int:
    """The piece of a tag: that of its loop, which is what stands before its last point, stroke or colon."""
    loop = tag[: max(tag.rfind(mark) for mark in "./:|")] or tag
    return zlib.crc32(loop.encode("utf-8")) % PIECES


def open_parquet(path: Path) -> ParquetTable:
    """The file's columns from its footer.

    Raises
    ------
    InputError
        The file is no Parquet, is cut short, or holds no rows.
    """
    try:
        with pq.ParquetFile(path) as file:
            schema, rows, long_text = file.schema_arrow, file.metadata.num_rows, _longest_text(file.metadata)
    except (pa.ArrowException, OSError) as error:
        why = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        seen = f"{path}: named as Parquet, but cannot be read as such ({why})"
        remedy = "export it again, or give it the ending .csv if it is text"
        raise InputError(seen, "a whole Parquet file", remedy) from error
    check_once(path, schema.names)
    size = path.stat().st_size
    if rows > HISTORY.many_rows and rows > HISTORY.rows_a_byte * size:
        remedy = "export it again; a file that unpacks to so much more is not read"
        expected = f"at most {HISTORY.rows_a_byte:g} rows a byte"
        raise InputError(f"{path}: {rows} rows in {size} bytes", expected, remedy)
    if long_text > HISTORY.longest_text:
        expected = f"at most {HISTORY.longest_text:g} bytes for a tag, a stamp or a state"
        seen = f"{path}: texts of {long_text:.0f} bytes on average"
        raise InputError(seen, expected, "export numbers, tags and stamps alone")
    if size < HISTORY.probed_bytes:
        _check_pages(path)
    if rows == 0:
        raise InputError(f"{path}: Parquet without rows", "at least one sample", "export a period with data")
    return ParquetTable(path, tuple(schema.names), tuple(schema.types), rows=rows)


def _check_pages(path: Path) -> None:
    """Raise InputError for a file whose pages, damaged, are read without end; other damage shows where it is read.

    The read is left to a thread, which ends with the process: nothing else stops it.
    """
    reading = threading.Thread(target=_read_through, args=(path,), daemon=True)
    reading.start()
    reading.join(HISTORY.probe_s)
    if reading.is_alive():
        seen = f"{path}: its pages take longer than {HISTORY.probe_s:g} s to read"
        raise InputError(seen, "a whole Parquet file", "export it again")


def _read_through(path: Path) -> None:
    with contextlib.suppress(pa.ArrowException, OSError, MemoryError), pq.ParquetFile(path) as file:
        for _ in file.iter_batches(use_threads=False):
            pass


def _longest_text(footer: pq.FileMetaData) -> float:
    """Mean length of the longest texts that a column has in a row group, as the footer declares them [bytes]; 0 where
    none has much text."""
    texts = [j for j in range(footer.num_columns) if footer.schema.column(j).physical_type == "BYTE_ARRAY"]
    groups = [footer.row_group(k) for k in range(footer.num_row_groups)]
    sizes = [(g.column(j).total_uncompressed_size, g.num_rows) for g in groups for j in texts]
    return max((size / max(rows, 1) for size, rows in sizes if size > HISTORY.much_text), default=0.0)


@lru_cache(maxsize=OPEN_FILES)
def _opened_once(path: Path, changed_ns: int, process: int) -> pq.ParquetFile:
    return pq.ParquetFile(path)  # not mapped: pages of a file that stays open would stay in memory


def _opened(path: Path) -> pq.ParquetFile:
    """The file, opened once by each process: of a footer with thousands of columns that takes as long as a loop."""
    return _opened_once(path, path.stat().st_mtime_ns, os.getpid())
