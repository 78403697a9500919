"""Changes of a store that are kept all together or not at all: written to a separate folder, and renamed at the
end."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa

from analyzer.locations import is_remote
from analyzer.store.store import Store
from analyzer.store.table import KEPT, write_table

FOLDER = "finished"
"""Folder of the finished tables among the pieces of a run, until all are written."""


class Draft(Store):
    """A store with pending changes: changed tables are read from the draft, all others from the store."""

    def __init__(self, path: Path, folder: Path) -> None:
        super().__init__(path)
        self._folder = folder
        self._made: dict[tuple[str, str], bool] = {}

    def file(self, table: str, night: str) -> Path:
        return self._draft_file(table, night) if (table, night) in self._made else super().file(table, night)

    def files(self, table: str) -> list[Path]:
        names = {p.stem for p in super().files(table)} | {n for t, n in self._made if t == table}
        return [self.file(table, n) for n in sorted(names) if self._made.get((table, n), True)]

    def write(self, table: str, night: str, rows: pa.Table | Iterable[pa.Table] | None) -> None:
        written = rows is not None and write_table(rows, self._draft_file(table, night))
        if not written:
            self._draft_file(table, night).unlink(missing_ok=True)
        self._made[table, night] = written

    def keep(self) -> None:
        """Move all changed tables to the store, the tables of nights last, so that readers find only complete
        nights."""
        order = [t.name for t in reversed(KEPT)]
        for table, night in sorted(self._made, key=lambda made: (order.index(made[0]), made[1])):
            _moved(self._draft_file(table, night), super().file(table, night), self._made[table, night])
        self._made.clear()

    def _draft_file(self, table: str, night: str) -> Path:
        return self._folder / table / f"{night}.parquet"


def _moved(draft: Path, to: Any, exists: bool) -> None:
    if not exists:
        to.unlink(missing_ok=True)
    elif is_remote(to):
        to.fs.put_file(str(draft), to.path)
    else:
        to.parent.mkdir(parents=True, exist_ok=True)
        os.replace(draft, to)


@contextmanager
def drafted(store: Store) -> Iterator[Draft]:
    """A draft of a store, kept at the end; after an error the store is unchanged."""
    if is_remote(store.path):
        with tempfile.TemporaryDirectory(prefix="triage-finished-") as made:
            draft = Draft(store.path, Path(made))
            yield draft
            draft.keep()
        return
    folder = store.path / "parts" / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    draft = Draft(store.path, folder)
    yield draft
    draft.keep()
