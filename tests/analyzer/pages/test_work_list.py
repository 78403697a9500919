"""The work list: what notes say of the work on a loop, and what the nights since say of it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.pages.reading import read_night
from analyzer.pages.work import said_since, sides, work_page
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


def test_each_part_of_the_work_is_as_the_newest_note_says_that_speaks_of_it() -> None:
    """A note without a state leaves the state, and the day on which it was reached, as they were."""
    told = [
        Note("A", 1.0, "seen", "Laine"),
        Note("A", 2.0, "ordered", "Berg", "", "ordered", "2026-04-01"),
        Note("A", 3.0, "packing came"),
    ]
    work = work_on(told)
    assert (work.note.text, work.owner, work.state, work.since_s, work.due) == (
        "packing came",
        "Berg",
        "ordered",
        2.0,
        "2026-04-01",
    )
    assert work_on(told[:1]).state == "open"


def test_work_that_is_checked_is_done_since_it_was_done() -> None:
    """A check a week later does not part the nights anew; work that is opened again and done is done since then."""
    states = ("open", "done", "checked", "open", "done")
    told = [Note("A", float(k), s, "", "", s) for k, s in enumerate(states)]
    assert [(work_on(told[: k + 1]).state, work_on(told[: k + 1]).since_s) for k in range(5)] == [
        *(("open", 0.0), ("done", 1.0), ("checked", 1.0), ("open", 3.0), ("done", 4.0)),
    ]


def night(name: str, oscillating: float, error: float) -> dict[str, object]:
    """One night of a loop."""
    figures = {"average_absolute_error_pct": error, "valve_travel_pct_per_h": 10.0 * error, "loss": error}
    return {"night": name, "status": "ok", "oscillating_pct": oscillating, **figures}


def test_the_nights_since_are_held_against_those_before() -> None:
    """The day of the work is on neither side; half the error and a cycle that is gone are told in figures."""
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
    said = said_since(done, both)
    assert (
        said == "2 nights: no longer oscillates, average absolute error \u221250 %, valve travel \u221250 %"
    )
    assert said_since(work_on([Note("A", 1.0, "seen")]), both) == ""
    assert said_since(done, sides(rows[:3], "2026-03-04")) == "no night since"


def test_the_page_lists_what_waits_before_what_is_done_and_says_what_was_won(store: Store) -> None:
    """What is overdue is coloured, what is done stands last with its nights, and its gain is summed up."""
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


def test_state_and_due_date_are_kept_by_the_command(store: Store, tmp_path: Path) -> None:
    """`note` with a state alone says the state; the pages' list has it, and so has its CSV."""
    run = CliRunner()
    path = str(store.path)
    asked = run.invoke(
        main, ["note", path, "FIC0001", "--state", "ordered", "--due", "2026-04-01", "--owner", "me"]
    )
    assert asked.exit_code == 0
    assert "ordered, due 2026-04-01" in asked.stdout
    assert run.invoke(main, ["note", path, "FIC0001", "--state", "lost"]).exit_code == 2
    run.invoke(main, ["pages", path, "--out", str(tmp_path / "out")])
    text = (tmp_path / "out" / "csv" / "work-work-list.csv").read_text("utf-8")
    assert "FIC0001" in text
    assert "2026-04-01" in text
