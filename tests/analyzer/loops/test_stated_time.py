"""A written time has one meaning or is refused; an ambiguous date is never read silently."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from analyzer.history.stamps import parse_time
from analyzer.loops.changes import read_changes
from identification.errors import InputError
from tests.steps import steps


def at(text: str) -> float:
    """A UTC time [s]."""
    return datetime.fromisoformat(text).replace(tzinfo=UTC).timestamp()


@pytest.mark.parametrize(
    ("text", "utc"),
    [
        ("2026-05-12", "2026-05-12"),
        ("12.5.2026", "2026-05-12"),
        ("13.5.2026", "2026-05-13"),
        ("01.05.2026 08:00", "2026-05-01T08:00"),
        ("13/05/2026 08:00", "2026-05-13T08:00"),
        ("05/13/2026 08:00 PM", "2026-05-13T20:00"),
        ("12-May-26 08:00:00", "2026-05-12T08:00"),
        ("May 12, 2026", "2026-05-12"),
        ("2026-05-12T08:00:00Z", "2026-05-12T08:00"),
        ("2026-05-12 08:00:00+02:00", "2026-05-12T06:00"),
        ("20260512 080000", "2026-05-12T08:00"),
    ],
)
def test_an_unambiguous_time_is_read(text: str, utc: str) -> None:
    """ISO dates, month names and days above twelve are unambiguous; dates with points have the day first."""
    assert parse_time(text, "here") == at(utc)


@pytest.mark.parametrize("text", ["05/12/2026", "5/12/2026 08:00", "05-12-2026", "10-11-12"])
def test_an_ambiguous_date_is_refused(text: str) -> None:
    """A date that fits both orders is refused unless the order is stated."""
    with pytest.raises(InputError, match="reads two ways"):
        parse_time(text, "here")
    first, second = parse_time(text, "here", day_first=True), parse_time(text, "here", day_first=False)
    assert first != second


@pytest.mark.parametrize(
    "text",
    [
        *(
            "now",
            "today",
            "10:00",
            "March",
            "5s",
            "1,5",
            "1.000,5",
            "2026",
            "",
            "-0",
            "31.02.2026",
            "0001-01-01",
        ),
        *("9999-12-31", "1601-01-01", "8:00 9.3.2026", "x" * 100_000, "\u202e2026-05-12"),
    ],
)
def test_an_invalid_time_is_refused(text: str) -> None:
    """Words, numbers, times without a day, and years far from the present give one short line."""
    with pytest.raises(InputError) as error:
        parse_time(text, "changes.csv, row 2")
    assert len(str(error.value)) < 200


def test_changes_are_read_in_one_order(tmp_path: Path) -> None:
    """In a file of changes, dates with points have the day first in each row; dates with slashes need a stated
    order.
    """
    path = tmp_path / "changes.csv"
    path.write_text("loop;time\nA;12.5.2026\nB;13.5.2026\n")
    assert [c.time_s for c in read_changes(path)] == [at("2026-05-12"), at("2026-05-13")]
    path.write_text("loop;time\nA;12/5/2026\n")
    with pytest.raises(InputError, match="row 2"):
        read_changes(path)
    assert [c.time_s for c in read_changes(path, day_first=True)] == [at("2026-05-12")]


def test_rows_of_changes_are_counted_as_an_editor_does(tmp_path: Path) -> None:
    """Blank lines and comments are no changes, but they count in the row number of an error."""
    path = tmp_path / "changes.csv"
    path.write_text("loop,time\n\n# tuned in May\nA,2026-05-12\n\nB,soon\n")
    with pytest.raises(InputError, match="row 6: time 'soon'"):
        read_changes(path)


@pytest.mark.parametrize("time", ["25:00", "24:01", "12:61", "12:00:61", "12:00+99:00", "13:00 AM"])
def test_an_impossible_time_of_day_is_refused(tmp_path: Path, time: str) -> None:
    """An impossible time of day is reported in one line with file and row, and is not moved to another hour or
    day.
    """
    path = tmp_path / "changes.csv"
    path.write_text(f"loop,time\nA,2026-03-04 08:00\n,\nB,2026-03-04 {time}\n")
    with pytest.raises(InputError, match=r"changes\.csv, row 4: time "):
        read_changes(path)


def test_many_changes_are_read_as_one_table(tmp_path: Path) -> None:
    """Each of 20,000 rows is read as it is read alone, with at most 60 calls a row."""
    shown = (
        "2026-03-{d:02d} 0{h}:00",
        "{d:02d}.03.2026 0{h}:00",
        "2026-03-{d:02d}T0{h}:00+02:00",
        "Mar {d} 2026 0{h}:00",
    )
    texts = [shown[k % 4].format(d=1 + k % 28, h=k % 10) for k in range(20_000)]
    path = tmp_path / "changes.csv"
    path.write_text("loop,time\n" + "".join(f"A,{text}\n" for text in texts))
    found: list[float] = []
    taken = steps(lambda: found.extend(change.time_s for change in read_changes(path, "Europe/Helsinki")))
    assert taken < 60 * len(texts)
    some = range(0, 20_000, 997)
    assert [found[k] for k in some] == [parse_time(texts[k], "here", "Europe/Helsinki") for k in some]
    assert found[0] == at("2026-02-28T22:00:00")
