"""Workbooks are read as the tables of their sheets; an unreadable workbook gives one line."""

from __future__ import annotations

import datetime as dt
import io
import random
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from workbooks import binary_book, open_book, open_row, record

from analyzer.cli import main
from analyzer.history import cell_spread
from analyzer.history.cell_spread import require_dense
from analyzer.history.export import open_export
from analyzer.history.table import ReadOptions
from identification.errors import InputError

openpyxl = pytest.importorskip("openpyxl")
BEGIN = dt.datetime(2026, 3, 2)
N = 400
PV = np.round(50 + np.sin(np.arange(N) / 9), 3)
OP = np.round(40 + np.cos(np.arange(N) / 9), 3)
STAMPS = [BEGIN + dt.timedelta(seconds=5 * k) for k in range(N)]


def write(path: Path, sheets: dict[str, list[list[object]]]) -> Path:
    """A workbook with the given sheets."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


def wide(loop: str, pv: np.ndarray = PV) -> list[list[object]]:
    """A title, a line of tags, and samples with one column for each tag."""
    rows = [[t, float(p), float(o)] for t, p, o in zip(STAMPS, pv, OP, strict=True)]
    return [["Trend report"], ["Time", f"{loop}.PV", f"{loop}.OP"], *rows]


def test_a_wide_sheet_reads_as_its_cells(tmp_path):
    """Stamps that are stored as dates and values that are stored as numbers are read unchanged."""
    found = open_export([write(tmp_path / "day.xlsx", {"Data": wide("FIC1")})])
    assert found.tags == ("FIC1.PV", "FIC1.OP")
    series = found.read(["FIC1.PV"])["FIC1.PV"]
    np.testing.assert_allclose(series.value, PV)
    begin = BEGIN.replace(tzinfo=dt.UTC).timestamp()
    np.testing.assert_allclose(series.stamp_s, begin + 5 * np.arange(N))


def test_serial_days_without_a_format_are_stamps(tmp_path):
    """Cells with days since 1899-12-30 as numbers are read as those days."""
    first = (BEGIN - dt.datetime(1899, 12, 30)).days
    rows = [["Time", "FIC1.PV", "FIC1.OP"]]
    rows += [[first + 5 * k / 86400, float(PV[k]), float(OP[k])] for k in range(N)]
    series = open_export([write(tmp_path / "day.xlsx", {"Data": rows})]).read(["FIC1.PV"])["FIC1.PV"]
    begin = BEGIN.replace(tzinfo=dt.UTC).timestamp()
    np.testing.assert_allclose(series.stamp_s, begin + 5 * np.arange(N), atol=0.01)


def test_binary_and_open_workbooks_read_as_their_cells(tmp_path):
    """A sheet of an xlsb or ods workbook, written by its own specification, is read as a sheet of xlsx."""
    first = (BEGIN - dt.datetime(1899, 12, 30)).days
    head = ["Time", "FIC1.PV", "FIC1.OP"]
    rows = [head, *([first + 5 * k / 86400, float(PV[k]), float(OP[k])] for k in range(N))]
    cells = [(r, c, value) for r, row in enumerate(rows) for c, value in enumerate(row)]
    (tmp_path / "day.xlsb").write_bytes(binary_book(cells))
    (tmp_path / "day.ods").write_bytes(open_book("".join(open_row(*row) for row in rows)))
    for name in ("day.xlsb", "day.ods"):
        series = open_export([tmp_path / name]).read(["FIC1.PV"])["FIC1.PV"]
        np.testing.assert_allclose(series.value, PV)
        np.testing.assert_allclose(
            series.stamp_s, BEGIN.replace(tzinfo=dt.UTC).timestamp() + 5 * np.arange(N), atol=0.01
        )


@pytest.mark.parametrize("far", [(9, 20), (199_999, 2000)])
def test_a_stray_cell_is_named_if_it_makes_a_sheet_huge(tmp_path, far):
    """A stray cell near a small table is ignored; one that extends the sheet to 400 million cells is refused with its
    name.
    """
    row, column = far
    table = [(r, c, float(10 * r + c)) for r in range(5) for c in range(3)]
    rows = "".join(open_row(*(float(10 * r + c) for c in range(3))) for r in range(5))
    books = {
        "x.xlsb": binary_book([*table, (row, column, 7.0)]),
        "x.ods": open_book(rows + open_row(1, times=row - 5) + open_row(column, 7.0)),
    }
    for name, data in books.items():
        (tmp_path / name).write_bytes(data)
        with zipfile.ZipFile(tmp_path / name) as archive:
            members = archive.infolist()
        if row < 100:
            require_dense(tmp_path / name, members)
        else:
            with pytest.raises(InputError, match="16 cells that span 400200000, as far as cell BXY200000"):
                require_dense(tmp_path / name, members)


@pytest.mark.parametrize("block", [11, 64, 1000])
def test_records_of_a_binary_sheet_are_found_for_any_block_size(monkeypatch, block):
    """Kinds and first numbers of records are found for any block size of reading."""
    rng = random.Random(block)
    wrote = [(rng.randrange(16_384), rng.randbytes(rng.choice([4, 8, 130, 5000]))) for _ in range(40)]
    monkeypatch.setattr(cell_spread, "BLOCK_BYTES", block)
    found = cell_spread._records(io.BytesIO(b"".join(record(kind, data) for kind, data in wrote)))
    assert list(found) == [(kind, int.from_bytes(data[:4], "little")) for kind, data in wrote]


def test_a_long_sheet_reads_with_its_quality(tmp_path):
    """With tag, time, value and quality in rows, bad samples are bad and texts are no values."""
    rows: list[list[object]] = [["TagName", "Timestamp", "Value", "Quality"]]
    for k, t in enumerate(STAMPS):
        rows.append(["FIC1.PV", t, float(PV[k]), "Bad" if k == 7 else "Good"])
        rows.append(["FIC1.OP", t, "No Data" if k == 9 else float(OP[k]), "Good"])
    found = open_export([write(tmp_path / "day.xlsx", {"Export": rows})]).read(["FIC1.PV", "FIC1.OP"])
    assert np.flatnonzero(found["FIC1.PV"].bad).tolist() == [7]
    assert np.flatnonzero(found["FIC1.OP"].bad | ~np.isfinite(found["FIC1.OP"].value)).tolist() == [9]


def test_sheets_are_separate_tables_and_a_cover_is_left_out(tmp_path):
    """Two sheets of two loops are both read; a sheet of prose and an empty one are left out, and the prose is
    reported.
    """
    prose = [["About", "this"], ["made for", "the day shift"], ["by", "hand"]]
    sheets = {"Cover": prose, "FIC1": wide("FIC1"), "Empty": [], "FIC2": wide("FIC2", PV + 1)}
    found = open_export([write(tmp_path / "day.xlsx", sheets)])
    assert set(found.tags) == {"FIC1.PV", "FIC1.OP", "FIC2.PV", "FIC2.OP"}
    np.testing.assert_allclose(found.read(["FIC2.PV"])["FIC2.PV"].value, PV + 1)
    assert any("left out" in note and "Cover" in note for note in found.file_notes)


def test_a_folder_of_workbooks_is_an_export(tmp_path):
    """A folder with one workbook for each loop, and the lock file of an open one, is read as one export."""
    for loop in ("FIC1", "FIC2"):
        write(tmp_path / f"{loop}.xlsx", {"Data": wide(loop)})
    (tmp_path / "~$FIC1.xlsx").write_bytes(b"\x00")
    assert len(open_export([tmp_path]).tags) == 4


def test_a_night_runs_on_a_workbook(tmp_path):
    """`triage run` assesses the loops of a workbook as those of other exports."""
    path = write(tmp_path / "day.xlsx", {"Data": wide("FIC1")})
    done = CliRunner().invoke(main, ["run", str(path), "--store", str(tmp_path / "store")])
    assert done.exit_code == 0, done.output
    assert "1 of 1 loops assessed" in done.output


def test_text_with_the_name_of_a_workbook_is_read_as_text(tmp_path):
    """A text file with the ending xls is read as text: the content decides."""
    lines = [f"{t.isoformat(sep=' ')}\t{p}\t{o}" for t, p, o in zip(STAMPS, PV, OP, strict=True)]
    path = tmp_path / "report.xls"
    path.write_text("Time\tFIC1.PV\tFIC1.OP\n" + "\n".join(lines) + "\n")
    np.testing.assert_allclose(open_export([path]).read(["FIC1.PV"])["FIC1.PV"].value, PV)


def test_damage_is_one_line(tmp_path):
    """A truncated workbook, a file that is no workbook, and a workbook without a table each give one line with a
    remedy.
    """
    whole = write(tmp_path / "whole.xlsx", {"Data": wide("FIC1")}).read_bytes()
    (tmp_path / "cut.xlsx").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "none.xlsx").write_bytes(b"hello, world")
    (tmp_path / "list.xlsx").write_bytes(whole.replace(b"PK\x01\x02", b"PK\x09\x02"))
    (tmp_path / "old.xls").write_bytes(b"\xd0\xcf\x11\xe0" + bytes(3000))
    write(tmp_path / "prose.xlsx", {"A": [["just a word"]]})
    for name in ("cut.xlsx", "list.xlsx", "none.xlsx", "old.xls", "prose.xlsx"):
        done = CliRunner().invoke(main, ["check", str(tmp_path / name)])
        assert done.exit_code == 2, name
        assert done.stderr.count("\n") == 1, done.stderr
        assert name in done.stderr
        assert "Traceback" not in done.output


def test_a_bomb_is_refused_by_its_declared_size(tmp_path):
    """A workbook with a sheet that unpacks to 300 MB is not unpacked."""
    path = tmp_path / "bomb.xlsx"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/worksheets/sheet1.xml", bytes(300_000_000))
    with pytest.raises(InputError, match="unpack to more than"):
        open_export([path], ReadOptions(scratch=tmp_path))


def test_without_the_extra_the_line_says_how_to_install_it(tmp_path, monkeypatch):
    """If the package that reads workbooks is missing, the line names the extra and CSV as an alternative."""
    path = write(tmp_path / "day.xlsx", {"Data": wide("FIC1")})
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(InputError, match=r"loop-triage\[excel\].*save the sheet as CSV"):
        open_export([path])
