"""Ambiguous content is read in the more likely way, with a note on how to state the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analyzer.history.export import open_export
from analyzer.history.table import ReadOptions

SECONDS = pd.date_range("2024-11-21 08:00", periods=60, freq="s")
NUMBER = np.arange(60)


def export(path: Path, stamps: list[str], values: list[str], sep: str = ",", time: str = "time") -> Path:
    """A wide table of one tag."""
    rows = [f"{stamp}{sep}{value}" for stamp, value in zip(stamps, values, strict=True)]
    path.write_text("\n".join([f"{time}{sep}a.PV", *rows]) + "\n", encoding="utf-8")
    return path


def read(path: Path, **how: object) -> tuple[np.ndarray, np.ndarray, str]:
    """Stamps and values of the good samples, and the first note."""
    found = open_export([path], ReadOptions(**how))  # type: ignore[arg-type]
    series = found.read([found.tags[0]])[found.tags[0]]
    return series.stamp_s[~series.bad], series.value[~series.bad], found.notes[0]


def iso() -> list[str]:
    return [f"{stamp:%Y-%m-%d %H:%M:%S}" for stamp in SECONDS]


@pytest.mark.parametrize(("sep", "mark", "whole"), [(",", ",", True), (";", ",", False), (";", ".", False)])
def test_thousands_or_fractions(tmp_path: Path, sep: str, mark: str, whole: bool) -> None:
    """12,312 is twelve thousand with comma separators and twelve with semicolons; the note states the option for the
    other.
    """
    true = 12300 + NUMBER
    quote = '"' if sep == mark else ""
    path = export(tmp_path / "x.csv", iso(), [f"{quote}{v:,}{quote}".replace(",", mark) for v in true], sep)
    _, value, note = read(path)
    np.testing.assert_allclose(value, true if whole else true / 1000)
    stated = note.split("; state --decimal '")[1][0]
    np.testing.assert_allclose(read(path, decimal=stated)[1], true / 1000 if whole else true)


def test_a_decimal_point_shows_that_commas_group(tmp_path: Path) -> None:
    """If other numbers of the file have a decimal point, commas group digits, and no note is given."""
    cells = [f'"{12300 + k:,}",{k / 8:.2f}' for k in NUMBER]
    path = export(tmp_path / "x.csv", iso(), cells)
    path.write_text(path.read_text().replace("a.PV", "a.PV,a.OP"))
    _, value, note = read(path)
    np.testing.assert_array_equal(value, 12300 + NUMBER)
    assert "; state" not in note


@pytest.mark.parametrize(
    ("zone", "day"), [(None, False), ("Europe/Berlin", True), ("America/Chicago", False)]
)
def test_a_date_of_either_order(tmp_path: Path, zone: str | None, day: bool) -> None:
    """04/05/2024 is read day first if that is usual in the stated zone, else month first, with a note as the first
    one.
    """
    path = export(tmp_path / "x.csv", [f"04/05/2024 {s:%H:%M:%S}" for s in SECONDS], [str(k) for k in NUMBER])
    stamp, _, note = read(path, timezone=zone)
    true = pd.Timestamp(2024, 5 if day else 4, 4 if day else 5, 8, tz=zone or "UTC")
    assert stamp[0] == true.timestamp()
    assert f"; state {'--month-first' if day else '--day-first'}" in note


def test_no_date_order_with_stamps_in_the_future(tmp_path: Path) -> None:
    """Of two orders, the one without a stamp in the future is used."""
    now = pd.Timestamp.now(tz="UTC").floor("D")
    first = next(d for k in range(400) if (d := now - pd.Timedelta(days=k)).day <= 12 and d.day > d.month)
    shown = first.strftime("%d/%m/%Y")
    path = export(tmp_path / "x.csv", [f"{shown} {s:%H:%M:%S}" for s in SECONDS], [str(k) for k in NUMBER])
    ahead = pd.Timestamp(first.year, first.day, first.month, tz="UTC") > now + pd.Timedelta(days=2)
    stamp, _, note = read(path)
    assert pd.Timestamp(stamp[0], unit="s", tz="UTC").strftime("%d/%m" if ahead else "%m/%d") == shown[:5]
    assert "state" in note


@pytest.mark.parametrize("mark", "-/.")
@pytest.mark.parametrize("year", ["24", "21"])
def test_a_year_of_two_digits(tmp_path: Path, mark: str, year: str) -> None:
    """24-11-21 may begin with its year: the later date is used (with points the day is first), and a note is
    given.
    """
    day = {"24": "21", "21": "24"}[year]
    path = export(
        tmp_path / "x.csv", [f"{year}{mark}11{mark}{day} {s:%H:%M:%S}" for s in SECONDS], ["1"] * 60
    )
    stamp, _, note = read(path)
    first = year == "24" and mark != "."
    true = "2024-11-21 08:00" if first or year == "21" else "2021-11-24 08:00"
    assert stamp[0] == pd.Timestamp(true, tz="UTC").timestamp()
    assert "; state --date-format" in note


@pytest.mark.parametrize(
    ("name", "step_s"), [("Time", 0.5), ("Time", 1.0), ("ms", 0.01), ("Time (ms)", 0.002)]
)
def test_milliseconds_since_the_start(tmp_path: Path, name: str, step_s: float) -> None:
    """Counts in hundreds, or in a column with that unit, are milliseconds, because no loop is sampled every 100 s."""
    path = export(tmp_path / "x.csv", [f"{1000 * step_s * k:.0f}" for k in NUMBER], ["1"] * 60, time=name)
    stamp, _, note = read(path)
    np.testing.assert_allclose(np.diff(stamp), step_s, atol=1e-9)
    assert "milliseconds since the start" in note
    assert "; state the unit in the column's name" in note


@pytest.mark.parametrize("step_s", [1, 5, 60, 300, 3600])
def test_seconds_since_the_start(tmp_path: Path, step_s: int) -> None:
    """Counts in seconds, complete minutes and hours are seconds."""
    path = export(tmp_path / "x.csv", [f"{step_s * k}" for k in NUMBER], ["1"] * 60, time="Elapsed")
    np.testing.assert_allclose(np.diff(read(path)[0]), step_s)


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize(
    ("good", "bad"), [("1", "0"), ("1", "3"), ("0", "1"), ('"Annotated, Good"', '"Good, Questionable"')]
)
def test_which_codes_are_good(tmp_path: Path, long: bool, good: str, bad: str) -> None:
    """Of the codes 0 and 1 the more frequent one is good; of words separated by commas none may be bad."""
    codes = [bad if k % 10 == 3 else good for k in NUMBER]
    tag, head = ("a.PV,", "time,tag,value,quality") if long else ("", "time,a.PV,a.PV.quality")
    rows = [f"{t},{tag}{k},{code}" for k, (t, code) in enumerate(zip(iso(), codes, strict=True))]
    (tmp_path / "x.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    series = open_export([tmp_path / "x.csv"]).read(["a.PV"])["a.PV"]
    np.testing.assert_array_equal(series.bad, NUMBER % 10 == 3)


def test_one_tag_does_not_reverse_the_codes(tmp_path: Path) -> None:
    """A tag whose codes are all 0 is bad if the codes of its neighbours are 1."""
    rows = [f"{t},{k},1,{k},1,{k},0" for k, t in enumerate(iso())]
    head = "time," + ",".join(f"{tag}.PV,{tag}.PV.quality" for tag in "abc")
    (tmp_path / "x.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    series = open_export([tmp_path / "x.csv"]).read(["a.PV", "c.PV"])
    assert series["c.PV"].bad.all()
    assert not series["a.PV"].bad.any()


@pytest.mark.parametrize("mark", ".,")
def test_a_minus_after_the_number(tmp_path: Path, mark: str) -> None:
    """12.3- is minus 12.3."""
    true = (NUMBER - 30) / 4
    shown = [f"{abs(v):.2f}".replace(".", mark) + ("-" if v < 0 else "") for v in true]
    np.testing.assert_array_equal(read(export(tmp_path / "x.csv", iso(), shown, ";"))[1], true)
