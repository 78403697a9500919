"""A store stays complete and separate: no other folder becomes a store, it has one clock, and all tables of a
night.
"""

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
    """Four loops with constant OP, a quarter of an hour at 1 s."""
    return written(tmp_path_factory.mktemp("folder") / "night.parquet", 0)


@pytest.fixture(scope="module")
def kept(export: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with that night."""
    store = tmp_path_factory.mktemp("kept") / "store"
    assert ran(export, store).exit_code == 0
    return store


def written(path: Path, seed: int, start_s: float = START_S) -> Path:
    """An export of four loops with constant OP."""
    return write_export(path, {f"L{k}": at_rest(seed + k, 900) for k in range(LOOPS)}, start_s)


def run_command(*words: object) -> Result:
    """Result of a command line."""
    return CliRunner().invoke(main, [str(w) for w in words])


def ran(export: Path, store: Path, *more: str) -> Result:
    """The batch."""
    return run_command("run", export, "--store", store, *more)


def test_a_folder_of_other_files_is_no_store(export: Path, tmp_path: Path) -> None:
    """A folder with other files is refused in one line and is unchanged."""
    photos = tmp_path / "photos"
    photos.mkdir()
    for name in ("a.jpg", "b.jpg"):
        (photos / name).touch()
    result = ran(export, photos)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert f"--store {photos}: a folder that holds a.jpg, b.jpg and is no store" in result.stderr
    assert sorted(os.listdir(photos)) == ["a.jpg", "b.jpg"]


def test_a_file_is_no_store(export: Path, tmp_path: Path) -> None:
    """If --store names a file, a folder is required."""
    (tmp_path / "day1.csv").write_text("timestamp,L.PV\n")
    result = ran(export, tmp_path / "day1.csv")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "a file; expected a folder" in result.stderr


@pytest.mark.parametrize("left", [[], ["lost+found"], [".hidden"], ["notes.jsonl", "run.lock"]])
def test_files_of_a_store_are_accepted(export: Path, tmp_path: Path, left: list[str]) -> None:
    """An empty folder, the root of a disk, and the files of a store before its first night are accepted."""
    for name in left:
        (tmp_path / name).touch()
    assert ran(export, tmp_path).exit_code == 0


@pytest.mark.parametrize("command", ["pages", "report"])
def test_pages_are_not_written_into_a_store(kept: Path, command: str) -> None:
    """Pages into a store are refused, and its content is unchanged."""
    before = sorted(p.name for p in kept.rglob("*"))
    more = ["--find"] if command == "report" else []
    result = run_command(command, kept, *more, "--out", kept)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert f"--out {kept}: a store" in result.stderr
    assert sorted(p.name for p in kept.rglob("*")) == before


def test_a_store_has_one_clock(kept: Path, tmp_path: Path) -> None:
    """A night divided at the midnights of another zone is refused and names the zone of the store.

    It is accepted if it replaces all nights of the store.
    """
    store = Path(shutil.copytree(kept, tmp_path / "store"))
    next_day = written(tmp_path / "next.parquet", 0, START_S + 86400.0)
    before = tables(store)
    result = ran(next_day, store, "--timezone", "Europe/Helsinki")
    assert result.exit_code == 2
    assert "state --timezone UTC" in result.stderr
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
def test_a_disk_that_is_full_at_the_end_does_not_change_the_night(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: int, more: list[str]
) -> None:
    """If there is no room for one table of a night, the store is unchanged, with one line that names --resume.

    With room the night is the new one.
    """
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
        result = ran(other, store, *more)
    if count <= at:
        pytest.skip("fewer tables than that")
    assert result.exit_code == 2, result.output
    assert "--resume" in result.stderr.splitlines()[-1]
    left = {name: rows for name, rows in tables(store).items() if not name.startswith("parts")}
    assert left == before
    assert ran(other, store, "--resume", *more).exit_code == 0
    fresh = tmp_path / "fresh"
    assert ran(other, fresh).exit_code == 0
    assert tables(store) == tables(fresh)
