"""The commands report and pages write what they say, and refuse in one line what they cannot do."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from analyzer.columns.table import NIGHTS, row_of
from analyzer.commands.report import pages, report
from analyzer.store import Store, rows_table, write_table
from identification.errors import InputError
from tests.reports.small_store import NASTY, small_store


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """Two weeks of eight made-up loops."""
    return small_store(tmp_path_factory.mktemp("store"), loops=8)


def run(*arguments: object) -> Result:
    """Run the command report."""
    return CliRunner().invoke(report, [str(a) for a in arguments])


def test_one_loop_by_its_tag(store: Store, tmp_path: Path) -> None:
    """A loop and a time on the command line give a page in one file, and its tables as CSV."""
    found = run(
        store.path, "--loop", "FIC0000", "--changed", "2026-03-09", "--out", tmp_path, "--single-file"
    )
    assert found.exit_code == 0
    assert (tmp_path / "before-after.html").stat().st_size > 50_000
    assert not (tmp_path / "assets").exists()
    assert "FIC0000" in (tmp_path / "csv" / "before-after-figures.csv").read_text("utf-8")


def test_spans_may_be_stated(store: Store, tmp_path: Path) -> None:
    """Explicit spans replace the days around the change."""
    before, after = ("--before", "2026-03-02", "2026-03-06"), ("--after", "2026-03-10", "2026-03-14")
    where = (store.path, "--loop", NASTY[0], "--changed", "2026-03-09")
    found = run(*where, *before, *after, "--format", "markdown", "--out", tmp_path)
    assert found.exit_code == 0
    text = (tmp_path / "before-after.md").read_text("utf-8")
    assert "2026-03-02 00:00 to 2026-03-06 00:00 UTC, 96 usable hours" in text


def test_lost_changes_give_exit_status_1(store: Store, tmp_path: Path) -> None:
    """A change of an unknown loop is named on stderr; the others are reported, with exit status 1."""
    changes = tmp_path / "changes.csv"
    changes.write_text("loop,time\nFIC0000,2026-03-09\nGONE,2026-03-09\n", "utf-8")
    found = run(store.path, "--changes", changes, "--out", tmp_path / "out")
    assert found.exit_code == 1
    assert "GONE: the store holds no hours" in found.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "no change named"),
        (("--loop", "GONE", "--changed", "2026-03-09"), "GONE"),
        (("--loop", "FIC0000", "--changed", "soon"), "'soon'"),
        (
            ("--loop", "FIC0000", "--changed", "2026-03-09", "--before", "2026-03-05", "2026-03-02"),
            "swap them",
        ),
    ],
)
def test_what_cannot_be_done_is_said(
    store: Store, tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    """What is missing or wrong is said with what to do."""
    found = run(store.path, *arguments, "--out", tmp_path)
    assert isinstance(found.exception, InputError)
    assert said in str(found.exception)


def test_pages_of_a_night(store: Store, tmp_path: Path) -> None:
    """The command pages writes the morning page and as many loop pages as asked for."""
    found = CliRunner().invoke(pages, [str(store.path), "--top", "3", "--out", str(tmp_path)])
    assert found.exit_code == 0
    assert len(list(tmp_path.glob("*.html"))) == 4


def test_commands_are_quick_to_import() -> None:
    """Importing the commands loads neither numpy nor pandas nor matplotlib."""
    heavy = "numpy", "pandas", "matplotlib"
    code = f"import sys, analyzer.commands.report; print([m for m in {heavy} if m in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_a_calm_night_has_its_page(tmp_path: Path) -> None:
    """Where no loop is worth a look the morning page is written all the same, and no loop's page beside it."""
    rows = [row_of({"loop": "FIC1", "night": "2026-03-02", "status": "ok", "cause": "none"})]
    write_table(rows_table(rows, NIGHTS), tmp_path / "store" / "nights" / "2026-03-02.parquet")
    found = CliRunner().invoke(pages, [str(tmp_path / "store"), "--out", str(tmp_path / "out")])
    assert found.exit_code == 0, found.output
    assert [p.name for p in sorted((tmp_path / "out").glob("*.html"))] == ["index.html"]
