"""A table of the store as a file: read and checked, or one line on what is wrong with it; written whole."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from analyzer.columns import Kind
from analyzer.columns import BY_NAME, EXPLAINED, GROUPS, HOURS, SETTINGS
from analyzer.loop.decisions import Action
from analyzer.places import is_remote
from analyzer.words.units import SECONDS
from identification.errors import InputError
from reports.whole_file import whole_file

DECLARED = {**{c.name: c for c in (*HOURS, *EXPLAINED, *GROUPS, *SETTINGS)}, **BY_NAME}
"""Every column that a table of results may have, by name, but for those of trends."""
PARSED = frozenset(c.name for c in (*BY_NAME.values(), *GROUPS) if c.kind is Kind.JSON)
"""Columns that hold JSON; pages that are kept whole are not among them: those of another version are passed over."""
WORDS: Mapping[str, Sequence[str]] = {"action": tuple(Action), "ti_unit": (*SECONDS, "repeats/min")}
"""Columns that hold one of a few words."""
TREND = ("time_s", *(f"{signal}_{end}" for signal in ("sp", "pv", "op") for end in ("min", "max")), "bad")
"""Columns of a table of trends beside `loop`, all of them numbers."""
REMEDY = (
    "'triage store check' names all such: restore them from a backup, or delete them and run the night anew"
)


def write_table(table: pa.Table, path: Path) -> None:
    """Write a table so that a reader sees all of it or nothing."""
    with whole_file(path, kept=True) as temporary:
        pq.write_table(table, temporary, compression="zstd", write_page_checksum=True)


def read_stored(
    path: Path, columns: Sequence[str] | None = None, filters: list[tuple[str, str, Any]] | None = None
) -> pa.Table:
    """A table of the store, or some of its columns and rows.

    Raises
    ------
    FileNotFoundError
        There is none.
    InputError
        The file is damaged, or holds other columns than results have.
    """
    wanted = list(columns) if columns else None
    try:
        with _opened(path) as held:
            if filters is not None:
                table = pq.read_table(held, columns=wanted, filters=filters, page_checksum_verification=True)
            else:  # read_table would import pandas, which takes longer than the rest
                with pq.ParquetFile(held, page_checksum_verification=True) as file:
                    table = file.read(columns=wanted)
    except FileNotFoundError:
        raise
    except (pa.ArrowException, OSError, ValueError) as error:
        raise _damaged(path, error) from error
    _require_declared(path, table.schema, wanted)
    _require_meant(path, table)
    return table


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """A path as Parquet's reader takes it: itself, or an open object of shared storage."""
    if not is_remote(path):
        yield path
        return
    with path.open("rb") as held:
        yield held


def stored_names(path: Path) -> list[str]:
    """Names of the columns of a table of the store; errors as of `read_stored`."""
    try:
        with _opened(path) as held, pq.ParquetFile(held, page_checksum_verification=True) as file:
            schema = file.schema_arrow
    except FileNotFoundError:
        raise
    except (pa.ArrowException, OSError, ValueError) as error:
        raise _damaged(path, error) from error
    _require_declared(path, schema, None)
    return list(schema.names)


def _damaged(path: Path, error: Exception) -> InputError:
    seen = " ".join(str(error).split())[:100] or type(error).__name__
    return InputError(f"{path}: damaged ({seen})", "a table that 'triage run' wrote", REMEDY)


def _require_declared(path: Path, schema: pa.Schema, wanted: list[str] | None) -> None:
    """Raise InputError where a table has no loops, or a declared column is of another kind."""
    if (wanted is None or "loop" in wanted) and "loop" not in schema.names:
        raise InputError(f"{path}: no column loop", "a table that 'triage run' wrote", REMEDY)
    for field in schema:
        declared = DECLARED.get(field.name)
        if declared is None and field.name not in TREND:
            continue
        numbers = declared is None or declared.is_number
        if not _holds(field.type, numbers):
            kind = "numbers" if numbers else "text"
            raise _of_another_kind(path, field.name, str(field.type), kind)


def _of_another_kind(path: Path, column: str, held: str, wanted: str) -> InputError:
    return InputError(f"{path}: damaged (column {column} holds {held})", wanted, REMEDY)


def _require_meant(path: Path, table: pa.Table) -> None:
    """Raise InputError where a column of JSON, or of a few words, holds other text."""
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
