"""Results stored as Parquet, one file per night and table; written under a temporary name and renamed.

STORE/nights/NIGHT.parquet   one row per loop (docs/columns.md)
STORE/hours/NIGHT.parquet    one row per loop and hour
STORE/groups/NIGHT.parquet   one row per loop and group
STORE/beliefs/NIGHT.parquet  one row per loop: joint result of this night and earlier ones
STORE/explained/NIGHT.parquet  one row per explained loop
STORE/compared/NIGHT.parquet  one row per loop with compared settings, of the newest night only
STORE/trends/NIGHT.parquet   decimated trends, one row per loop and bucket
STORE/parts/NIGHT/...        the same in pieces during a run; a resumed run reads them
STORE/notes.jsonl            users' notes; STORE/store.json the version of the tables
"""

from __future__ import annotations

import contextlib
import json
import secrets
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import nullcontext
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa

from analyzer.columns import BELIEVED, NIGHTS, REPLACED_BY_BELIEF
from analyzer.locations import (
    afresh,
    content,
    each,
    is_passing,
    is_remote,
    not_now,
    refusals_as_errors,
    remove_tree,
)
from analyzer.store.table import (
    KEPT,
    DamagedError,
    further_tables,
    read_stored,
    rows_of_loops,
    rows_table,
    stored_names,
    stored_parts,
    write_table,
)
from identification.errors import InputError
from reports.whole_file import whole_file

SCHEMA = 2
"""Version of the tables. 1: no lanes, no half-cycles; a store without a version has it. 2: every declared column."""
VERSION_FILE = "store.json"
"""Name within the store."""
MAKE_ONE = "run 'triage run EXPORT --store DIR' first"
OWN = frozenset({"parts", "run.lock", "run.owner.json", "notes.jsonl", "lost+found"})
"""Allowed contents of a new store, besides names that begin with a point."""
GO_ON = "continue with the same command and --resume"
"""Advice for incomplete pieces of a night."""


def is_night(name: str) -> bool:
    """Whether a name is that of a night, which is a date."""
    try:
        return name == date.fromisoformat(name).isoformat()
    except ValueError:
        return False


def listed(folder: Path) -> list[Path]:
    """Contents of a folder, empty if there is none. Raises NotNowError where it cannot be read."""
    try:
        return list(afresh(folder).iterdir())
    except (FileNotFoundError, NotADirectoryError):
        return []
    except Exception as error:
        if not is_passing(error):
            raise
        raise not_now(folder, error) from error


def is_store(path: Path) -> bool:
    """Whether a folder is a store: it has a version, or nights from before versions existed."""
    return (path / VERSION_FILE).exists() or (path / "nights").is_dir()


def require_place(path: Path) -> None:
    """Raise InputError where a store cannot be made at a path: it is a file, or a folder with other contents."""
    if not is_remote(path) and path.exists() and not path.is_dir():
        raise InputError(f"--store {path}: a file", "a folder for the results, or none yet", "give a folder")
    others = sorted(p.name for p in listed(path) if p.name not in OWN and p.name[:1] != ".")
    if others and not is_store(path):
        more = f" and {len(others) - 3} more" if len(others) > 3 else ""
        seen = f"--store {path}: a folder that holds {', '.join(others[:3])}{more} and is no store"
        raise InputError(seen, "a store, an empty folder, or none yet", "give another folder")


class Store:
    """A directory of results."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def file(self, table: str, night: str) -> Path:
        """Path of one night of one table."""
        return self.path / table / f"{night}.parquet"

    def files(self, table: str) -> list[Path]:
        """Files of a table's nights; files with other names are ignored."""
        return sorted(p for p in listed(self.path / table) if p.suffix == ".parquet" and is_night(p.stem))

    def nights(self) -> list[str]:
        """Names of the nights that are complete, oldest first."""
        return [p.stem for p in self.files("nights")]

    def zone(self) -> str:
        """The plant's time zone as stated in the latest night, UTC without one."""
        return self.stated_zone(self.nights()[-1:]) or "UTC"

    def stated_zone(self, nights: Sequence[str]) -> str | None:
        """The time zone stated by the first of some nights, None without one."""
        if not nights or "timezone" not in self.columns("nights", nights[0]):
            return None
        stated = self.read("nights", nights[0], ["timezone"]).column(0).to_pylist()
        return next((z for z in stated if z), None)

    def require(self) -> str:
        """The latest night. Raises InputError where the path is no store, or a store of a newer version, or has no
        complete night."""
        self.require_known()
        nights = self.nights()
        if not nights:
            empty = "nothing there" if is_remote(self.path) else "no such directory"
            seen = "no complete night in it" if self.path.exists() else empty
            raise InputError(f"{self.path}: {seen}", "a store", MAKE_ONE)
        return nights[-1]

    def read(self, table: str, night: str, columns: Sequence[str] | None = None) -> pa.Table:
        """One night of one table, or some of its columns."""
        found = self.read_if_there(table, night, columns)
        if found is None:
            known = ", ".join(self.nights()[-3:]) or "none"
            raise InputError(f"night {night} is not in {self.path}", f"one of {known}", "check --night")
        return found

    def columns(self, table: str, night: str) -> list[str]:
        """Names of the columns of one night of one table. Raises InputError where the store has no such night."""
        try:
            return stored_names(self.file(table, night))
        except FileNotFoundError:
            return self.read(table, night).column_names

    def rows(
        self, table: str, night: str, columns: Sequence[str], loops: Collection[str] | None = None
    ) -> list[dict[str, Any]]:
        """Rows of one night, of some loops or of all, as reported: in the table of nights the columns based on all
        nights come from beliefs, for loops that have some. Unknown columns are None."""
        belief_columns = [c.name for c in (*REPLACED_BY_BELIEF, *BELIEVED) if c.name in columns]
        if table != "nights" or not belief_columns or not self.file("beliefs", night).exists():
            return self.own_rows(table, night, columns, loops)
        wanted = ["loop", "cause", *(c for c in belief_columns if c != "cause")]
        beliefs = self.own_rows("beliefs", night, wanted)
        by_loop = {r["loop"]: {c: r[c] for c in belief_columns} for r in beliefs if r["cause"] is not None}
        alone = self.own_rows(table, night, [*columns, "loop"], loops)
        rows = [row | by_loop.get(row["loop"], {}) for row in alone]
        return [{c: row[c] for c in columns} for row in rows]

    def own_rows(
        self, table: str, night: str, columns: Sequence[str], loops: Collection[str] | None = None
    ) -> list[dict[str, Any]]:
        """The same from the night alone."""
        names = set(self.columns(table, night))
        found = read_stored(self.file(table, night), [c for c in columns if c in names], loops)
        return [{**dict.fromkeys(columns), **row} for row in found.to_pylist()]

    def read_if_there(self, table: str, night: str, columns: Sequence[str] | None = None) -> pa.Table | None:
        """The same, None where the store has none."""
        try:
            return read_stored(self.file(table, night), columns)
        except FileNotFoundError:
            return None

    def parts_if_there(self, table: str, night: str) -> Iterator[pa.Table]:
        """One night of one table in parts, empty if the store has none."""
        with contextlib.suppress(FileNotFoundError):
            yield from stored_parts(self.file(table, night))

    def write(self, table: str, night: str, rows: pa.Table | Iterable[pa.Table] | None) -> None:
        """Store one night of one table, whole or in parts; without rows, store none."""
        if rows is None or not write_table(rows, self.file(table, night)):
            self.file(table, night).unlink(missing_ok=True)

    def set_aside_damaged(self, night: str) -> list[str]:
        """Rename the damaged tables of a night, so that it can be written again; return sentences on them. Raises
        NotNowError if one cannot be read now: it is kept unless it is known to be damaged."""
        notes = []
        for table in KEPT:
            try:
                for _ in self.parts_if_there(table.name, night):
                    pass
            except DamagedError as error:
                path = self.file(table.name, night)
                aside = path.with_name(f"{path.name}.{secrets.token_hex(4)}.damaged")
                path.rename(aside)
                notes.append(f"{error.seen}; set aside as {aside.name}, and written again")
        return notes

    def forget_explained(self, night: str, loops: Sequence[str] | None) -> None:
        """Delete the explanations of some loops of a night, of all if None, because their records were replaced."""
        table = self.read_if_there("explained", night)
        if table is not None:
            stay = table.slice(0, 0) if loops is None else rows_of_loops(table, loops, others=True)
            self.write("explained", night, stay if stay.num_rows else None)

    def forget_compared(self) -> None:
        """Delete the compared settings of all nights but the newest: only these are needed, and they are large."""
        newest = self.nights()[-1:]
        for path in self.files("compared"):
            if path.stem not in newest:
                self.write("compared", path.stem, None)

    @property
    def run_file(self) -> Path:
        """Path of the description of the run with the present pieces."""
        return self.path / "parts" / "run.json"

    def part(self, night: str, table: str, key: str) -> Path:
        """Path of a piece of a night in progress."""
        return self.path / "parts" / night / f"{table}-{key}.parquet"

    def whole_chunks(self, night: str) -> list[str]:
        """Keys of the chunks whose last piece, that of the table of nights, exists."""
        pieces = (p for p in listed(self.path / "parts" / night) if p.suffix == ".parquet")
        return sorted(p.stem.removeprefix("nights-") for p in pieces if "nights-" in p.stem[:7])

    def begun(self) -> list[str]:
        """Nights that were started and not finished."""
        return sorted(p.name for p in (self.path / "parts").glob("*") if p.is_dir() and is_night(p.name))

    def read_parts(
        self, night: str, table: str, keys: Sequence[str], columns: Sequence[str] | None = None
    ) -> pa.Table | None:
        """The pieces of one table of a night from some chunks, or some of its columns; None if there are none. Raises
        DamagedError if one is missing."""
        paths = [self.part(night, table, key) for key in keys]
        read = partial(self._piece, night, table, columns)
        found = [piece for piece in each(read, paths, keys) if piece is not None]
        return pa.concat_tables(found) if found else None

    def _piece(
        self, night: str, table: str, columns: Sequence[str] | None, path: Path, key: str
    ) -> pa.Table | None:
        """One piece of one table, None if the chunk has none."""
        try:
            return read_stored(path, columns)
        except FileNotFoundError:
            self._require_unwritten(night, table, key)
            return None
        except DamagedError as error:
            raise DamagedError(error.seen, error.expected, GO_ON) from error

    def _require_unwritten(self, night: str, table: str, key: str) -> None:
        """Raise DamagedError if a piece written by a chunk is missing."""
        try:
            written = table in further_tables(self.part(night, "nights", key))
        except FileNotFoundError:
            written = True
        if written:
            raise self.gone(self.part(night, table, key))

    def gone(self, piece: Path) -> DamagedError:
        """Error for a missing piece of a run."""
        seen = f"{piece}: this piece of the night is missing"
        expected = "a store that nobody else changes, and that all workers see"
        return DamagedError(seen, expected, GO_ON)

    def drop_parts(self) -> None:
        """Delete all pieces, and their run."""
        remove_tree(self.path / "parts")

    def version(self) -> int:
        """The version of its tables, 1 if none is stated. Raises InputError if the version file is damaged,
        NotNowError if it cannot be read now."""
        path = self.path / VERSION_FILE
        try:
            with refusals_as_errors(self.path) if is_remote(self.path) else nullcontext():
                return _stated_schema(path)
        except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
            if is_passing(error):
                raise not_now(path, error) from error
            right, nights = json.dumps({"schema": SCHEMA}), self.nights()
            ends = " to ".join(dict.fromkeys((*nights[:1], *nights[-1:])))
            stand = f"the tables of {len(nights)} nights, {ends}, are unchanged"
            seen = f"{path}: damaged, and nothing else: {stand if nights else 'no night is in the store'}"
            raise InputError(seen, right, f"write {right} into it and continue") from error

    def require_known(self) -> None:
        """Raise InputError where a newer version of this program wrote the store."""
        found = self.version()
        if found > SCHEMA:
            seen = f"{self.path}: tables of version {found}"
            raise InputError(seen, f"version {SCHEMA} at most", "install a newer triage")

    def upgrade(self) -> int:
        """Update its tables in place, one by one, and record the version; return the number of changed tables.

        From 1 to 2 tables of nights get every declared column, empty if unknown. An interrupted upgrade continues
        where it stopped; a table is complete at any time. Raises InputError where the store is of a newer version.
        """
        self.require_known()
        path, old, changed = self.path / VERSION_FILE, self.version() < SCHEMA, 0
        for table in self.files("nights") if old else ():
            with contextlib.suppress(DamagedError):  # `store check` reports a damaged table
                held = set(stored_names(table))
                lacking = [c for c in NIGHTS if c.name not in held]
                if lacking:
                    whole = [read_stored(table), rows_table((), lacking)]
                    write_table(pa.concat_tables(whole, promote_options="default"), table)
                    changed += 1
        if old or not path.exists():
            with whole_file(path, kept=True) as temporary:
                temporary.write_text(json.dumps({"schema": SCHEMA}) + "\n", encoding="utf-8")
        return changed


def _stated_schema(path: Path) -> int:
    try:
        return int(json.loads(content(path).decode("utf-8"))["schema"])
    except (FileNotFoundError, NotADirectoryError):
        return 1
