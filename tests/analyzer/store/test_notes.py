"""Notes on loops are stored line by line, shown with the loop, and hide it only until the stated date."""

from __future__ import annotations

import csv
import io
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.store import notes
from analyzer.store.store import Store
from tests.reports.small_store import NASTY, small_store


@pytest.fixture
def store(tmp_path: Path) -> Store:
    """Three nights of twelve loops."""
    return small_store(tmp_path / "store", loops=12, nights=3)


def run_command(*arguments: object) -> Result:
    """Result of a command line."""
    return CliRunner().invoke(main, [str(a) for a in arguments])


def listed(store: Store, *options: str) -> list[dict[str, str]]:
    """Rows of the list as CSV."""
    return list(
        csv.DictReader(io.StringIO(run_command("rank", store.path, "--format", "csv", *options).stdout))
    )


def test_a_note_is_shown_in_list_and_pages(store: Store, tmp_path: Path) -> None:
    """A note is shown in the list, in its own column of the CSV, on the morning page and on the page of the loop."""
    assert run_command("note", store.path, NASTY[0], "seen <b>it</b>", "--owner", "Laine").exit_code == 0
    row = next(r for r in listed(store) if r["loop"] == NASTY[0])
    assert row["note"].startswith("seen <b>it</b> (Laine, ")
    assert "note: seen &lt;b&gt;it" in run_command("rank", store.path, "--format", "markdown").stdout
    run_command("pages", store.path, "--out", tmp_path / "out")
    pages = [p.read_text("utf-8") for p in (tmp_path / "out").glob("*.html")]
    holding = [p for p in pages if "seen &lt;b&gt;it" in p]
    assert len(holding) >= 2
    assert not any("seen <b>it" in p for p in pages)


def test_the_newest_note_counts_and_all_are_printed(store: Store) -> None:
    """A second note replaces the first in the list; without a text all notes are printed, oldest first."""
    for text in ("first", "second"):
        run_command("note", store.path, "FIC0000", text, "--owner", "a")
    assert next(r for r in listed(store) if r["loop"] == "FIC0000")["note"].startswith("second")
    assert [line.split()[0] for line in run_command("note", store.path, "FIC0000").stdout.splitlines()] == [
        "first",
        "second",
    ]


def test_a_hidden_loop_comes_back(store: Store) -> None:
    """A hidden loop is missing from table and summary before its date and shown from that night on; the CSV always
    has it.
    """
    first = listed(store)[0]["loop"]
    run_command("note", store.path, first, "waits for the shutdown", "--hide-until", "2026-03-05")
    table = run_command("rank", store.path, "--wide")
    assert f"hidden by their notes (--all shows them): {first}" in table.stderr
    assert listed(store)[0]["loop"] == first
    assert first in run_command("rank", store.path, "--wide", "--all").stdout
    run_command("note", store.path, first, "waits for the shutdown", "--hide-until", "2026-03-04")
    assert run_command("rank", store.path, "--wide").stderr == ""


def test_hidden_loops_do_not_shorten_the_list(store: Store) -> None:
    """--top 3 shows three loops although the first loop is hidden."""
    order = [r["loop"] for r in listed(store)]
    run_command("note", store.path, order[0], "later", "--hide-until", "2030-01-01")
    shown = run_command("rank", store.path, "--top", "3", "--format", "markdown").stdout.splitlines()[2:]
    assert len(shown) == 3


@pytest.mark.parametrize(
    ("loop", "text", "fragment"),
    [
        ("FIC000", "x", "one of its loops (FIC"),
        ("FIC0000", "   ", "an empty note"),
        ("nothing", "x", "is not in"),
    ],
)
def test_mistakes_are_one_line(store: Store, loop: str, text: str, fragment: str) -> None:
    """An unknown loop and an empty note are reported in one line, and no note is written."""
    result = run_command("note", store.path, loop, text)
    assert result.exit_code == 2
    assert fragment in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert not (store.path / notes.FILE).exists()


def test_many_writers_lose_no_note(tmp_path: Path) -> None:
    """Forty notes that eight threads write at once are all stored completely."""

    def write(k: int) -> None:
        notes.add(tmp_path, notes.Note("L", float(k), "x" * 200 + str(k), "me"))

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, range(40)))
    assert [n.time_s for n in notes.read_notes(tmp_path)["L"]] == [float(k) for k in range(40)]


def test_a_broken_line_loses_only_itself(tmp_path: Path) -> None:
    """Half a line after a crash of a computer is skipped; the notes around it are kept."""
    notes.add(tmp_path, notes.Note("L", 1.0, "one"))
    with (tmp_path / notes.FILE).open("a", encoding="utf-8") as file:
        file.write('{"loop": "L", "ti\n[]\n')
    notes.add(tmp_path, notes.Note("L", 2.0, "two"))
    assert [n.text for n in notes.read_notes(tmp_path)["L"]] == ["one", "two"]


def test_half_a_line_does_not_lose_the_next_note(tmp_path: Path) -> None:
    """Half a line at the end, as after a full disk, is lost, and the next note is not."""
    (tmp_path / notes.FILE).write_text('{"loop": "L", "time_s": 1.0, "te', encoding="utf-8")
    notes.add(tmp_path, notes.Note("L", 2.0, "two"))
    assert [n.text for n in notes.read_notes(tmp_path)["L"]] == ["two"]


@pytest.mark.parametrize(
    "line",
    [
        '{"loop": "L", "time_s": "1", "text": 3}',
        '{"loop": ["L"], "time_s": 1.0, "text": "x"}',
        '{"loop": "L", "time_s": 1e400, "text": "x"}',
        '{"loop": "L", "time_s": NaN, "text": "x"}',
        '{"loop": "L", "time_s": null, "text": "x"}',
        '{"loop": "L", "time_s": 1.0, "text": "x", "hidden_until": 20300101}',
        '{"loop": "L"}',
        "[1, 2]",
        "null",
        "[" * 100_000,
    ],
)
def test_a_line_without_a_note_is_skipped(tmp_path: Path, line: str) -> None:
    """JSON lines that are not notes are skipped, and no other note is lost."""
    (tmp_path / notes.FILE).write_text(line + "\n", encoding="utf-8")
    notes.add(tmp_path, notes.Note("L", 2.0, "two"))
    assert {k: [n.text for n in own] for k, own in notes.read_notes(tmp_path).items()} == {"L": ["two"]}


def test_a_note_does_not_control_the_terminal(tmp_path: Path) -> None:
    """Escape sequences and bidirectional marks are shown as escapes, both from the command line and from the file."""
    assert notes.new("L", "a\x1b[2Jb\u202ec", "me", "").text == r"a\x1b[2Jb\u202ec"
    notes.add(tmp_path, notes.Note("L", 1.0, "a\x1b]0;b\u2066", "m\x07e"))
    (found,) = notes.read_notes(tmp_path)["L"]
    assert (found.text, found.owner) == (r"a\x1b]0;b\u2066", r"m\x07e")


@pytest.mark.parametrize("form", ["text", "html", "markdown"])
def test_the_summary_is_small_and_agrees_with_the_list(store: Store, form: str) -> None:
    """The summary fits one screen in three formats and names the worst loop; a mail has no scripts and less than 100
    kB.
    """
    result = run_command("summary", store.path, "--format", form)
    assert result.exit_code == 0
    assert len(result.stdout.encode()) < 100_000
    worst = next(r["loop"] for r in listed(store) if r["loop"].startswith("FIC"))
    assert worst in result.stdout
    assert "<script" not in result.stdout.lower().replace("&lt;script", "").replace("<script>alert", "")
    if form == "html":
        assert "<script" not in result.stdout.lower()
        assert "src=" not in result.stdout
        assert "href=" not in result.stdout
