"""Exports too big to be read for each loop anew: streamed once into Parquet by loop, in bounded memory.

A wide table becomes one file, of which each loop reads its columns. Of a long one, whose tags may be interleaved line
by line, the rows go into some dozens of files by tag, so that a loop's tags are read from a few of them.

A copy is laid whole or not at all, so that a run that goes on takes it up: it is known by the file's name, size and
both ends, by how it was read, and by this program's version.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
import zlib
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pyarrow import csv

from analyzer.history.files import ends_of
from analyzer.history.parquet import ParquetTable
from analyzer.history.sheet import Sheet, as_far_as_numbers_go, is_swallowed, quotes_told, reading, unreadable
from analyzer.history.table import HEAD_ROWS, Table, trimmed
from identification.errors import InputError

BUCKETS = 64
"""Files of a long table; ours: of 4,500 tags each holds seventy, and a loop's four lie in a sixteenth of all."""
BATCH_ROWS = 500_000
"""Rows of a Parquet file that are handed on at a time."""
HELD_ROWS = 32_768
"""Rows of a file that are held before they are written: 64 files of 50 bytes a row hold 100 MB."""
DONE = "done.json"
"""What a copy says of itself; written last."""
NAMED = "converted-"


@dataclass(frozen=True, slots=True, kw_only=True)
class Converted(Table):
    """A table as it was streamed.

    `folder` holds one file, or of a long table those in which a row is by its tag; with `unquoted` quotes are no
    quotes.
    """

    folder: Path
    unquoted: bool = False

    def head(self, columns: Sequence[int]) -> list[pa.Array]:
        with pq.ParquetFile(self._largest()) as file:
            batch = next(file.iter_batches(batch_size=HEAD_ROWS, columns=[str(i) for i in columns]))
        return [trimmed(batch.column(str(i)), self.unquoted) for i in columns]

    def read(self, columns: Sequence[int], where: tuple[int, Sequence[str]] | None = None) -> list[pa.Array]:
        """Whole columns, or the rows where the tag's column holds one of some texts.

        Without `where`, of a long table the rows of one file stand for all: they are of all times.
        """
        if where is None:
            return self._columns(self._largest(), columns)
        files = [_file(self.folder, k) for k in sorted({_bucket(tag) for tag in where[1]})]
        parts = [self._columns(path, [*columns, where[0]]) for path in files if path.exists()]
        wanted = pa.array(where[1], pa.string())
        kept = [[a.filter(pc.is_in(part[-1], value_set=wanted)) for a in part[:-1]] for part in parts]
        empty = [pa.array([], self.types[i]) for i in columns]
        return [pa.concat_arrays(list(same)) for same in zip(*kept, strict=True)] if kept else empty

    def each(self, columns: Sequence[int]) -> Iterator[list[pa.Array]]:
        return (self._columns(path, columns) for path in sorted(self.folder.glob("*.parquet")))

    def _columns(self, path: Path, columns: Sequence[int]) -> list[pa.Array]:
        with pq.ParquetFile(path) as file:
            table = file.read(columns=sorted({str(i) for i in columns}))
        return [trimmed(table.column(str(i)), self.unquoted) for i in columns]

    def _largest(self) -> Path:
        return max(self.folder.glob("*.parquet"), key=lambda p: (p.stat().st_size, p.name))


def _file(folder: Path, k: int) -> Path:
    return folder / f"{k:03d}.parquet"


@lru_cache(maxsize=100_000)
def _bucket(tag: str) -> int:
    """The file of a tag: that of its loop, which is what stands before its last point, stroke or colon."""
    loop = tag[: max(tag.rfind(mark) for mark in "./:|")] or tag
    return zlib.crc32(loop.encode("utf-8")) % BUCKETS


def converted(sheet: Sheet, tag: int, place: Path) -> Converted:
    """Stream a sheet into Parquet, or take up what an earlier process has streamed of the same.

    Parameters
    ----------
    sheet : Sheet
    tag : int
        Column of the tags of a long table, -1 for a wide one.
    place : Path
        Where the files are laid.

    Raises
    ------
    InputError
        The disk has no room, or the text cannot be read.
    """
    written = sheet.encoding, sheet.delimiter, sheet.decimal, sheet.first_row, sheet.names
    how = (*written, sheet.as_written, tag)
    folder, done = _laid(place, sheet.path, sheet.bytes, how, partial(_streamed, sheet, tag))
    first = next(folder.glob("*.parquet"), None)
    if first is None:
        expected = "rows of as many columns as the header"
        raise InputError(f"{sheet.path}: no row", expected, "export it again")
    return Converted(
        sheet.path,
        sheet.names,
        tuple(pq.read_schema(first).types),
        (*sheet.found, *done.notes),
        sheet.decimal,
        sheet.first_row,
        done.tags,
        folder=folder,
        unquoted=done.unquoted,
    )


def converted_parquet(table: ParquetTable, tag: int, place: Path) -> Converted:
    """The same of a long Parquet file, of which each loop's read would decode all."""
    room = 4 * table.path.stat().st_size
    folder, done = _laid(place, table.path, room, (table.names, tag), partial(_parted, table, tag))
    return Converted(table.path, table.names, table.types, tags=done.tags, folder=folder)


def holds_copies(place: Path) -> bool:
    """Whether a directory of copies holds a whole one."""
    return any(place.glob(f"{NAMED}*/{DONE}"))


def forget_halves(place: Path) -> None:
    """Remove what a process that died left half done in a directory of copies."""
    for left in place.iterdir():
        if left.is_dir() and not (left / DONE).exists():
            shutil.rmtree(left, ignore_errors=True)


@dataclass(frozen=True, slots=True)
class Laid:
    """What a pass over an export found out: notes, the tags met in their order, and whether quotes were no quotes."""

    notes: tuple[str, ...] = ()
    tags: tuple[str, ...] = ()
    unquoted: bool = False


def _laid(
    place: Path, path: Path, room: int, how: tuple[object, ...], lay: Callable[[Path], Laid]
) -> tuple[Path, Laid]:
    """The folder of a copy of a file that is read so, and what it says of itself.

    Where there is none yet it is laid by `lay`, in `room` bytes.
    """
    mark = hashlib.blake2b(ends_of(path), digest_size=16)
    mark.update(repr((path.name, how, version("loop-triage"))).encode())
    folder = place / f"{NAMED}{mark.hexdigest()}"
    found = _said(folder)
    if found is not None:
        return folder, found
    if shutil.disk_usage(place).free < room:
        seen = f"{path}: no room for a copy of {room / 1e9:.1f} GB in {place}"
        raise InputError(seen, "free disk", "make room")
    made = Path(tempfile.mkdtemp(prefix=NAMED, dir=place))
    done = lay(made)
    (made / DONE).write_text(json.dumps(asdict(done)), encoding="utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    os.replace(made, folder)
    return folder, done


def _said(folder: Path) -> Laid | None:
    """What a whole copy says of itself; None where there is none, or a file of it lost its end with the power."""
    try:
        found = json.loads((folder / DONE).read_text(encoding="utf-8"))
        for path in folder.glob("*.parquet"):
            pq.read_metadata(path)
        return Laid(tuple(found["notes"]), tuple(found["tags"]), found["unquoted"])
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError):
        return None


def _streamed(sheet: Sheet, tag: int, folder: Path) -> Laid:
    """A sheet's rows laid into a folder."""
    once = partial(_pass, tag, folder)
    try:
        rows, done = as_far_as_numbers_go(sheet, once)
        if is_swallowed(sheet, rows):
            rows, done = as_far_as_numbers_go(replace(sheet, unquoted=True), once)
    except (UnicodeError, pa.ArrowInvalid) as error:
        raise unreadable(sheet.path, error) from error
    return done


def _pass(tag: int, folder: Path, sheet: Sheet, texts: Collection[int]) -> tuple[int, Laid]:
    """How many lines of a sheet were rows or were left out, and what else was found out."""
    for left in folder.glob("*.parquet"):  # of a pass that was begun anew
        left.unlink()
    left_out: list[int] = []
    stream = _Stream(folder, tag)
    as_text = {*texts, tag} - {-1}
    with csv.open_csv(sheet.path, **reading(sheet, left_out, as_text)) as reader:
        for batch in reader:
            stream.take(batch)
    stream.close()
    told = tuple(quotes_told(sheet.unquoted, len(left_out)))
    return stream.rows + len(left_out), Laid(told, tuple(stream.tags), sheet.unquoted)


def _parted(table: ParquetTable, tag: int, folder: Path) -> Laid:
    """A table's rows laid into a folder, dictionaries decoded: their batches are not of one type."""
    stream = _Stream(folder, tag)
    names = [str(i) for i in range(len(table.names))]
    with pq.ParquetFile(table.path) as file:
        for batch in file.iter_batches(batch_size=BATCH_ROWS):
            plain = [a.dictionary_decode() if pa.types.is_dictionary(a.type) else a for a in batch.columns]
            stream.take(pa.RecordBatch.from_arrays(plain, names=names))
    stream.close()
    return Laid((), tuple(stream.tags))


class _Stream:
    """One pass over an export: files, rows, and the tags in the order in which they are met."""

    def __init__(self, folder: Path, tag: int) -> None:
        self.folder, self.tag, self.rows = folder, tag, 0
        self.tags: dict[str, None] = {}
        self._held: dict[int, list[pa.RecordBatch]] = {}
        self._writers: dict[int, pq.ParquetWriter] = {}

    def take(self, batch: pa.RecordBatch) -> None:
        """Hand a batch's rows to their files."""
        if batch.num_rows == 0:
            return
        self.rows += batch.num_rows
        if self.tag < 0:
            self._put(0, batch)
            return
        coded = pc.dictionary_encode(batch.column(self.tag), null_encoding="encode")
        names = [str(name or "").strip(' \t"') for name in coded.dictionary.to_pylist()]
        self.tags.update(dict.fromkeys(filter(None, names)))
        of_kind = np.array([_bucket(name) for name in names], dtype=np.uint8)  # small: sorted fast
        bucket = of_kind[coded.indices.to_numpy(zero_copy_only=False)]
        order = np.argsort(bucket, kind="stable")
        ordered, cuts = batch.take(pa.array(order)), np.searchsorted(bucket[order], np.arange(BUCKETS + 1))
        for k in np.unique(bucket):
            self._put(int(k), ordered.slice(cuts[k], cuts[k + 1] - cuts[k]))

    def _put(self, k: int, batch: pa.RecordBatch) -> None:
        held = self._held.setdefault(k, [])
        held.append(batch)
        if sum(part.num_rows for part in held) >= HELD_ROWS:
            self._write(k)

    def _write(self, k: int) -> None:
        table = pa.Table.from_batches(self._held.pop(k))
        if k not in self._writers:
            self._writers[k] = pq.ParquetWriter(_file(self.folder, k), table.schema, compression="snappy")
        self._writers[k].write_table(table.combine_chunks())

    def close(self) -> None:
        """Write what is held and close all files."""
        for k in list(self._held):
            self._write(k)
        for writer in self._writers.values():
            writer.close()
