"""A store over years is checked, pruned and upgraded, and is never the reason for a lost night."""

from __future__ import annotations

import json
import os
import shutil
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.columns import NIGHTS
from analyzer.store import store as store_module
from analyzer.store.maintenance import problems
from analyzer.store.store import Store
from proofs.plant import Sketch, simulate, write_export
from tests.analyzer.conftest import RunPlant
from tests.reports.small_store import small_store


@pytest.fixture(scope="module")
def five_nights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of five nights of six loops, written by this version; each test has a copy."""
    kept = small_store(tmp_path_factory.mktemp("five") / "store", loops=6, nights=5)
    kept.upgrade()
    return kept.path


@pytest.fixture
def store(five_nights: Path, tmp_path: Path) -> Store:
    """Five nights of six loops."""
    return Store(shutil.copytree(five_nights, tmp_path / "store"))


def run_command(*arguments: object) -> Result:
    """Result of a command line."""
    return CliRunner().invoke(main, [str(a) for a in arguments])


def within_values(path: Path) -> int:
    """A position among the values of the largest column; no reader uses the bounds in the page headers."""
    group = pq.ParquetFile(path).metadata.row_group(0)
    largest = max((group.column(k) for k in range(group.num_columns)), key=lambda c: c.total_compressed_size)
    if not largest.has_dictionary_page:
        return int(largest.data_page_offset + largest.total_compressed_size // 2)
    return int(largest.dictionary_page_offset + largest.data_page_offset) // 2


def damage(path: Path, how: str) -> None:
    """Damage a file in the given way."""
    data = path.read_bytes()
    if how == "directory":
        path.unlink()
        path.mkdir()
        return
    at = within_values(path)
    broken = {
        "empty": b"",
        "cut": data[: len(data) // 2],
        "garbage": b"\x00garbage" * 100,
        "middle": data[:at] + b"\xff" * 8 + data[at + 8 :],
    }
    path.write_bytes(broken[how])


READERS = (
    *(("rank", form) for form in ("table", "csv", "json", "markdown")),
    *(("groups", form) for form in ("table", "csv")),
    *(("pages", ""), ("report", ""), ("summary", ""), ("note", ""), ("store check", "")),
)


def answer(store: Store, command: str, form: str, out: Path) -> Result:
    """The result of a command for a store."""
    more: dict[str, tuple[object, ...]] = {
        "rank": ("rank", store.path, "--format", form),
        "groups": ("rank", store.path, "--groups", "--format", form),
        "pages": ("pages", store.path, "--out", out),
        "report": ("report", store.path, "--loop", "FIC0000", "--changed", "2026-03-04T00:00", "--out", out),
        "summary": ("summary", store.path),
        "note": ("note", store.path, "FIC0000", "seen"),
        "store check": ("store", "check", store.path),
    }
    return run_command(*more[command])


@pytest.mark.parametrize("how", ["empty", "cut", "garbage", "middle", "directory"])
@pytest.mark.parametrize("table", ["nights", "trends", "hours", "groups"])
def test_a_damaged_table_is_one_line(store: Store, tmp_path: Path, table: str, how: str) -> None:
    """No command on a damaged store ends with a traceback: it names the damaged file or does not need it."""
    night = store.nights()[-1]
    path = store.path / table / f"{night}.parquet"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        pq.write_table(pa.table({"loop": ["FIC0000"], "night": [night]}), path)
    undamaged = path.read_bytes()
    damage(path, how)
    unnamed = {}
    for command, form in READERS:
        result = answer(store, command, form, tmp_path / "out")
        assert result.exception is None or isinstance(result.exception, SystemExit), (command, form)
        if result.exit_code == 2:
            assert result.stderr.count("\n") == 1
            if str(path) not in result.stderr:
                unnamed[command, form] = result.stderr
    assert any(str(path) in p.seen for p in problems(store))
    assert run_command("store", "check", store.path).exit_code == 1
    if path.is_dir():
        path.rmdir()
    path.write_bytes(undamaged)
    assert unnamed == {reader: answer(store, *reader, tmp_path / "out").stderr for reader in unnamed}


@pytest.mark.parametrize(
    "columns",
    [
        {"x": [1.0]},
        {"loop": ["A"], "oscillation_significance": ["much"]},
        {"loop": [1.0], "oscillation_significance": [1.0]},
    ],
)
def test_a_table_of_other_columns_is_named(store: Store, columns: dict[str, list[object]]) -> None:
    """A Parquet file that is not a table of results is reported in one line with its path."""
    path = store.path / "nights" / f"{store.nights()[-1]}.parquet"
    pq.write_table(pa.table(columns), path)
    result = run_command("rank", store.path)
    assert result.exit_code == 2
    assert str(path) in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("table", "column"),
    [
        *(("nights", name) for name in ("signs", "turns", "action", "ti_unit")),
        *(("trends", name) for name in ("sp_min", "sp_max", "time_s")),
    ],
)
def test_a_column_with_invalid_text_is_named(store: Store, tmp_path: Path, table: str, column: str) -> None:
    """A stored column with text where figures, JSON or fixed words are expected is one line of `pages` with file and
    column.

    `store check` reports it as a problem.
    """
    path = store.path / table / f"{store.nights()[-1]}.parquet"
    kept = pq.read_table(path)
    text = pa.array(["much"] * kept.num_rows)
    pq.write_table(kept.set_column(kept.column_names.index(column), column, text), path)
    result = answer(store, "pages", "", tmp_path / "out")
    assert result.exit_code == 2
    assert isinstance(result.exception, SystemExit)
    assert f"{path}: damaged (column {column} holds " in result.stderr
    assert result.stderr.count("\n") == 1
    assert [p for p in problems(store) if f"{path}: damaged" in p.seen]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": "new"}'])
def test_a_damaged_version_file_is_reported_with_the_nights(store: Store, text: str) -> None:
    """A store with an unreadable version file reports that its nights are unchanged and what to write; after that it
    is ranked.
    """
    (store.path / store_module.VERSION_FILE).write_text(text)
    result = run_command("rank", store.path)
    assert result.exit_code == 2
    assert "5 nights, 2026-03-02 to 2026-03-06, are unchanged" in result.stderr
    assert "delete" not in result.stderr
    right = '{"schema": 2}'
    assert f"write {right} into it" in result.stderr
    (store.path / store_module.VERSION_FILE).write_text(right)
    assert run_command("rank", store.path).exit_code == 0


def test_a_complete_store_has_no_problem(store: Store) -> None:
    """A store without a problem is reported as complete, with its size."""
    result = run_command("store", "check", store.path)
    assert (result.exit_code, list(problems(store))) == (0, [])
    assert "5 nights" in result.stdout


def test_temporary_files_are_found_and_pruned(store: Store) -> None:
    """A temporary file of a dead process is named and deleted after a day; a younger one may be in use and is
    kept.
    """
    old, young = (store.path / "nights" / f".2026-03-02.parquet.{k}.tmp" for k in ("a", "b"))
    for path in (old, young):
        path.write_bytes(b"x")
    os.utime(old, (time.time() - 2 * 86_400,) * 2)
    assert sum("remains of a process" in p.seen for p in problems(store)) == 2
    assert run_command("store", "prune", store.path, "--keep", "400d").exit_code == 0
    assert (old.exists(), young.exists()) == (False, True)


def test_prune_keeps_the_requested_nights(store: Store) -> None:
    """Nights older than --keep are deleted with all tables, and trends older than --keep-trends; the dry run deletes
    nothing.
    """
    before = sorted(p.as_posix() for p in store.path.rglob("*.parquet"))
    nights = store.nights()
    dry = run_command("store", "prune", store.path, "--keep", "2d", "--keep-trends", "1d", "--dry-run")
    assert "would be deleted" in dry.stdout
    assert sorted(p.as_posix() for p in store.path.rglob("*.parquet")) == before
    assert run_command("store", "prune", store.path, "--keep", "2d", "--keep-trends", "1d").exit_code == 0
    assert store.nights() == nights[-3:]
    assert sorted(p.stem for p in (store.path / "trends").glob("*.parquet")) == nights[-2:]
    assert run_command("rank", store.path).exit_code == 0


def test_a_night_in_the_future_makes_no_night_old(store: Store) -> None:
    """One night with a date a century ahead, from a wrong clock of a historian, does not cause the deletion of the
    others.
    """
    nights = store.nights()
    first = store.path / "nights" / f"{nights[0]}.parquet"
    (store.path / "nights" / "2126-03-02.parquet").write_bytes(first.read_bytes())
    assert run_command("store", "prune", store.path, "--keep", "400d").exit_code == 0
    assert store.nights() == [*nights, "2126-03-02"]
    for night in nights:
        (store.path / "nights" / f"{night}.parquet").unlink()
    assert run_command("store", "prune", store.path, "--keep", "99999y").exit_code == 0
    assert store.nights() == ["2126-03-02"]


@pytest.mark.parametrize("text", ["", "400", "0d", "-1d", "1e9d", "ten days"])
def test_prune_without_a_time_deletes_nothing(store: Store, text: str) -> None:
    """An invalid time is reported in one line, and all nights are kept."""
    result = run_command("store", "prune", store.path, "--keep", text)
    assert result.exit_code == 2
    assert len(store.nights()) == 5


def test_an_older_store_is_brought_up_to_date(store: Store) -> None:
    """A store without a version and without newer columns gets both in place, once, and keeps its figures."""
    path = store.path / "nights" / f"{store.nights()[0]}.parquet"
    table = pq.read_table(path)
    pq.write_table(table.drop_columns(["lanes", "turns"]), path)
    (store.path / store_module.VERSION_FILE).unlink()
    assert store.version() == 1
    assert (store.upgrade(), store.upgrade()) == (1, 0)
    again = pq.read_table(path)
    assert set(again.column_names) >= {c.name for c in NIGHTS}
    assert again.column("loop").to_pylist() == table.column("loop").to_pylist()
    assert again.column("lanes").null_count == table.num_rows


def test_a_newer_store_is_left_alone(store: Store, tmp_path: Path) -> None:
    """A store of a newer version is neither read nor written, and the line says what to install."""
    (store.path / store_module.VERSION_FILE).write_text(json.dumps({"schema": 99}))
    export = write_export(
        tmp_path / "x.parquet", {"L0": simulate(Sketch("none", (1.0, 20.0, 3.0), 1.0, 20.0), 0.2)}
    )
    for arguments in (("rank", store.path), ("run", export, "--store", store.path)):
        result = run_command(*arguments)
        assert result.exit_code == 2
        assert "tables of version 99; expected version" in result.stderr
        assert "install a newer triage" in result.stderr


def test_a_damaged_night_is_written_again(tmp_path: Path) -> None:
    """A night with a damaged table does not stop its run: the damaged file is set aside and named."""
    trends = simulate(Sketch("none", (1.0, 20.0, 3.0), 1.0, 20.0), 1.0)
    export, path = write_export(tmp_path / "x.parquet", {"L0": trends}), tmp_path / "store"
    assert run_command("run", export, "--store", path).exit_code == 0
    store = Store(path)
    table = path / "nights" / f"{store.nights()[0]}.parquet"
    good = pq.read_table(table)
    damage(table, "cut")
    (path / store_module.VERSION_FILE).unlink()
    result = run_command("run", export, "--store", path)
    assert result.exit_code == 0, result.stderr
    assert "set aside as" in result.stderr
    assert pq.read_table(table).equals(good)
    assert len(list((path / "nights").glob("*.damaged"))) == 1


@pytest.mark.parametrize(
    ("table", "column"),
    [("nights", "expected_pv_amplitude_pct"), ("groups", "coherence"), ("groups", "group_period_s")],
)
def test_a_table_that_lacks_a_column_is_no_traceback(
    run_plant: RunPlant, tmp_path: Path, table: str, column: str
) -> None:
    """If a table of a night lacks one column, the pages are written, or file and column are named."""
    store = Store(shutil.copytree(run_plant.store, tmp_path / "store"))
    path = store.path / table / f"{store.nights()[-1]}.parquet"
    pq.write_table(pq.read_table(path).drop_columns([column]), path)
    result = answer(store, "pages", "", tmp_path / "out")
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert result.exit_code == 0 or f"{path}: no column {column}" in result.stderr
