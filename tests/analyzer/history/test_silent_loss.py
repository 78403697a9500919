"""What exports hold is read or told: nothing goes without a word."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.history.export import open_export

START = datetime(2026, 3, 2)
FORMATS = ("%Y-%m-%d %H:%M:%S", "%d/%m/%Y %H:%M:%S", "%d-%b-%y %H:%M:%S")


def rows(formats: tuple[str, ...], n: int = 300) -> list[str]:
    """Lines of samples a minute apart, each third written otherwise."""
    stamps = [START + timedelta(minutes=k) for k in range(n)]
    return [f"{t.strftime(formats[k * len(formats) // n])},{k}" for k, t in enumerate(stamps)]


@pytest.mark.parametrize("formats", [FORMATS, FORMATS[::-1], (FORMATS[0], "%m/%d/%Y %H:%M:%S")])
def test_several_ways_of_writing_dates_lose_nothing(tmp_path: Path, formats: tuple[str, ...]) -> None:
    """ISO first and 02/03/2026 after it: the order of day and month is the one that leaves no leap in time."""
    path = tmp_path / "mixed.csv"
    path.write_text("timestamp,FIC1.PV\n" + "\n".join(rows(formats)) + "\n", encoding="utf-8")
    found = open_export([path]).read(["FIC1.PV"])["FIC1.PV"]
    assert found.value.size == 300
    assert found.stamp_s[0] == START.replace(tzinfo=UTC).timestamp()
    assert set(found.stamp_s[1:] - found.stamp_s[:-1]) == {60.0}


@pytest.mark.parametrize(
    "above",
    [
        "Historian export,2026-03-02\nServer,PI01\n",
        "Period,2026-03-02 00:00:00\nTag,Description\n\n",
        "# made by X\n2026-03-02,2026-03-03\n",
    ],
)
def test_a_preamble_above_the_header_is_passed_over(tmp_path: Path, above: str) -> None:
    """Lines as wide as the table, even with dates in them, do not take the place of the header below."""
    path = tmp_path / "preamble.csv"
    path.write_text(above + "timestamp,FIC1.PV\n" + "\n".join(rows(FORMATS[:1])) + "\n", encoding="utf-8")
    found = open_export([path])
    assert found.tags == ("FIC1.PV",)
    assert found.read(["FIC1.PV"])["FIC1.PV"].value.size == 300


def test_packed_files_in_a_folder_are_told(tmp_path: Path) -> None:
    """A folder's 7z beside its CSV are named as not read; a folder of nothing else is refused by name."""
    (tmp_path / "more.csv.7z").write_bytes(b"7z\xbc\xaf")
    (tmp_path / "rest.7z").write_bytes(b"7z\xbc\xaf")
    refused = CliRunner().invoke(main, ["check", str(tmp_path)])
    assert refused.exit_code == 2
    assert "more.csv.7z, rest.7z not read: unpack it" in refused.stderr
    (tmp_path / "a.csv").write_text("timestamp,FIC1.PV\n" + "\n".join(rows(FORMATS[:1])), encoding="utf-8")
    told = [str(note) for note in open_export([tmp_path]).file_notes]
    assert any("more.csv.7z, rest.7z not read" in note for note in told)


def test_check_without_loops_is_no_success(tmp_path: Path) -> None:
    """An export in which no loop is found ends `check` with 2 and one line that says how to name them."""
    path = tmp_path / "x.csv"
    path.write_text("timestamp,a,b\n2026-03-02 00:00:00,1,2\n2026-03-02 00:00:01,1,2\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["check", str(path)])
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [
        "triage: no loops in the export, whose tags are a, b; expected tags such as LOOP.PV; "
        "let 'triage loops' look for them in the data, or state them with --loops loops.csv"
    ]
