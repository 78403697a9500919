"""The content of an export is read or reported: nothing is lost silently."""

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
    """Lines of samples a minute apart, with another date format in each part."""
    stamps = [START + timedelta(minutes=k) for k in range(n)]
    return [f"{t.strftime(formats[k * len(formats) // n])},{k}" for k, t in enumerate(stamps)]


@pytest.mark.parametrize("formats", [FORMATS, FORMATS[::-1], (FORMATS[0], "%m/%d/%Y %H:%M:%S")])
def test_several_date_formats_lose_no_sample(tmp_path: Path, formats: tuple[str, ...]) -> None:
    """In a file with several date formats, the order of day and month is the one without a jump in time."""
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
def test_a_preamble_above_the_header_is_skipped(tmp_path: Path, above: str) -> None:
    """Lines as wide as the table, even with dates, do not replace the header that follows."""
    path = tmp_path / "preamble.csv"
    path.write_text(above + "timestamp,FIC1.PV\n" + "\n".join(rows(FORMATS[:1])) + "\n", encoding="utf-8")
    found = open_export([path])
    assert found.tags == ("FIC1.PV",)
    assert found.read(["FIC1.PV"])["FIC1.PV"].value.size == 300


def test_packed_files_in_a_folder_are_reported(tmp_path: Path) -> None:
    """7z files in a folder with a CSV are named as not read; a folder without other files is refused with their
    names.
    """
    (tmp_path / "more.csv.7z").write_bytes(b"7z\xbc\xaf")
    (tmp_path / "rest.7z").write_bytes(b"7z\xbc\xaf")
    refused = CliRunner().invoke(main, ["check", str(tmp_path)])
    assert refused.exit_code == 2
    assert "more.csv.7z, rest.7z not read: unpack it" in refused.stderr
    (tmp_path / "a.csv").write_text("timestamp,FIC1.PV\n" + "\n".join(rows(FORMATS[:1])), encoding="utf-8")
    notes = [str(note) for note in open_export([tmp_path]).file_notes]
    assert any("more.csv.7z, rest.7z not read" in note for note in notes)


def test_check_without_loops_is_no_success(tmp_path: Path) -> None:
    """For an export without a loop, `check` ends with 2 and one line that says how to name loops."""
    path = tmp_path / "x.csv"
    path.write_text("timestamp,a,b\n2026-03-02 00:00:00,1,2\n2026-03-02 00:00:01,1,2\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["check", str(path)])
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [
        "triage: no loops in the export, whose tags are a, b; expected tags such as LOOP.PV; "
        "let 'triage loops' look for them in the data, or state them with --loops loops.csv"
    ]
