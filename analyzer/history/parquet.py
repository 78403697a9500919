"""Parquet files: columns by projection, rows of one tag by filter; and copies of large exports.

Exports too large to be read once per loop are streamed once into Parquet by loop, in bounded memory. A wide table
becomes one file, of which each loop reads its columns. The rows of a long one, whose tags may be interleaved, go to
some dozens of files by tag, so that a loop's tags are in a few of them.

A copy is made completely or not at all, so that a resumed run can use it: it is identified by the file's name, size
and both ends, by the read options, and by this program's version.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import tempfile
import threading
import zlib
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pyarrow import csv

from analyzer.history.files import ends_of
from analyzer.history.sheet import Sheet, read_through, reading
from analyzer.history.table import HEAD_ROWS, Table, check_once, is_text, one_array, trimmed
from identification.errors import InputError

MANY_ROWS = 5000000.0  # Rows of a Parquet file beyond which ROWS_A_BYTE applies [rows]
ROWS_A_BYTE = 20.0
"""Files of more are not read [rows/byte]: if any value changes there are 3 at most, in any encoding; a file
of nothing but constants may have 90."""
PROBED_BYTES = 4000000
"""Size below which a Parquet file is read completely when it is opened [bytes]; this takes 50 ms. For
larger files the limits of a run's workers apply."""
PROBE_S = 10.0  # Time that this may take by the clock [s]
LONGEST_TEXT = 1000.0
"""Mean length of texts in a row group of a column [bytes]. A Parquet file with longer ones is not read if
they exceed MUCH_TEXT together. Names, stamps and states are short; a few texts of megabytes unpack from
nothing to gigabytes."""
MUCH_TEXT = 10000000
"""See LONGEST_TEXT [bytes]: a list of ten thousand tags, which is complete before a group of few rows, has a
twentieth of it."""

OPEN_FILES = 4
PIECES = 64
"""Files of a long copy; ours: of 4,500 tags each contains seventy, and a loop's four are in a sixteenth of all."""
BATCH_ROWS = 500_000
"""Rows of a Parquet file per batch."""
HELD_ROWS = 32_768
"""Buffered rows of a file before writing: 64 files of 50 bytes a row need 100 MB."""
PROBED_GROUPS = 64
"""Row groups, distributed over a file, whose texts are checked."""
DONE = "done.json"
"""Description of a copy; written last."""
NAMED = "converted-"
Description = dict[str, list[str]]
"""Results of a pass over an export: notes, and the tags of a long table in the order of their first rows."""


@dataclass(frozen=True, slots=True)
class ParquetTable(Table):
    """A Parquet file, described by its footer; or a copy in a `folder`, its columns named by position: one file, or
    for a long table several, selected by tag."""

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
        """Whole columns, or the rows where the tag's column contains one of some texts.

        Without `where`, the rows of one piece represent a whole long copy: they cover all times.
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
        """Names of columns as in the files."""
        return [self.names[i] if self.folder is None else str(i) for i in columns]

    def _pieces(self, wanted: Collection[int] | None = None) -> list[Path]:
        """The files, or those with some numbers."""
        if self.folder is None:
            return [self.path]
        return [p for p in sorted(self.folder.glob("*.parquet")) if wanted is None or int(p.stem) in wanted]

    def _largest(self) -> Path:
        return max(self._pieces(), key=lambda p: (p.stat().st_size, p.name))


@lru_cache(maxsize=100_000)
def piece_of(tag: str) -> int:
    """The piece of a tag: that of its loop, which is the part before its last point, stroke or colon."""
    loop = tag[: max(tag.rfind(mark) for mark in "./:|")] or tag
    return zlib.crc32(loop.encode("utf-8")) % PIECES


def open_parquet(path: Path) -> ParquetTable:
    """The file's columns from its footer.

    Raises
    ------
    InputError
        The file is not Parquet, is truncated, or has no rows.
    """
    try:
        with pq.ParquetFile(path) as file:
            schema, rows, long_text = file.schema_arrow, file.metadata.num_rows, _longest_text(file.metadata)
            encoded = _encoded_bytes(file.metadata)
    except (pa.ArrowException, OSError) as error:
        why = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        seen = f"{path}: named as Parquet, but cannot be read as such ({why})"
        remedy = "export it again, or give it the ending .csv if it is text"
        raise InputError(seen, "a whole Parquet file", remedy) from error
    check_once(path, schema.names)
    size = path.stat().st_size
    if rows > MANY_ROWS and rows > ROWS_A_BYTE * min(encoded, size):
        remedy = "export it again; a file that unpacks to so much more is not read"
        expected = f"at most {ROWS_A_BYTE:g} rows a byte"
        raise InputError(f"{path}: {rows} rows in {min(encoded, size)} bytes", expected, remedy)
    if long_text > LONGEST_TEXT:
        expected = f"at most {LONGEST_TEXT:g} bytes for a tag, a stamp or a state"
        seen = f"{path}: texts of {long_text:.0f} bytes on average"
        raise InputError(seen, expected, "export numbers, tags and stamps alone")
    if size < PROBED_BYTES:
        _check_pages(path)
    _require_short_texts(path, schema)
    if rows == 0:
        raise InputError(f"{path}: Parquet without rows", "at least one sample", "export a period with data")
    return ParquetTable(path, tuple(schema.names), tuple(schema.types), rows=rows)


def _encoded_bytes(footer: pq.FileMetaData) -> int:
    """Size of all column chunks as declared in the footer, without padding [bytes]."""
    groups = (footer.row_group(k) for k in range(footer.num_row_groups))
    return sum(g.column(j).total_compressed_size for g in groups for j in range(footer.num_columns))


def _require_short_texts(path: Path, schema: pa.Schema) -> None:
    """Raise InputError if many rows share long texts through a dictionary: decoded they need gigabytes."""
    names = [f.name for f in schema if is_text(f.type)]
    with contextlib.suppress(pa.ArrowException, OSError), pq.ParquetFile(path, read_dictionary=names) as file:
        footer = file.metadata
        step = max(footer.num_row_groups // PROBED_GROUPS, 1)
        for k in range(0, footer.num_row_groups if names else 0, step):
            rows = footer.row_group(k).num_rows
            batch = next(file.iter_batches(1, row_groups=[k], columns=names, use_threads=False), None)
            for column in batch.columns if batch is not None else ():
                held = column.dictionary if pa.types.is_dictionary(column.type) else column
                longest = pc.max(pc.binary_length(held.cast(pa.large_string()))).as_py() or 0
                if longest > LONGEST_TEXT and longest * rows > MUCH_TEXT:
                    expected = f"at most {LONGEST_TEXT:g} bytes for a tag, a stamp or a state"
                    seen = f"{path}: texts of {longest} bytes in a column of {rows} rows"
                    raise InputError(seen, expected, "export numbers, tags and stamps alone")


def _check_pages(path: Path) -> None:
    """Raise InputError for a file with damaged pages that would be read endlessly; other damage appears on reading.

    The read runs in a thread, which ends with the process: nothing else stops it.
    """
    reading = threading.Thread(target=_read_through, args=(path,), daemon=True)
    reading.start()
    reading.join(PROBE_S)
    if reading.is_alive():
        seen = f"{path}: its pages take longer than {PROBE_S:g} s to read"
        raise InputError(seen, "a whole Parquet file", "export it again")


def _read_through(path: Path) -> None:
    with contextlib.suppress(pa.ArrowException, OSError, MemoryError), pq.ParquetFile(path) as file:
        for _ in file.iter_batches(use_threads=False):
            pass


def _longest_text(footer: pq.FileMetaData) -> float:
    """Mean length of the longest texts of a column in a row group, as declared in the footer [bytes]; 0 without much
    text."""
    texts = [j for j in range(footer.num_columns) if footer.schema.column(j).physical_type == "BYTE_ARRAY"]
    groups = [footer.row_group(k) for k in range(footer.num_row_groups)]
    sizes = [(g.column(j).total_uncompressed_size, g.num_rows) for g in groups for j in texts]
    return max((size / max(rows, 1) for size, rows in sizes if size > MUCH_TEXT), default=0.0)


@lru_cache(maxsize=OPEN_FILES)
def _opened_once(path: Path, changed_ns: int, process: int) -> pq.ParquetFile:
    return pq.ParquetFile(path)  # not mapped: pages of an open file would stay in memory


def _opened(path: Path) -> pq.ParquetFile:
    """The file, opened once per process: opening a footer with thousands of columns takes as long as a loop."""
    return _opened_once(path, path.stat().st_mtime_ns, os.getpid())


def converted(table: Sheet | ParquetTable, tag: int, place: Path) -> ParquetTable:
    """Stream a table into Parquet, or use the copy of an earlier process.

    Parameters
    ----------
    table : Sheet or ParquetTable
        Text, or a long Parquet file, which would otherwise be decoded fully for each loop.
    tag : int
        Column of the tags of a long table, -1 for a wide one.
    place : Path
        Folder of the files.

    Raises
    ------
    InputError
        The disk is full, or the text cannot be read.
    """
    mark = hashlib.blake2b(ends_of(table.path), digest_size=16)
    mark.update(repr((table.path.name, table, tag, version("loop-triage"))).encode())
    folder = place / f"{NAMED}{mark.hexdigest()}"
    done = _stored_description(folder) or _write_copy(table, tag, folder)
    first = next(folder.glob("*.parquet"), None)
    if first is None:
        expected = "rows of as many columns as the header"
        raise InputError(f"{table.path}: no row", expected, "export it again")
    return ParquetTable(
        table.path,
        table.names,
        tuple(pq.read_schema(first).types),
        (*table.found, *done["notes"]),
        table.decimal,
        table.first_row,
        tuple(done["tags"]),
        folder=folder,
    )


def holds_copies(place: Path) -> bool:
    """Whether a directory of copies has a complete one."""
    return any(place.glob(f"{NAMED}*/{DONE}"))


def forget_halves(place: Path) -> None:
    """Remove incomplete copies of a terminated process from a directory."""
    for folder in place.iterdir():
        if folder.is_dir() and not (folder / DONE).exists():
            shutil.rmtree(folder, ignore_errors=True)


def _stored_description(folder: Path) -> Description | None:
    """Description of a complete copy; None where there is none, or a file lost its end in a power failure."""
    try:
        found = json.loads((folder / DONE).read_text(encoding="utf-8"))
        for path in folder.glob("*.parquet"):
            pq.read_metadata(path)
        return {"notes": [*found["notes"]], "tags": [*found["tags"]]}
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError):
        return None


def _write_copy(table: Sheet | ParquetTable, tag: int, folder: Path) -> Description:
    """Write a copy to a folder, which exists once it is complete."""
    room = table.path.stat().st_size * (1 if isinstance(table, Sheet) else 4)
    if shutil.disk_usage(folder.parent).free < room:
        seen = f"{table.path}: no room for a copy of {room / 1e9:.1f} GB in {folder.parent}"
        raise InputError(seen, "free disk", "make room")
    copy = Path(tempfile.mkdtemp(prefix=NAMED, dir=folder.parent))
    if isinstance(table, Sheet):
        tags, notes = read_through(table, partial(_sheet_parted, tag, copy))
    else:
        tags, notes = _parted(_decoded(table.path), tag, copy)[1], []
    done = {"notes": notes, "tags": tags}
    (copy / DONE).write_text(json.dumps(done), encoding="utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    os.replace(copy, folder)
    return done


def _sheet_parted(tag: int, folder: Path, sheet: Sheet, texts: Collection[int]) -> tuple[int, int, list[str]]:
    """Number of lines of a sheet that were rows and that were left out, and the tags."""
    for old in folder.glob("*.parquet"):  # of an earlier pass
        old.unlink()
    left_out: list[int] = []
    with csv.open_csv(sheet.path, **reading(sheet, left_out, {*texts, tag} - {-1})) as reader:
        batches = ([trimmed(a, sheet.unquoted) for a in batch.columns] for batch in reader)
        rows, tags = _parted(batches, tag, folder)
    return rows, len(left_out), tags


def _decoded(path: Path) -> Iterator[list[pa.Array]]:
    """The rows of a Parquet file with decoded dictionaries, because their batches have different types."""
    with pq.ParquetFile(path) as file:
        for batch in file.iter_batches(batch_size=BATCH_ROWS):
            yield [a.dictionary_decode() if pa.types.is_dictionary(a.type) else a for a in batch.columns]


def _parted(batches: Iterable[list[pa.Array]], tag: int, folder: Path) -> tuple[int, list[str]]:
    """Write rows to the files of their pieces; return their number, and the tags in order of first occurrence."""
    rows, tags = 0, dict[str, None]()
    held = defaultdict[int, list[pa.RecordBatch]](list)
    writers: dict[int, pq.ParquetWriter] = {}

    def write(k: int) -> None:
        table = pa.Table.from_batches(held.pop(k))
        if k not in writers:
            path = folder / f"{k:03d}.parquet"
            writers[k] = opened.enter_context(pq.ParquetWriter(path, table.schema, compression="snappy"))
        writers[k].write_table(table.combine_chunks())

    with contextlib.ExitStack() as opened:
        for columns in batches:
            batch = pa.RecordBatch.from_arrays(columns, names=[str(i) for i in range(len(columns))])
            rows += batch.num_rows
            for k, part in _by_piece(batch, tag, tags):
                held[k].append(part)
                if sum(some.num_rows for some in held[k]) >= HELD_ROWS:
                    write(k)
        for k in list(held):
            write(k)
    return rows, list(tags)


def _by_piece(batch: pa.RecordBatch, tag: int, tags: dict[str, None]) -> Iterator[tuple[int, pa.RecordBatch]]:
    """The rows of each piece, all in one for a wide table; their tags are added to `tags`."""
    if batch.num_rows == 0:
        return
    if tag < 0:
        yield 0, batch
        return
    coded = pc.dictionary_encode(batch.column(tag), null_encoding="encode")
    names = ["" if name is None else str(name) for name in coded.dictionary.to_pylist()]
    tags.update(dict.fromkeys(filter(None, names)))
    of_kind = np.array([piece_of(name) for name in names], dtype=np.uint8)  # small: sorted fast
    piece = of_kind[coded.indices.to_numpy(zero_copy_only=False)]
    order = np.argsort(piece, kind="stable")
    ordered, cuts = batch.take(pa.array(order)), np.searchsorted(piece[order], np.arange(PIECES + 1))
    for k in np.unique(piece):
        yield int(k), ordered.slice(cuts[k], cuts[k + 1] - cuts[k])
