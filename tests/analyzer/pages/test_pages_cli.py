"""The commands `report` and `pages` write their pages, and refuse impossible requests in one line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.columns import NIGHTS, row_of
from analyzer.store.store import Store
from analyzer.store.table import rows_table, write_table
from reports.texts import slug
from tests.reports.small_store import NASTY, small_store


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """Two weeks of eight invented loops."""
    return small_store(tmp_path_factory.mktemp("store"), loops=8)


def run(*arguments: object) -> Result:
    """Run the command report."""
    return CliRunner().invoke(main, ["report", *map(str, arguments)])


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
    ("arguments", "fragment"),
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
def test_an_impossible_request_is_reported(
    store: Store, tmp_path: Path, arguments: tuple[str, ...], fragment: str
) -> None:
    """A missing or wrong argument is reported with its name or remedy."""
    found = run(store.path, *arguments, "--out", tmp_path)
    assert found.exit_code == 2
    assert fragment in found.stderr


def test_pages_of_a_night(store: Store, tmp_path: Path) -> None:
    """The command writes the morning page, the hand-over sheet, a page for each night and the requested number of
    loop pages.
    """
    found = CliRunner().invoke(main, ["pages", str(store.path), "--top", "3", "--out", str(tmp_path)])
    assert found.exit_code == 0
    names = [p.name for p in tmp_path.glob("*.html")]
    dated = [n for n in names if n.startswith("morning-")]
    assert {"index.html", "maintenance.html", "side-by-side.html", "work.html"} <= set(names)
    assert (len(dated), len(names)) == (14, 14 + 4 + 3)


def test_nights_are_linked_and_outdated_pages_are_deleted(tmp_path: Path) -> None:
    """Each dated page links to those before and after it; pages of loops that are no longer listed are deleted, and
    no others.
    """
    kept = small_store(tmp_path / "store", loops=8, nights=3)
    out = tmp_path / "out"
    assert CliRunner().invoke(main, ["pages", str(kept.path), "--out", str(out)]).exit_code == 0
    before = {p.name for p in out.glob("*.html")}
    (out / "mine.html").write_text("my own", encoding="utf-8")
    assert CliRunner().invoke(main, ["pages", str(kept.path), "--top", "1", "--out", str(out)]).exit_code == 0
    after = {p.name for p in out.glob("*.html")}
    assert "mine.html" in after
    assert len([n for n in before if n not in after]) == len(before) - 4 - 3 - 1
    middle = (out / "morning-2026-03-03.html").read_text(encoding="utf-8")
    assert 'href="morning-2026-03-02.html"' in middle
    assert 'href="morning-2026-03-04.html"' in middle
    assert 'href="index.html"' in middle
    loops = [
        n for n in before if n not in ("index.html", "maintenance.html") and not n.startswith("morning-")
    ]
    assert not any(f'href="{name}"' in middle for name in loops)


def test_commands_are_quick_to_import() -> None:
    """The import of the commands loads neither numpy nor pandas nor matplotlib."""
    heavy = "numpy", "pandas", "matplotlib"
    code = f"import sys, analyzer.commands.report; print([m for m in {heavy} if m in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_a_night_without_work_has_its_page(tmp_path: Path) -> None:
    """If no loop needs attention, the morning page and the page of the loop are still written."""
    rows = [row_of({"loop": "FIC1", "night": "2026-03-02", "status": "ok", "cause": "none"})]
    write_table(rows_table(rows, NIGHTS), tmp_path / "store" / "nights" / "2026-03-02.parquet")
    found = CliRunner().invoke(main, ["pages", str(tmp_path / "store"), "--out", str(tmp_path / "out")])
    assert found.exit_code == 0, found.output
    assert {p.name for p in (tmp_path / "out").glob("*.html")} == {
        *("index.html", "maintenance.html", "morning-2026-03-02.html", "side-by-side.html", "work.html"),
        f"{slug('FIC1')}.html",
    }
