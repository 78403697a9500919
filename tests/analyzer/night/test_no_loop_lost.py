"""No loop is lost silently: the finished table is counted, and tables without known damage are kept."""

from __future__ import annotations

import errno
import os
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.night import chunk
from analyzer.store import table as store_table
from proofs.plant import write_export
from tests.analyzer.night.test_batch import at_rest, tables

slow = partial(pytest.param, marks=pytest.mark.slow)
LOOPS = 6
NIGHT = "2026-03-02"


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export of loops with constant OP, a quarter of an hour at 1 s."""
    loops = {f"L{k:02d}": at_rest(k, 900) for k in range(LOOPS)}
    return write_export(tmp_path_factory.mktemp("lost") / "night.parquet", loops)


@pytest.fixture(scope="module")
def kept(export: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The store of an undisturbed run."""
    store = tmp_path_factory.mktemp("kept") / "store"
    assert ran(export, store).exit_code == 0
    return store


def ran(export: Path, store: Path, *more: str) -> Result:
    """The batch in this process; chunks are assessed by this process."""
    return CliRunner().invoke(main, ["run", str(export), "--store", str(store), *more])


def half(export: Path, out: Path, loops: range) -> Path:
    """An export with some loops of another one."""
    names = [f"L{k:02d}.{role}" for k in loops for role in ("SP", "PV", "OP")]
    pq.write_table(pq.read_table(export).select(["timestamp", *names]), out)
    return out


@pytest.mark.parametrize(
    "number", [errno.EACCES, errno.ESTALE, slow(errno.EIO), slow(errno.EMFILE), slow(errno.ETIMEDOUT)]
)
def test_a_table_that_cannot_be_read_now_is_unchanged(export, tmp_path, monkeypatch, number):
    """If the system cannot read a table of the night, a second export ends with exit 2 and one line that names
    --resume.

    Nothing is renamed, and after the next read the table has all its loops.
    """
    store = tmp_path / "store"
    assert ran(half(export, tmp_path / "a.parquet", range(LOOPS // 2)), store).exit_code == 0
    before = tables(store)
    whole = pq.ParquetFile

    def refuses(path: Any, **how: Any) -> Any:
        if "nights" in str(path):
            raise OSError(number, os.strerror(number))
        return whole(path, **how)

    second = half(export, tmp_path / "b.parquet", range(LOOPS // 2, LOOPS))
    with monkeypatch.context() as patch:
        patch.setattr(store_table.pq, "ParquetFile", refuses)
        result = ran(second, store)
        checked = CliRunner().invoke(main, ["store", "check", str(store)])
    assert result.exit_code == 2, result.output
    assert "cannot be read now" in result.stderr
    assert "--resume" in result.stderr
    assert result.stderr.count("\n") == 1
    assert "delete" not in checked.output
    assert checked.exit_code == 1
    assert tables(store) == before
    assert ran(second, store, "--resume").exit_code == 0
    assert pq.read_table(store / "nights" / f"{NIGHT}.parquet").num_rows == LOOPS


def while_running(monkeypatch: pytest.MonkeyPatch, after: int, happens: Any) -> None:
    """Call a function after the last piece of a chunk has been written `after` times."""
    written: list[Path] = []
    write = chunk.write_table

    def disturbed(table: Any, path: Path) -> None:
        write(table, path)
        if path.name.startswith("nights-"):
            written.append(path)
            if len(written) == after:
                happens(path)

    monkeypatch.setattr(chunk, "write_table", disturbed)


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this test process assess the chunks, so that it can disturb them."""
    from analyzer.night import batch

    of = batch.executor
    monkeypatch.setattr(batch, "executor", lambda jobs, *rest: of(0, *rest))


LOSSES = {
    "the store": lambda path: shutil.rmtree(path.parents[2]),
    "all pieces": lambda path: shutil.rmtree(path.parents[1]),
    "a chunk": lambda path: [
        p.unlink() for p in path.parent.glob(f"*{path.stem.removeprefix('nights')}.parquet")
    ],
    "the last piece": lambda path: path.unlink(),
    "the trends": lambda path: path.with_name(path.name.replace("nights", "trends")).unlink(),
    "the hours": lambda path: path.with_name(path.name.replace("nights", "hours")).unlink(),
}


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("what", "after"),
    [
        *((w, 1) for w in LOSSES),
        ("the last piece", 2),
        *(slow(w, 2) for w in LOSSES if w != "the last piece"),
    ],
)
def test_pieces_that_are_removed_during_the_run_are_an_error(export, kept, tmp_path, what, after):
    """If the store, pieces or one piece of a table are removed during the run, it ends with exit 2 and one line with
    --resume.

    The resumed run gives the store of an undisturbed run.
    """
    store = tmp_path / "store"
    with pytest.MonkeyPatch.context() as patch:
        while_running(patch, after, LOSSES[what])
        result = ran(export, store)
    assert result.exit_code == 2, result.output
    assert "--resume" in result.stderr.splitlines()[-1]
    assert "loops assessed" not in result.stderr
    assert ran(export, store, "--resume").exit_code == 0
    assert tables(store) == tables(kept)


def other_day(path: Path) -> None:
    """The export of the next day under the same name."""
    write_export(path, {f"L{k:02d}": at_rest(100 + k, 900) for k in range(LOOPS)}, 1772496000.0 + 86400.0)


def other_tags(path: Path) -> None:
    """The export of another unit under the same name."""
    write_export(path, {f"M{k:02d}": at_rest(k, 900) for k in range(LOOPS)})


def same_size(path: Path) -> None:
    """A byte in the middle changed; the size and both ends are the same."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("changed", [other_day, other_tags, same_size, Path.unlink])
def test_an_export_that_changes_while_it_is_read_is_not_stored(export, kept, tmp_path, changed):
    """If an export is overwritten or deleted during the run, the run ends with exit 2 and a line that says so.

    No piece and no night of it is stored, and a night that the store had is kept.
    """
    mine, store = tmp_path / "night.parquet", tmp_path / "store"
    shutil.copyfile(export, mine)
    shutil.copytree(kept, store)
    before = tables(store)
    with pytest.MonkeyPatch.context() as patch:
        while_running(patch, 2, lambda _: changed(mine))
        result = ran(mine, store)
    assert result.exit_code == 2, result.output
    assert "while it was read" in result.stderr.splitlines()[-1]
    assert "KeyError" not in result.stderr
    assert not (store / "parts").exists()
    assert tables(store) == before
