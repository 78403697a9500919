"""The tables of a night: their list, and atomic reading, checking and writing of one as a file."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, cast

import pyarrow as pa
import pyarrow.parquet as pq

from analyzer import columns as declared
from analyzer.columns import Column, Kind, row_of
from analyzer.locations import content, is_passing, is_remote, is_whole, not_now
from analyzer.loop.decisions import Action
from analyzer.words.units import SECONDS
from identification.errors import InputError
from reports.whole_file import whole_file


@dataclass(frozen=True, slots=True)
class StoredTable:
    """A table of a night, stored in STORE/name/NIGHT.parquet.

    columns, those declared for its rows, none if they are declared here (trends) or in the module that reads them
    (`waves`, `moves`); in_pieces, whether chunks write it during a night; kept, whether a finished night has it;
    bulky, whether it may be deleted before its night.
    """

    name: str
    columns: Sequence[Column] = ()
    in_pieces: bool = True
    kept: bool = True
    bulky: bool = False


OF_A_NIGHT = (
    StoredTable("nights", declared.NIGHTS),
    StoredTable("hours", declared.HOURS, bulky=True),
    StoredTable("trends", bulky=True),
    StoredTable("waves", kept=False),
    StoredTable("moves", kept=False),
    StoredTable("groups", declared.GROUPS, in_pieces=False),
    StoredTable("beliefs", declared.BELIEFS, in_pieces=False),
    StoredTable("explained", declared.EXPLAINED, in_pieces=False),
    StoredTable("compared", declared.SETTINGS),
)
"""All tables; deletion begins with the first, without which there is no night."""
KEPT = tuple(t for t in OF_A_NIGHT if t.kept)
TREND = ("time_s", *(f"{signal}_{end}" for signal in ("sp", "pv", "op") for end in ("min", "max")), "bad")
"""Columns of a table of trends besides `loop`, all numeric."""
SHADED = ("manual", "frozen")
"""Further columns, which earlier versions did not store."""
DECLARED = {c.name: c for table in reversed(OF_A_NIGHT) for c in table.columns}
"""Every possible column of a table of results, by name, except those of trends."""
WITH_JSON = *declared.NIGHTS, *declared.GROUPS, *declared.BELIEFS
PARSED = frozenset(c.name for c in WITH_JSON if c.kind is Kind.JSON)
"""Columns of JSON; whole stored pages are excluded, because those of another version are skipped."""
WORDS: Mapping[str, Sequence[str]] = {"action": tuple(Action), "ti_unit": (*SECONDS, "repeats/min")}
"""Columns with one of a few words."""
ROWS_AT_ONCE = 65_536
"""Rows of a table per part."""
WRITTEN = "a table that 'triage run' wrote"
REMEDY = (
    "'triage store check' names all such: restore them from a backup, or delete them and run the night again"
)


class DamagedError(InputError):
    """A table of the store has contents that no run wrote, or a piece of a run is missing."""


def rows_table(rows: Sequence[Mapping[str, Any]], columns: Sequence[Column]) -> pa.Table:
    """Rows as a table with the declared types of its columns, empty if unknown. Raises ValueError for a cell of an
    undeclared column."""
    schema = pa.schema([(c.name, pa.float64() if c.is_number else pa.string()) for c in columns])
    return pa.Table.from_pylist([row_of(row, columns) for row in rows], schema=schema)


def rows_of_loops(table: pa.Table, loops: Collection[str], others: bool = False) -> pa.Table:
    """Its rows of some loops, or of all others."""
    import pyarrow.compute as pc

    held = pc.cast(table.column("loop"), pa.string())
    wanted = pc.is_in(held, value_set=pa.array(list(loops), pa.string()))
    return table.filter(pc.invert(wanted) if others else wanted)


def write_table(rows: pa.Table | Iterable[pa.Table], path: Path) -> bool:
    """Write a table, or its parts one after another, so that a reader sees all of it or nothing; return whether there
    were any rows."""
    parts = iter((rows,) if isinstance(rows, pa.Table) else rows)
    first = next(parts, None)
    if first is None:
        return False
    if is_remote(path):  # from memory: nothing remains on this machine, however the process ends
        remote, sink = cast(Any, path), pa.BufferOutputStream()
        _write_parts(chain((first,), parts), first.schema, sink)
        remote.fs.pipe_file(remote.path, sink.getvalue().to_pybytes())
        return True
    with whole_file(path, kept=True) as temporary:
        _write_parts(chain((first,), parts), first.schema, temporary)
    return True


def _write_parts(parts: Iterable[pa.Table], schema: pa.Schema, sink: Any) -> None:
    with pq.ParquetWriter(sink, schema, compression="zstd", write_page_checksum=True) as file:
        for part in parts:
            file.write_table(part)


FURTHER_TABLES = b"beside"
"""Metadata of a chunk's piece of the table of nights: the chunk's other pieces."""


def naming(table: pa.Table, others: Iterable[str]) -> pa.Table:
    """A chunk's piece of the table of nights, with the names of the chunk's other pieces."""
    return marked(table, FURTHER_TABLES, " ".join(others))


def marked(table: pa.Table, key: bytes, text: str) -> pa.Table:
    """A table with a text among its metadata."""
    return table.replace_schema_metadata({key: text.encode()})


def further_tables(path: Path) -> list[str]:
    """The tables of which a chunk has written further pieces; errors as of `read_stored`."""
    return mark_of(path, FURTHER_TABLES).split()


def mark_of(path: Path, key: bytes) -> str:
    """A text among the metadata of a stored table, '' if there is none; errors as of `read_stored`."""
    with _for_parquet(path) as held:
        return (pq.read_schema(held).metadata or {}).get(key, b"").decode()


def read_stored(
    path: Path, columns: Sequence[str] | None = None, loops: Collection[str] | None = None
) -> pa.Table:
    """A table of the store, or some of its columns, of some loops or of all. Raises FileNotFoundError where there is
    none; DamagedError where Parquet finds damage, or there are other columns than results have; NotNowError where it
    cannot be read now."""
    wanted = list(columns) if columns else None
    with _for_parquet(path) as held, pq.ParquetFile(held, page_checksum_verification=True) as file:
        table = file.read(columns=wanted) if loops is None else _of_loops(file, wanted, loops)
    _require_right(path, table, wanted)
    return table


def stored_parts(path: Path, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
    """The same in parts with few rows in memory; errors as of `read_stored`."""
    wanted = list(columns) if columns else None
    with _for_parquet(path) as held, pq.ParquetFile(held, page_checksum_verification=True) as file:
        for group in range(file.num_row_groups):
            for batch in file.iter_batches(ROWS_AT_ONCE, row_groups=[group], columns=wanted):
                table = pa.Table.from_batches([batch])
                _require_right(path, table, wanted)
                yield table


def _of_loops(file: pq.ParquetFile, columns: list[str] | None, loops: Collection[str]) -> pa.Table:
    """Rows of some loops; parts of the file without them are not read."""
    names = file.schema_arrow.names
    if "loop" not in names:
        return file.read(columns=columns)  # which raises
    requested = [name for name in names if columns is None or name in columns]
    at, found = names.index("loop"), [file.schema_arrow.empty_table()]
    first, last = min(loops, default=""), max(loops, default="")
    for group in range(file.num_row_groups):
        ends = file.metadata.row_group(group).column(at).statistics
        known = ends is not None and ends.has_min_max and isinstance(ends.min, str)
        near = not known or (ends.min <= last and ends.max >= first)
        if near and rows_of_loops(file.read_row_group(group, columns=["loop"]), loops).num_rows:
            found.append(rows_of_loops(file.read_row_group(group, columns=[*requested, "loop"]), loops))
    return pa.concat_tables([t.select(requested) for t in found]).unify_dictionaries()


def _require_right(path: Path, table: pa.Table, wanted: list[str] | None) -> None:
    _require_declared(path, table.schema, wanted)
    _require_meant(path, table)


def stored_names(path: Path) -> list[str]:
    """Names of the columns of a table of the store; errors as of `read_stored`."""
    with _for_parquet(path) as held, pq.ParquetFile(held, page_checksum_verification=True) as file:
        schema = file.schema_arrow
    _require_declared(path, schema, None)
    return list(schema.names)


@contextmanager
def _for_parquet(path: Path) -> Iterator[Any]:
    """A path for Parquet's reader: itself, or all bytes of an object of shared storage."""
    try:
        if is_remote(path):
            yield pa.BufferReader(content(path))
        else:
            yield path
    except FileNotFoundError:
        raise
    except Exception as error:
        if is_passing(error):
            raise not_now(path, error) from error
        if not isinstance(error, pa.ArrowException | OSError | ValueError):
            raise
        if is_remote(path) and not is_whole(path):
            raise not_now(path, error) from error
        seen = " ".join(str(error).split())[:100] or type(error).__name__
        raise DamagedError(f"{path}: damaged ({seen})", WRITTEN, REMEDY) from error


def no_column(path: Path, column: str) -> DamagedError:
    """Error for a table without a column that all of its kind have."""
    return DamagedError(f"{path}: no column {column}", WRITTEN, REMEDY)


def _require_declared(path: Path, schema: pa.Schema, wanted: list[str] | None) -> None:
    """Raise DamagedError if a table has no loops, or a declared column has another type."""
    if (wanted is None or "loop" in wanted) and "loop" not in schema.names:
        raise no_column(path, "loop")
    for field in schema:
        column = DECLARED.get(field.name)
        if column is None and field.name not in (*TREND, *SHADED):
            continue
        numbers = column is None or column.is_number
        if not _holds(field.type, numbers):
            raise _of_another_kind(path, field.name, str(field.type), "numbers" if numbers else "text")


def _of_another_kind(path: Path, column: str, held: str, wanted: str) -> DamagedError:
    return DamagedError(f"{path}: damaged (column {column} holds {held})", wanted, REMEDY)


def _require_meant(path: Path, table: pa.Table) -> None:
    """Raise DamagedError if a column of JSON, or of a few words, has other text."""
    for name in (PARSED | WORDS.keys()).intersection(table.column_names):
        known = WORDS.get(name)
        for text in table.column(name).unique().to_pylist():
            if text and not (_is_json(text) if known is None else text in known):
                wanted = "JSON" if known is None else f"one of {', '.join(known)}"
                raise _of_another_kind(path, name, repr(text[:40]), wanted)


def _is_json(text: str) -> bool:
    try:
        return isinstance(json.loads(text), list | dict)
    except (ValueError, RecursionError):
        return False


def _holds(kind: pa.DataType, numbers: bool) -> bool:
    if pa.types.is_null(kind):
        return True
    if numbers:
        return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind))
    own = kind.value_type if pa.types.is_dictionary(kind) else kind
    return bool(pa.types.is_string(own) or pa.types.is_large_string(own))
