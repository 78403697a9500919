"""Stamps without a zone across clock changes: no sample is lost, and a clock without a change is read as such."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analyzer.history.export import open_export
from analyzer.history.table import ReadOptions

BERLIN = ReadOptions(timezone="Europe/Berlin")
NIGHTS = ("2024-03-30 20:00", "2024-10-26 20:00")


def written(path: Path, shown: pd.DatetimeIndex) -> Path:
    """An export with the stamps as shown; the value of each row is its number."""
    rows = [f"{stamp:%Y-%m-%d %H:%M:%S},{k}" for k, stamp in enumerate(shown)]
    path.write_text("\n".join(["time,a.PV", *rows]) + "\n", encoding="utf-8")
    return path


def check(paths: list[Path], truth: pd.DatetimeIndex) -> list[str]:
    """Check that each sample is read in order and at its time; returns the notes."""
    export = open_export(paths, BERLIN)
    series = export.read(["a.PV"])["a.PV"]
    np.testing.assert_array_equal(series.stamp_s, truth.as_unit("s").asi8)
    return list(export.notes)


@pytest.mark.parametrize("night", NIGHTS)
@pytest.mark.parametrize("step", ["10s", "7min", "45min", "60min", "75min", "90min"])
def test_a_changed_clock_at_any_step(tmp_path: Path, night: str, step: str) -> None:
    """At any interval, each sample is read at its own time."""
    truth = pd.date_range(
        night, "2024-10-27 20:00" if "10" in night else "2024-03-31 20:00", freq=step, tz="UTC"
    )
    check([written(tmp_path / "x.csv", truth.tz_convert("Europe/Berlin"))], truth)


@pytest.mark.parametrize("night", NIGHTS)
def test_a_clock_that_is_not_changed(tmp_path: Path, night: str) -> None:
    """A clock that keeps winter time is recognized, read as such, and reported with the option that states it."""
    truth = pd.date_range(night, periods=1000, freq="min", tz="UTC")
    notes = check([written(tmp_path / "x.csv", truth.tz_convert("Etc/GMT-1"))], truth)
    assert any("+1 h from UTC throughout; state --timezone Etc/GMT-1" in note for note in notes)


def test_files_follow_one_that_shows_the_clock(tmp_path: Path) -> None:
    """The file of the days before the change is read with the clock that the file of the change shows."""
    truth = pd.date_range("2024-10-25 22:00", periods=2880, freq="min", tz="UTC")
    shown = truth.tz_convert("Etc/GMT-1")
    files = [written(tmp_path / f"{k}.csv", shown[k : k + 1440]) for k in (0, 1440)]
    check(files, truth)


def test_a_file_may_begin_in_the_second_pass(tmp_path: Path) -> None:
    """A file that begins where the clock was set back is read as winter time, and no sample replaces another."""
    truth = pd.date_range("2024-10-26 23:00", periods=240, freq="min", tz="UTC")
    shown = truth.tz_convert("Europe/Berlin")
    check([written(tmp_path / "1.csv", shown[:120]), written(tmp_path / "2.csv", shown[120:])], truth)


@pytest.mark.parametrize("turned", [False, True])
def test_midnight_written_24(tmp_path: Path, turned: bool) -> None:
    """24:00:00 is the midnight that continues the stamps, with the date of either the old or the new day."""
    truth = pd.date_range("2024-11-21 23:00", periods=120, freq="min", tz="UTC")
    path = written(tmp_path / "x.csv", truth)
    day = "22" if turned else "21"
    path.write_text(path.read_text().replace("2024-11-22 00:00:00", f"2024-11-{day} 24:00:00"))
    series = open_export([path]).read(["a.PV"])["a.PV"]
    np.testing.assert_array_equal(series.stamp_s, truth.as_unit("s").asi8)


@pytest.mark.parametrize("stamp", ["25:10:00", "12:61:00", "12:10:61", "24:01:00", "12:10:00+99:00"])
def test_an_impossible_time_is_left_out(tmp_path: Path, stamp: str) -> None:
    """A stamp with an impossible time is left out and counted, and not moved to the next hour or day."""
    path = written(tmp_path / "x.csv", pd.date_range("2024-11-21 08:00", periods=60, freq="s"))
    path.write_text(path.read_text().replace("08:00:30", stamp))
    export = open_export([path])
    assert 30 not in export.read(["a.PV"])["a.PV"].value
    assert "1 samples have no readable time stamp and are left out" in export.notes
