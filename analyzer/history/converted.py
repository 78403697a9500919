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
from collections.abc import Collection
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pyarrow import csv

from analyzer.history.files import ends_of
from analyzer.history.parquet import PIECES, ParquetTable, piece_of
from analyzer.history.sheet import Sheet, read_through, reading
from analyzer.history.table import trimmed
from identification.errors import InputError

BATCH_ROWS = 500_000
"""Rows of a Parquet file that are handed on at a time."""
HELD_ROWS = 32_768
"""Rows of a file that are held before they are written: 64 files of 50 bytes a row hold 100 MB."""
DONE = "done.json"
"""What a copy says of itself; written last."""
NAMED = "converted-"


Said = dict[str, list[str]]
"""What a pass over an export found out: notes, and the tags of a long table in the order of their first rows."""


def converted(table: Sheet | ParquetTable, tag: int, place: Path) -> ParquetTable:
    """Stream a table into Parquet, or take up what an earlier process has streamed of the same.

    Parameters
    ----------
    table : Sheet or ParquetTable
        Text, or a long Parquet file, of which each loop's read would decode all.
    tag : int
        Column of the tags of a long table, -1 for a wide one.
    place : Path
        Where the files are laid.

    Raises
    ------
    InputError
        The disk has no room, or the text cannot be read.
    """
    mark = hashlib.blake2b(ends_of(table.path), digest_size=16)
    mark.update(repr((table.path.name, table, tag, version("loop-triage"))).encode())
    folder = place / f"{NAMED}{mark.hexdigest()}"
    done = _said(folder) or _laid(table, tag, folder)
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
    """Whether a directory of copies holds a whole one."""
    return any(place.glob(f"{NAMED}*/{DONE}"))


def forget_halves(place: Path) -> None:
    """Remove what a process that died left half done in a directory of copies."""
    for left in place.iterdir():
        if left.is_dir() and not (left / DONE).exists():
            shutil.rmtree(left, ignore_errors=True)


def _said(folder: Path) -> Said | None:
    """What a whole copy says of itself; None where there is none, or a file of it lost its end with the power."""
    try:
        found = json.loads((folder / DONE).read_text(encoding="utf-8"))
        for path in folder.glob("*.parquet"):
            pq.read_metadata(path)
        return {"notes": [*found["notes"]], "tags": [*found["tags"]]}
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError):
        return None


def _laid(table: Sheet | ParquetTable, tag: int, folder: Path) -> Said:
    """Lay a copy into a folder, which is there once it is whole."""
    room = table.path.stat().st_size * (1 if isinstance(table, Sheet) else 4)
    if shutil.disk_usage(folder.parent).free < room:
        seen = f"{table.path}: no room for a copy of {room / 1e9:.1f} GB in {folder.parent}"
        raise InputError(seen, "free disk", "make room")
    made = Path(tempfile.mkdtemp(prefix=NAMED, dir=folder.parent))
    once = partial(_pass, tag, made)
    tags, notes = read_through(table, once) if isinstance(table, Sheet) else (_parted(table, tag, made), [])
    done = {"notes": notes, "tags": tags}
    (made / DONE).write_text(json.dumps(done), encoding="utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    os.replace(made, folder)
    return done


def _pass(tag: int, folder: Path, sheet: Sheet, texts: Collection[int]) -> tuple[int, int, list[str]]:
    """How many lines of a sheet were rows and how many were left out, and the tags."""
    for left in folder.glob("*.parquet"):  # of a pass that was begun anew
        left.unlink()
    left_out: list[int] = []
    stream = _Stream(folder, tag)
    with csv.open_csv(sheet.path, **reading(sheet, left_out, {*texts, tag} - {-1})) as reader:
        for batch in reader:
            stream.take([trimmed(a, sheet.unquoted) for a in batch.columns])
    stream.close()
    return stream.rows, len(left_out), list(stream.tags)


def _parted(table: ParquetTable, tag: int, folder: Path) -> list[str]:
    """The tags of a table, its rows laid into a folder, dictionaries decoded: their batches are not of one type."""
    stream = _Stream(folder, tag)
    with pq.ParquetFile(table.path) as file:
        for batch in file.iter_batches(batch_size=BATCH_ROWS):
            kinds = (pa.types.is_dictionary(a.type) for a in batch.columns)
            stream.take(
                [a.dictionary_decode() if d else a for a, d in zip(batch.columns, kinds, strict=True)]
            )
    stream.close()
    return list(stream.tags)


class _Stream:
    """One pass over an export: files, rows, and the tags in the order in which they are met."""

    def __init__(self, folder: Path, tag: int) -> None:
        self.folder, self.tag, self.rows = folder, tag, 0
        self.tags: dict[str, None] = {}
        self._held: dict[int, list[pa.RecordBatch]] = {}
        self._writers: dict[int, pq.ParquetWriter] = {}

    def take(self, columns: list[pa.Array]) -> None:
        """Hand rows, their columns named by position, to their files."""
        batch = pa.RecordBatch.from_arrays(columns, names=[str(i) for i in range(len(columns))])
        if batch.num_rows == 0:
            return
        self.rows += batch.num_rows
        if self.tag < 0:
            self._put(0, batch)
            return
        coded = pc.dictionary_encode(batch.column(self.tag), null_encoding="encode")
        names = ["" if name is None else str(name) for name in coded.dictionary.to_pylist()]
        self.tags.update(dict.fromkeys(filter(None, names)))
        of_kind = np.array([piece_of(name) for name in names], dtype=np.uint8)  # small: sorted fast
        piece = of_kind[coded.indices.to_numpy(zero_copy_only=False)]
        order = np.argsort(piece, kind="stable")
        ordered, cuts = batch.take(pa.array(order)), np.searchsorted(piece[order], np.arange(PIECES + 1))
        for k in np.unique(piece):
            self._put(int(k), ordered.slice(cuts[k], cuts[k + 1] - cuts[k]))

    def _put(self, k: int, batch: pa.RecordBatch) -> None:
        held = self._held.setdefault(k, [])
        held.append(batch)
        if sum(part.num_rows for part in held) >= HELD_ROWS:
            self._write(k)

    def _write(self, k: int) -> None:
        table = pa.Table.from_batches(self._held.pop(k))
        if k not in self._writers:
            path = self.folder / f"{k:03d}.parquet"
            self._writers[k] = pq.ParquetWriter(path, table.schema, compression="snappy")
        self._writers[k].write_table(table.combine_chunks())

    def close(self) -> None:
        """Write what is held and close all files."""
        for k in list(self._held):
            self._write(k)
        for writer in self._writers.values():
            writer.close()
