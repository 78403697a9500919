"""The version of a store's tables: an older store is brought up to date in place, a newer one is left alone."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import pyarrow as pa

from analyzer.columns import NIGHTS
from analyzer.places import answering, content, is_remote
from analyzer.store.table import read_stored, stored_names, write_table
from identification.errors import InputError
from reports.whole_file import whole_file

SCHEMA = 2
"""1: no lanes, no half-cycles; a store without a version is one. 2: every column that is declared."""
FILE = "store.json"
"""Name within the store."""


def version_of(store: Path) -> int:
    """The version of a store, 1 where it states none.

    Raises
    ------
    InputError
        What states it is damaged.
    """
    path = store / FILE
    try:
        with answering(store) if is_remote(store) else nullcontext():
            return _stated(path)
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        right = f'{{"schema": {SCHEMA}}}'
        raise InputError(
            f"{path}: damaged, and nothing else: {_held(store)}", right, f"write {right} into it and go on"
        ) from error


def _stated(path: Path) -> int:
    try:
        return int(json.loads(content(path).decode("utf-8"))["schema"])
    except (FileNotFoundError, NotADirectoryError):
        return 1


def _held(store: Path) -> str:
    """What stands in the tables of nights, in words."""
    nights = sorted(p.stem for p in (store / "nights").glob("*.parquet"))
    if not nights:
        return "no night is in the store"
    several = f" to {nights[-1]}" if len(nights) > 1 else ""
    return f"the tables of {len(nights)} nights, {nights[0]}{several}, stand as they were"


def require_known(store: Path) -> None:
    """Raise InputError where a newer version of this program wrote the store."""
    found = version_of(store)
    if found > SCHEMA:
        raise InputError(
            f"{store}: tables of version {found}", f"version {SCHEMA} at most", "install a newer triage"
        )


def upgrade(store: Path) -> int:
    """Bring a store's tables up to date in place, one by one, and say so in it; returns how many were changed.

    An upgrade that was cut short is done again from where it stood; a table is whole at any time.

    Raises
    ------
    InputError
        The store is of a newer version.
    """
    require_known(store)
    changed = 0
    for step in range(version_of(store), SCHEMA):
        changed += STEPS[step](store)
    if version_of(store) < SCHEMA or not (store / FILE).exists():
        with whole_file(store / FILE, kept=True) as temporary:
            temporary.write_text(json.dumps({"schema": SCHEMA}) + "\n", encoding="utf-8")
    return changed


def _fill(store: Path) -> int:
    """Tables of nights get every column that is declared, empty where nothing is known."""
    changed = 0
    for path in sorted((store / "nights").glob("*.parquet")):
        with contextlib.suppress(InputError):  # a damaged table stays for `store check` to name
            changed += _filled(path)
    return changed


def _filled(path: Path) -> bool:
    held = set(stored_names(path))
    lacking = [c for c in NIGHTS if c.name not in held]
    if not lacking:
        return False
    table = read_stored(path)
    for c in lacking:
        kind = pa.float64() if c.is_number else pa.string()
        table = table.append_column(c.name, pa.nulls(table.num_rows, kind))
    write_table(table, path)
    return True


STEPS: dict[int, Callable[[Path], int]] = {1: _fill}
"""What leads from a version to the next."""
