"""Columns are declared once, and an undeclared column is stored nowhere."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from importlib.resources import files
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from analyzer.columns import EXPLAINED, HOURS, NIGHTS, Column, names, row_of
from analyzer.config import Config
from analyzer.night.finish import finish_night
from analyzer.pages.words import page_columns as page_columns
from analyzer.store.store import Store
from analyzer.store.table import rows_table, write_table

ROOT = Path(__file__).resolve().parents[3]
TABLES = (NIGHTS, HOURS, EXPLAINED)
UNITS = {
    "pct": ("%", "% of span", "% of OP"),
    "per_h": ("1/h", "%/h"),
    "h": ("h",),
    "s": ("s", "s since 1970-01-01 UTC"),
    "pct_per_s": ("% PV per (% OP s)",),
}
"""Units for the endings of names (CONVENTIONS.md)."""


def test_a_row_with_an_undeclared_column_is_an_error():
    """A value of an undeclared column raises an error that names it, in rows and in tables of the store."""
    with pytest.raises(ValueError, match="stickband_mm"):
        row_of({"loop": "FIC101", "stickband_mm": 2.0})
    with pytest.raises(ValueError, match="stickband_mm"):
        rows_table([{"loop": "FIC101", "stickband_mm": 2.0}], NIGHTS)


def test_a_row_has_every_column_and_no_unknown_one():
    """A row made of one value has all columns in the order of the table, and None in all others."""
    row = row_of({"loop": "FIC101"}, HOURS)
    assert tuple(row) == names(HOURS)
    assert [value for value in row.values() if value is not None] == ["FIC101"]


@pytest.mark.parametrize("table", TABLES)
def test_the_store_has_the_declared_types(table: tuple[Column, ...]):
    """Numbers are 64-bit floats and all other columns are text, also if they are empty."""
    schema = rows_table([{"loop": "FIC101"}], table).schema
    assert [str(field.type) for field in schema] == ["double" if c.is_number else "string" for c in table]


@pytest.mark.parametrize("table", TABLES)
def test_names_are_unique_and_meanings_are_sentences(table: tuple[Column, ...]):
    """Each name occurs once in a table, and each meaning is one sentence with a full stop."""
    assert len(set(names(table))) == len(table)
    for column in table:
        assert re.fullmatch(r"\S[^.]*(\.[^. ][^.]*)*\.", column.meaning), column.meaning
        assert column.title
        assert "|" not in column.title


def test_a_name_that_ends_in_a_unit_has_that_unit():
    """The unit of each number is that of the ending of its name, according to CONVENTIONS.md."""
    for column in (*NIGHTS, *HOURS):
        ends = [e for e in sorted(UNITS, key=len, reverse=True) if column.name.endswith(f"_{e}")]
        if column.is_number and ends:
            assert column.unit in UNITS[ends[0]], column.name


def test_the_documentation_equals_the_table():
    """docs/columns.md equals the output of `python docs/columns.py` byte by byte."""
    command = [sys.executable, "docs/columns.py"]
    printed = subprocess.run(command, capture_output=True, cwd=ROOT, check=True).stdout
    assert (ROOT / "docs" / "columns.md").read_bytes() == printed


def test_a_night_of_another_version_is_joined(tmp_path: Path):
    """Rows of a version with another column, and without one of this version, are kept together with those of a new
    loop.
    """
    store, night = Store(tmp_path), "2026-03-02"
    old = pa.table({"loop": ["OLD"], "status": ["ok"], "cause": ["none"], "stickband_mm": [2.0]})
    write_table(old, tmp_path / "nights" / f"{night}.parquet")
    new = rows_table([{"loop": "NEW", "status": "ok"}], NIGHTS)
    write_table(new, store.part(night, "nights", "a"))
    finish_night(store, night, ["NEW"], Config(), ["a"])
    found = pq.read_table(tmp_path / "nights" / f"{night}.parquet")
    assert found.column_names == list(names(NIGHTS))
    assert found.column("loop").to_pylist() == ["NEW", "OLD"]


def test_the_tables_of_pages_name_existing_columns() -> None:
    """Each table of tables.toml has columns of the store or its own columns, each once."""
    stated = tomllib.loads((files("analyzer.pages") / "tables.toml").read_text("utf-8"))
    for table in stated:
        keys = [column.key for column in page_columns(table)]
        assert len(keys) == len(set(keys)), table
