"""Special samples: error texts, blanks, modes, quality codes, repeated stamps, local time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analyzer.history.export import Export, ReadOptions, open_export
from analyzer.history.series import Series

ERROR_TEXTS = (
    "I/O Timeout", "Bad Input", "No Data", "Pt Created", "Scan Off", "Calc Failed", "#N/A", "1.#QNAN",
    "????????", "[-11059] No Good Data For Calculation", "Resize to show all values",
)  # fmt: skip


def read(path: Path, text: str, options: ReadOptions | None = None) -> tuple[Export, Series]:
    """The only tag, or FIC1.PV, of a delimited text."""
    path.write_text(text)
    export = open_export([path], options or ReadOptions())
    tag = "FIC1.PV" if "FIC1.PV" in export.tags else export.tags[0]
    return export, export.read([tag])[tag]


def wide(cells: list[str]) -> str:
    rows = [f"2024-11-21 08:00:{i:02d},{cell}" for i, cell in enumerate(cells)]
    return "\n".join(["timestamp,FIC1.PV", *rows]) + "\n"


def long(cells: list[tuple[str, str]], quality: str) -> str:
    rows = [f"FIC1.PV,2024-11-21 08:00:{i:02d},{value},{code}" for i, (value, code) in enumerate(cells)]
    return "\n".join([f"tag,time,value,{quality}", *rows]) + "\n"


@pytest.mark.parametrize("text", ERROR_TEXTS)
def test_error_texts_among_numbers(tmp_path: Path, text: str) -> None:
    """An error text of a historian among numbers is a bad sample without a value, and is counted."""
    export, series = read(tmp_path / "x.csv", wide(["1.5", text, text, "2.5"]))
    assert series.text is None
    assert series.bad.tolist() == [False, True, True, False]
    assert np.isnan(series.value[1:3]).all()
    assert series.value[[0, 3]].tolist() == [1.5, 2.5]
    assert any(note.startswith("2 ") and text in note for note in export.notes)


def test_mostly_error_texts_are_no_mode(tmp_path: Path) -> None:
    """A tag with error texts most of the time has bad numbers and is no text tag."""
    _, series = read(tmp_path / "x.csv", wide(["Bad Input"] * 8 + ["3"]))
    assert series.text is None
    assert series.bad.tolist() == [True] * 8 + [False]


def test_blanks_are_no_values(tmp_path: Path) -> None:
    """A blank cell is a bad sample without a value; the note mentions reporting by exception."""
    export, series = read(tmp_path / "x.csv", "timestamp,FIC1.PV,FIC1.OP\n2024-01-01,1,2\n2024-01-02,,3\n")
    assert series.bad.tolist() == [False, True]
    assert any("1 cells are blank" in note and "exception" in note for note in export.notes)


def test_modes_are_texts(tmp_path: Path) -> None:
    """A text tag keeps its texts; only blanks and error texts are bad."""
    _, series = read(tmp_path / "x.csv", wide(["AUTO", "MAN", "I/O Timeout", "AUTO"]))
    assert series.text is not None
    assert series.text.tolist() == ["AUTO", "MAN", "I/O Timeout", "AUTO"]
    assert series.bad.tolist() == [False, False, True, False]
    assert np.isnan(series.value).all()


def test_a_stray_word_among_numbers(tmp_path: Path) -> None:
    """An unknown word among numbers is bad and counted too."""
    export, series = read(tmp_path / "x.csv", wide(["1", "2", "Kaputt", "4"]))
    assert series.bad.tolist() == [False, False, True, False]
    assert any("'Kaputt'" in note for note in export.notes)


@pytest.mark.parametrize(
    ("column", "codes", "bad"),
    [
        ("quality", ["Good", "Bad", "good", "Uncertain"], [False, True, False, True]),
        ("Quality", ["192", "0", "216", "64"], [False, True, False, True]),
        ("quality", ["131264", "192", "24", "192"], [False, False, True, False]),
        ("status", ["0", "2147483648", "0", "1073741824"], [False, True, False, True]),
        ("status", ["0", "-2147483648", "0", "0"], [False, True, False, False]),
        ("confidence", ["100", "49", "50", "0"], [False, True, False, True]),
        ("quality", ["100", "49", "50", "0"], [False, True, False, True]),
        ("quality", ["0", "0", "0", "0"], [False] * 4),
        ("quality", ["192", "", "192", "192"], [False, True, False, False]),
    ],
)
def test_quality_codes(tmp_path: Path, column: str, codes: list[str], bad: list[bool]) -> None:
    """The codes that occur distinguish OPC DA, OPC UA, confidence and text qualities."""
    _, series = read(tmp_path / "x.csv", long([("1", code) for code in codes], column))
    assert series.bad.tolist() == bad


def test_stated_good_quality(tmp_path: Path) -> None:
    """The stated codes are good, and no others."""
    options = ReadOptions(good_quality=("64", "192"))
    _, series = read(tmp_path / "x.csv", long([("1", "64"), ("1", "192"), ("1", "216")], "quality"), options)
    assert series.bad.tolist() == [False, False, True]


def test_quality_next_to_wide_columns(tmp_path: Path) -> None:
    """A quality column next to the column of a tag is no tag, and marks the bad samples of that tag."""
    text = "time,FIC1.PV,FIC1.PV.quality\n2024-01-01 08:00:00,1,192\n2024-01-01 08:00:01,2,8\n"
    export, series = read(tmp_path / "x.csv", text)
    assert export.tags == ("FIC1.PV",)
    assert series.bad.tolist() == [False, True]
    assert "1 samples have quality '8', taken as bad" in export.notes


def test_repeated_stamps_keep_the_last(tmp_path: Path) -> None:
    """Of equal stamps the last one in the file is used, and a note counts them."""
    text = (
        "time,a\n2024-01-01 08:00:00,1\n2024-01-01 08:00:01,2\n2024-01-01 08:00:01,3\n2024-01-01 08:00:02,4\n"
    )
    export, series = read(tmp_path / "x.csv", text)
    assert series.value.tolist() == [1, 3, 4]
    assert any(note.startswith("1 samples repeat a stamp") for note in export.notes)


def test_unreadable_stamps_are_left_out(tmp_path: Path) -> None:
    """A row with an unreadable stamp is left out and counted."""
    export, series = read(tmp_path / "x.csv", wide(["1", "2", "3"]).replace("08:00:01", "08:xx"))
    assert series.value.tolist() == [1, 3]
    assert any(note.startswith("1 samples have no readable time stamp") for note in export.notes)


def berlin(first: str, n: int) -> pd.DatetimeIndex:
    return pd.date_range(first, periods=n, freq="10min", tz="UTC").tz_convert("Europe/Berlin")


@pytest.mark.parametrize("newest_first", [False, True])
@pytest.mark.parametrize("layout", ["wide", "long"])
def test_the_repeated_hour_in_autumn(tmp_path: Path, newest_first: bool, layout: str) -> None:
    """Local stamps of the night with a repeated hour give increasing UTC without a lost sample, and a note."""
    index = berlin("2024-10-26 22:00", 30)
    table = pd.DataFrame({"time": index.strftime("%Y-%m-%d %H:%M:%S"), "a.PV": range(30), "a.OP": range(30)})
    if layout == "long":
        table = table.melt(id_vars="time", var_name="tag", value_name="value")
    text = (table[::-1] if newest_first else table).to_csv(index=False)
    export, series = read(tmp_path / "x.csv", text, ReadOptions(timezone="Europe/Berlin"))
    np.testing.assert_array_equal(series.value, np.arange(30))
    np.testing.assert_array_equal(series.stamp_s, index.as_unit("s").asi8)
    assert any("repeats in autumn" in note for note in export.notes)
    assert "x.csv: stamps state no time zone, taken as Europe/Berlin" in export.notes


def test_the_missing_hour_in_spring(tmp_path: Path) -> None:
    """Local stamps across the missing hour continue without a gap; stamps within that hour are left out and
    reported.
    """
    index = berlin("2024-03-30 23:00", 30)
    rows = [f"{stamp:%Y-%m-%d %H:%M:%S},{i}" for i, stamp in enumerate(index)]
    rows.insert(12, "2024-03-31 02:30:00,99")
    text = "\n".join(["time,a", *rows]) + "\n"
    export, series = read(tmp_path / "x.csv", text, ReadOptions(timezone="Europe/Berlin"))
    np.testing.assert_array_equal(series.stamp_s, index.as_unit("s").asi8)
    assert any(note.startswith("1 samples are in the hour") for note in export.notes)


def test_stamps_with_an_offset_need_no_zone(tmp_path: Path) -> None:
    """A stated zone does not move stamps with an offset."""
    text = "time,a\n2024-07-01T10:00:00+02:00,1\n2024-07-01 04:30:00-0400,2\n"
    _, series = read(tmp_path / "x.csv", text, ReadOptions(timezone="Asia/Tokyo"))
    assert series.stamp_s[0] == pd.Timestamp("2024-07-01 08:00").timestamp()
    assert series.stamp_s[1] == pd.Timestamp("2024-07-01 08:30").timestamp()


def test_a_flow_called_q_is_no_quality(tmp_path):
    """A tag with values and the ending of a quality column is a tag, and its neighbour loses no sample."""
    rows = "".join(
        f"2026-03-02 00:{k // 60:02d}:{k % 60:02d},{50 + k / 10:.1f},{200 + k / 7:.3f}\n" for k in range(300)
    )
    (tmp_path / "x.csv").write_text("timestamp,FIC101,FIC101.Q\n" + rows)
    export = open_export([tmp_path / "x.csv"])
    assert export.tags == ("FIC101", "FIC101.Q")
    assert not export.read(["FIC101"])["FIC101"].bad.any()


def test_values_called_data_are_values(tmp_path):
    """'Data' is a date in Italian and a value in English: floats with that name are the values of a long table."""
    rows = "".join(f"FIC1.PV,2026-03-02 00:00:{k:02d},{50 + k / 10:.1f}\n" for k in range(60))
    (tmp_path / "x.csv").write_text("Tag,Time,Data\n" + rows)
    export = open_export([tmp_path / "x.csv"])
    assert export.tags == ("FIC1.PV",)
    assert export.read(["FIC1.PV"])["FIC1.PV"].value[-1] == 55.9
