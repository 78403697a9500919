"""A store stays whole and by itself: no other folder becomes one, one clock, all tables of a night together."""

from __future__ import annotations

import errno
import os
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.store import draft
from analyzer.store.store import Store
from proofs.plant import START_S, write_export
from tests.analyzer.night.test_batch import at_rest, tables

slow = partial(pytest.param, marks=pytest.mark.slow)
LOOPS = 4


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four loops at rest, a quarter of an hour at 1 s."""
    return written(tmp_path_factory.mktemp("folder") / "night.parquet", 0)


@pytest.fixture(scope="module")
def kept(export: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with that night."""
    store = tmp_path_factory.mktemp("kept") / "store"
    assert ran(export, store).exit_code == 0
    return store


def written(path: Path, seed: int, start_s: float = START_S) -> Path:
    """An export of four loops at rest."""
    return write_export(path, {f"L{k}": at_rest(seed + k, 900) for k in range(LOOPS)}, start_s)


def asked(*words: object) -> Result:
    """An answer of the command line."""
    return CliRunner().invoke(main, [str(w) for w in words])


def ran(export: Path, store: Path, *more: str) -> Result:
    """The batch."""
    return asked("run", export, "--store", store, *more)


def test_a_folder_of_other_files_is_no_store(export: Path, tmp_path: Path) -> None:
    """A folder that holds something else is refused in one line and left as it was."""
    photos = tmp_path / "photos"
    photos.mkdir()
    for name in ("a.jpg", "b.jpg"):
        (photos / name).touch()
    told = ran(export, photos)
    assert (told.exit_code, told.stderr.count("\n")) == (2, 1)
    assert f"--store {photos}: a folder that holds a.jpg, b.jpg and is no store" in told.stderr
    assert sorted(os.listdir(photos)) == ["a.jpg", "b.jpg"]


def test_a_file_is_no_store(export: Path, tmp_path: Path) -> None:
    """Where --store names a file, a folder is asked for."""
    (tmp_path / "day1.csv").write_text("timestamp,L.PV\n")
    told = ran(export, tmp_path / "day1.csv")
    assert (told.exit_code, told.stderr.count("\n")) == (2, 1)
    assert "a file; expected a folder" in told.stderr


@pytest.mark.parametrize("left", [[], ["lost+found"], [".hidden"], ["notes.jsonl", "run.lock"]])
def test_what_belongs_to_a_store_is_in_no_way(export: Path, tmp_path: Path, left: list[str]) -> None:
    """An empty folder, the root of a disk, and what a store holds before its first night are taken."""
    for name in left:
        (tmp_path / name).touch()
    assert ran(export, tmp_path).exit_code == 0


@pytest.mark.parametrize("command", ["pages", "report"])
def test_pages_are_not_written_into_a_store(kept: Path, command: str) -> None:
    """Pages into a store are refused, and it holds what it held."""
    before = sorted(p.name for p in kept.rglob("*"))
    more = ["--find"] if command == "report" else []
    told = asked(command, kept, *more, "--out", kept)
    assert (told.exit_code, told.stderr.count("\n")) == (2, 1)
    assert f"--out {kept}: a store" in told.stderr
    assert sorted(p.name for p in kept.rglob("*")) == before


def test_a_store_has_one_clock(kept: Path, tmp_path: Path) -> None:
    """A night cut by the midnights of another zone is refused and names the store's; where it replaces all that is
    there it is taken."""
    store = Path(shutil.copytree(kept, tmp_path / "store"))
    next_day = written(tmp_path / "next.parquet", 0, START_S + 86400.0)
    before = tables(store)
    told = ran(next_day, store, "--timezone", "Europe/Helsinki")
    assert told.exit_code == 2
    assert "state --timezone UTC" in told.stderr
    assert tables(store) == before
    assert ran(next_day, store).exit_code == 0
    alone = Path(shutil.copytree(kept, tmp_path / "alone"))
    again = ran(written(tmp_path / "again.parquet", 0), alone, "--timezone", "Europe/Helsinki", "--replace")
    assert again.exit_code == 0, again.stderr
    assert Store(alone).zone() == "Europe/Helsinki"


@pytest.mark.parametrize(
    ("at", "more"),
    [
        *((0, ["--replace"]), (1, []), (2, ["--replace"])),
        *(slow(0, []), slow(1, ["--replace"]), slow(2, [])),
    ],
)
def test_a_disk_that_is_full_at_the_end_leaves_the_night_as_it_was(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: int, more: list[str]
) -> None:
    """Whichever table of a night finds no room, the store is that of before, with one line that names --resume; with
    room the night is the new one."""
    store = Path(shutil.copytree(kept, tmp_path / "store"))
    other = written(tmp_path / "other.parquet", 50)
    before, count = tables(store), 0
    write = draft.write_table

    def full(table: Any, path: Path) -> None:
        nonlocal count
        count += 1
        if count > at:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        write(table, path)

    with monkeypatch.context() as patch:
        patch.setattr(draft, "write_table", full)
        told = ran(other, store, *more)
    if count <= at:
        pytest.skip("fewer tables than that")
    assert told.exit_code == 2, told.output
    assert "--resume" in told.stderr.splitlines()[-1]
    left = {name: rows for name, rows in tables(store).items() if not name.startswith("parts")}
    assert left == before
    assert ran(other, store, "--resume", *more).exit_code == 0
    fresh = tmp_path / "fresh"
    assert ran(other, fresh).exit_code == 0
    assert tables(store) == tables(fresh)
