"""The work list: the state of the work on a loop from its notes, and the result of the nights since the work."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.pages.reading import read_night
from analyzer.pages.work import result_since, sides, work_page
from analyzer.store import notes
from analyzer.store.notes import Note, work_on
from analyzer.store.store import Store
from reports.pages import Tiles
from tests.reports.small_store import small_store


@pytest.fixture
def store(tmp_path: Path) -> Store:
    """Fourteen nights of twelve loops, from 2026-03-02 on."""
    return small_store(tmp_path / "store", loops=12, nights=14)


def at(day: str) -> float:
    """Noon of a day [s]."""
    return datetime.fromisoformat(f"{day}T12:00:00").replace(tzinfo=UTC).timestamp()


def test_each_part_of_the_work_is_that_of_the_newest_note_with_this_part() -> None:
    """A note without a state changes neither the state nor the day on which it was reached."""
    given_notes = [
        Note("A", 1.0, "seen", "Laine"),
        Note("A", 2.0, "ordered", "Berg", "", "ordered", "2026-04-01"),
        Note("A", 3.0, "packing came"),
    ]
    work = work_on(given_notes)
    assert (work.note.text, work.owner, work.state, work.since_s, work.due) == (
        "packing came",
        "Berg",
        "ordered",
        2.0,
        "2026-04-01",
    )
    assert work_on(given_notes[:1]).state == "open"


def test_checked_work_keeps_the_day_on_which_it_was_done() -> None:
    """A check a week later does not change the day of the work; work that is opened again and done counts from
    then.
    """
    states = ("open", "done", "checked", "open", "done")
    given_notes = [Note("A", float(k), s, "", "", s) for k, s in enumerate(states)]
    assert [
        (work_on(given_notes[: k + 1]).state, work_on(given_notes[: k + 1]).since_s) for k in range(5)
    ] == [
        *(("open", 0.0), ("done", 1.0), ("checked", 1.0), ("open", 3.0), ("done", 4.0)),
    ]


def night(name: str, oscillating: float, error: float) -> dict[str, object]:
    """One night of a loop."""
    figures = {"average_absolute_error_pct": error, "valve_travel_pct_per_h": 10.0 * error, "loss": error}
    return {"night": name, "status": "ok", "oscillating_pct": oscillating, **figures}


def test_the_nights_since_are_compared_with_those_before() -> None:
    """The day of the work belongs to neither side; half the error and the end of the cycle are given in figures."""
    rows = [night(f"2026-03-0{d}", 90.0, 2.0) for d in (2, 3, 4)] + [
        night(f"2026-03-0{d}", 0.0, 1.0) for d in (5, 6)
    ]
    done = work_on([Note("A", at("2026-03-04"), "new packing", "Laine", "", "done")])
    both = sides(rows, "2026-03-04")
    assert [r["night"] for r in (*both.before, *both.since)] == [
        "2026-03-02",
        "2026-03-03",
        "2026-03-05",
        "2026-03-06",
    ]
    text = result_since(done, both)
    assert (
        text == "2 nights: no longer oscillates, average absolute error \u221250 %, valve travel \u221250 %"
    )
    assert result_since(work_on([Note("A", 1.0, "seen")]), both) == ""
    assert result_since(done, sides(rows[:3], "2026-03-04")) == "no night since"


def test_the_page_lists_open_work_before_finished_work_with_its_gain(store: Store) -> None:
    """Overdue work is coloured, finished work comes last with its nights, and its gain is summed."""
    for note in (
        Note("FIC0001", at("2026-03-08"), "stroked, packing changed", "Laine", "", "done"),
        Note("FIC0002", at("2026-03-09"), "to be stroked", "Berg", "", "open", "2026-03-10"),
    ):
        notes.add(store.path, note)
    found = work_page(store, read_night(store, None, 50))
    table = found.tables()[0]
    keys = [c.key for c in table.columns]
    first, last = (dict(zip(keys, row, strict=True)) for row in table.rows)
    assert (first["loop"].text, first["state"].text, first["due"].kind) == ("FIC0002", "open", "worse")
    assert (last["loop"].text, last["owner"].text) == ("FIC0001", "Laine")
    assert last["since"].text.startswith("7 nights")
    tiles = [b for s in found.sections for b in s.blocks if isinstance(b, Tiles)]
    rows = [
        store.rows("nights", n, ["loop", "average_absolute_error_pct"], ["FIC0001"]) for n in store.nights()
    ]
    error = [r[0]["average_absolute_error_pct"] for r in rows]
    before, since = sum(error[:6]) / 6, sum(error[7:]) / 7
    assert tiles[0].items[0][0] == f"{100 * (since / before - 1):+.0f} %".replace("-", "\u2212")


def test_state_and_due_date_are_stored_by_the_command(store: Store, tmp_path: Path) -> None:
    """`note` with a state alone prints the state; the list of the pages and its CSV contain it."""
    run = CliRunner()
    path = str(store.path)
    result = run.invoke(
        main, ["note", path, "FIC0001", "--state", "ordered", "--due", "2026-04-01", "--owner", "me"]
    )
    assert result.exit_code == 0
    assert "ordered, due 2026-04-01" in result.stdout
    assert run.invoke(main, ["note", path, "FIC0001", "--state", "lost"]).exit_code == 2
    run.invoke(main, ["pages", path, "--out", str(tmp_path / "out")])
    text = (tmp_path / "out" / "csv" / "work-work-list.csv").read_text("utf-8")
    assert "FIC0001" in text
    assert "2026-04-01" in text
