"""Parquet files: columns by projection, rows of one tag by filter."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Sequence
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


@dataclass(frozen=True, slots=True)
class ParquetTable(Table):
    """A Parquet file, known by its footer."""

    rows: int = 0

    def head(self, columns: Sequence[int]) -> list[pa.Array]:
        names = [self.names[i] for i in columns]
        batches = _parquet_file(self).iter_batches(batch_size=HEAD_ROWS, columns=names)
        batch = next((b for b in batches if b.num_rows), None)
        if batch is None:
            raise InputError(
                f"{self.path}: rows that its pages do not hold", "a whole Parquet file", "export it again"
            )
        return [batch.column(name) for name in names]

    def read(self, columns: Sequence[int], where: tuple[int, Sequence[str]] | None = None) -> list[pa.Array]:
        names = [self.names[i] for i in columns]
        if where is None:
            table = _parquet_file(self).read(columns=names)
        else:
            key, kind = pc.field(self.names[where[0]]), self.types[where[0]]
            text = pa.types.is_string(kind) or pa.types.is_large_string(kind)
            kept = (key if text else key.cast(pa.string())).isin([*where[1]])
            table = pq.read_table(self.path, columns=names, filters=kept, partitioning=None)
        return [one_array(table.column(name)) for name in names]


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
        raise InputError(
            f"{path}: named as Parquet, but cannot be read as such ({_first_line(error)})",
            "a whole Parquet file",
            "export it again, or give it the ending .csv if it is text",
        ) from error
    check_once(path, schema.names)
    if rows > HISTORY.many_rows and rows > HISTORY.rows_a_byte * path.stat().st_size:
        raise InputError(
            f"{path}: {rows} rows in {path.stat().st_size} bytes",
            f"at most {HISTORY.rows_a_byte:g} rows a byte",
            "export it again; a file that unpacks to so much more is not read",
        )
    if long_text > HISTORY.longest_text:
        raise InputError(
            f"{path}: texts of {long_text:.0f} bytes on average",
            f"at most {HISTORY.longest_text:g} bytes for a tag, a stamp or a state",
            "export numbers, tags and stamps alone",
        )
    if path.stat().st_size < HISTORY.probed_bytes:
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
        raise InputError(
            f"{path}: its pages take longer than {HISTORY.probe_s:g} s to read",
            "a whole Parquet file",
            "export it again",
        )


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


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0][:100] if str(error) else type(error).__name__


@lru_cache(maxsize=OPEN_FILES)
def _opened_once(path: Path, changed_ns: int, process: int) -> pq.ParquetFile:
    return pq.ParquetFile(path)  # not mapped: pages of a file that stays open would stay in memory


def _parquet_file(table: ParquetTable) -> pq.ParquetFile:
    """The file, opened once by each process: of a footer with thousands of columns that takes as long as a loop."""
    return _opened_once(table.path, table.path.stat().st_mtime_ns, os.getpid())
