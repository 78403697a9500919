"""Results kept as Parquet: nights, hours, trends; written under a temporary name and renamed.

STORE/nights/NIGHT.parquet   one row a loop (docs/columns.md)
STORE/hours/NIGHT.parquet    one row a loop and hour
STORE/explained/NIGHT.parquet  one row a loop that was explained
STORE/compared/NIGHT.parquet  one row a loop for which settings were sought, of the newest night alone
STORE/trends/NIGHT.parquet   thinned trends, one row a loop and bucket
STORE/parts/NIGHT/...        the same in pieces while a night is being worked on; a resumed run reads them
STORE/notes.jsonl            what people wrote; STORE/store.json the version of the tables
"""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

import pyarrow as pa

from analyzer.store import version as store_version
from analyzer.columns import Column
from analyzer.columns import require_declared
from analyzer.places import is_remote, remove_tree
from analyzer.store.table import read_stored, stored_names, write_table
from identification.errors import InputError


def rows_table(rows: Sequence[Mapping[str, Any]], columns: Sequence[Column]) -> pa.Table:
    """Rows as a table with the types that its columns declare, empty where not known.

    Raises
    ------
    ValueError
        For a cell whose column is declared nowhere.
    """
    for row in rows:
        require_declared(row, columns)
    fields = [pa.field(c.name, pa.float64() if c.is_number else pa.string()) for c in columns]
    arrays = [pa.array([row.get(f.name) for row in rows], type=f.type) for f in fields]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


TABLES = ("nights", "hours", "trends", "groups", "explained", "compared")
"""Tables of a night."""


def is_night(name: str) -> bool:
    """Whether a name is that of a night: a date."""
    try:
        return name == date.fromisoformat(name).isoformat()
    except ValueError:
        return False


class Store:
    """A directory of results."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def nights(self) -> list[str]:
        """Names of the nights that are complete, oldest first; files of other names are nobody's nights."""
        return sorted(p.stem for p in (self.path / "nights").glob("*.parquet") if is_night(p.stem))

    def zone(self) -> str:
        """The plant's time zone as the latest night states it, UTC where none does."""
        name = self.nights()[-1:]
        if not name or "timezone" not in self.columns("nights", name[0]):
            return "UTC"
        stated = self.read("nights", name[0], ["timezone"]).column(0).to_pylist()
        return next((z for z in stated if z), "UTC")

    def require(self) -> str:
        """The latest night.

        Raises
        ------
        InputError
            Where the path is no store, is one of a newer version, or holds no complete night.
        """
        store_version.require_known(self.path)
        nights = self.nights()
        if not nights:
            empty = "nothing there" if is_remote(self.path) else "no such directory"
            seen = "no complete night in it" if self.path.exists() else empty
            raise InputError(f"{self.path}: {seen}", "a store", "run 'triage run EXPORT --store DIR' first")
        return nights[-1]

    def read(self, table: str, night: str, columns: Sequence[str] | None = None, **where: str) -> pa.Table:
        """One night of one table; `where` filters on equality (loop="...")."""
        filters = [(k, "=", v) for k, v in where.items()] or None
        try:
            return read_stored(self.path / table / f"{night}.parquet", columns, filters)
        except FileNotFoundError as error:
            known = ", ".join(self.nights()[-3:]) or "none"
            raise InputError(
                f"night {night} is not in {self.path}", f"one of {known}", "check --night"
            ) from error

    def columns(self, table: str, night: str) -> list[str]:
        """Names of the columns that one night of one table has.

        Raises
        ------
        InputError
            Where the store holds no such night.
        """
        try:
            return stored_names(self.path / table / f"{night}.parquet")
        except FileNotFoundError:
            return self.read(table, night).column_names

    def part(self, night: str, table: str, key: str) -> Path:
        """Where a piece of a night that is being worked on lies."""
        return self.path / "parts" / night / f"{table}-{key}.parquet"

    def parts(self, night: str, table: str) -> list[Path]:
        """Pieces of a night that are complete."""
        return sorted((self.path / "parts" / night).glob(f"{table}-*.parquet"))

    @property
    def run_file(self) -> Path:
        """Where the run whose pieces lie here is written down."""
        return self.path / "parts" / "run.json"

    def whole_chunks(self, night: str) -> list[str]:
        """Keys of the chunks whose last piece, that of the table of nights, is there."""
        return [p.stem.removeprefix("nights-") for p in self.parts(night, "nights")]

    def begun(self) -> list[str]:
        """Nights that were begun and not finished."""
        return sorted(p.name for p in (self.path / "parts").glob("*") if p.is_dir())

    def read_parts(self, night: str, table: str, keys: Sequence[str]) -> pa.Table | None:
        """The pieces of one table of a night that some chunks have written, None where there are none."""
        paths = [self.part(night, table, key) for key in keys]
        found = [read_stored(p) for p in paths if p.exists()]
        return pa.concat_tables(found) if found else None

    def read_if_there(self, table: str, night: str) -> pa.Table | None:
        """One night of one table, None where the store has none."""
        return self.read(table, night) if (self.path / table / f"{night}.parquet").exists() else None

    def write(self, table: str, night: str, rows: pa.Table | None) -> None:
        """Keep one night of one table; where there are no rows, keep none."""
        path = self.path / table / f"{night}.parquet"
        if rows is None:
            path.unlink(missing_ok=True)
        else:
            write_table(rows, path)

    def set_aside_damaged(self, night: str) -> list[str]:
        """Rename the tables of a night that cannot be read, so that it can be written anew; sentences on them."""
        said = []
        for table in TABLES:
            path = self.path / table / f"{night}.parquet"
            try:
                self.read_if_there(table, night)
            except InputError as error:
                aside = path.with_name(f"{path.name}.{secrets.token_hex(4)}.damaged")
                path.rename(aside)
                said.append(f"{error.seen}; set aside as {aside.name}, and written anew")
        return said

    def forget_explained(self, night: str, loops: Sequence[str] | None) -> None:
        """Drop the explanations of some loops of a night, of all where None: their records have been replaced."""
        table = self.read_if_there("explained", night)
        if table is None:
            return
        gone = set(table.column("loop").to_pylist() if loops is None else loops)
        stay = table.filter(pa.array([name not in gone for name in table.column("loop").to_pylist()]))
        self.write("explained", night, stay if stay.num_rows else None)

    def forget_compared(self) -> None:
        """Drop the settings compared of all nights but the newest: they are for tomorrow, and large."""
        newest = self.nights()[-1:]
        for path in (self.path / "compared").glob("*.parquet"):
            if is_night(path.stem) and path.stem not in newest:
                path.unlink(missing_ok=True)

    def drop_parts(self) -> None:
        """Forget all pieces, and the run that they are of."""
        remove_tree(self.path / "parts")
