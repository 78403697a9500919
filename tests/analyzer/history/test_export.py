"""Exports: their tags and samples, from one file or several files."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analyzer.history.export import ReadOptions, open_export
from identification.errors import InputError

RECORDINGS = Path(__file__).parents[3].parent / "shared" / "recordings"


def plant_day(n: int = 50, start: str = "2024-11-21 08:00:00") -> pd.DataFrame:
    """A wide table of two loops; the numbers have few digits, so that each text of them is exact."""
    noise = np.random.default_rng(7).integers(0, 100_000, (n, 3)) / 1000
    table = pd.DataFrame(noise, columns=["FIC101.SP", "FIC101.PV", "LIC102.OP"])
    table.insert(0, "timestamp", pd.date_range(start, periods=n, freq="s"))
    return table


def long_of(table: pd.DataFrame, **columns: object) -> pd.DataFrame:
    return table.melt(id_vars="timestamp", var_name="tag", value_name="value").assign(**columns)


def assert_same(path: Path, table: pd.DataFrame, options: ReadOptions | None = None) -> None:
    export = open_export([path], options or ReadOptions())
    tags = [name for name in table.columns if name != "timestamp"]
    assert set(tags) == set(export.tags)
    stamp_s = table["timestamp"].to_numpy().astype("datetime64[us]").astype(np.int64) / 1e6
    for tag, series in export.read(tags).items():
        np.testing.assert_allclose(series.stamp_s, stamp_s, atol=1e-6)
        np.testing.assert_array_equal(series.value, table[tag].to_numpy())
        assert not series.bad.any()


def test_wide_parquet(tmp_path: Path) -> None:
    """A wide Parquet file gives each tag's numbers at its stamps."""
    table = plant_day()
    table.to_parquet(tmp_path / "day.parquet")
    assert_same(tmp_path / "day.parquet", table)


def test_long_parquet(tmp_path: Path) -> None:
    """A long Parquet file gives the same as the wide one."""
    table = plant_day()
    long_of(table, quality=192).to_parquet(tmp_path / "day.parquet")
    assert_same(tmp_path / "day.parquet", table)


def test_long_parquet_with_categories(tmp_path: Path) -> None:
    """A long Parquet file whose tags are categories gives the same as the wide one."""
    table = plant_day()
    long_of(table).astype({"tag": "category"}).to_parquet(tmp_path / "day.parquet")
    assert_same(tmp_path / "day.parquet", table)


def test_wide_and_long_csv(tmp_path: Path) -> None:
    """Wide and long CSV give the same as Parquet."""
    table = plant_day()
    table.to_csv(tmp_path / "wide.csv", index=False)
    long_of(table).to_csv(tmp_path / "long.csv", index=False)
    assert_same(tmp_path / "wide.csv", table)
    assert_same(tmp_path / "long.csv", table)


def test_files_of_one_tag_are_joined(tmp_path: Path) -> None:
    """One file for each day gives one series over all days, for any order of the files."""
    table = plant_day(60)
    table[30:].to_parquet(tmp_path / "a.parquet")
    table[:31].to_csv(tmp_path / "b.csv", index=False)
    assert_same(tmp_path, table)


def test_contradicting_files_are_reported(tmp_path: Path) -> None:
    """If two files disagree at a stamp, the later file is used, and a note gives the number of such samples."""
    table = plant_day(10)
    table.to_parquet(tmp_path / "a.parquet")
    table.assign(**{"FIC101.PV": -1.0}).to_parquet(tmp_path / "b.parquet")
    export = open_export([tmp_path])
    assert (export.read(["FIC101.PV"])["FIC101.PV"].value == -1).all()
    assert any(note.startswith("10 samples contradict") for note in export.notes)


def test_an_export_is_picklable_and_small(tmp_path: Path) -> None:
    """An export that is sent to another process gives the same samples there, and its pickle contains no samples."""
    table = plant_day(5000)
    table.to_parquet(tmp_path / "day.parquet")
    sent = pickle.dumps(open_export([tmp_path]))
    assert len(sent) < 5000
    np.testing.assert_array_equal(
        pickle.loads(sent).read(["FIC101.PV"])["FIC101.PV"].value, table["FIC101.PV"]
    )


def test_span(tmp_path: Path) -> None:
    """The span begins with the first stamp and ends with the last stamp of all files."""
    plant_day(60).to_parquet(tmp_path / "day.parquet")
    first, last = open_export([tmp_path]).span()
    assert last - first == 59
    assert first == pd.Timestamp("2024-11-21 08:00:00").timestamp()


def test_unknown_tag(tmp_path: Path) -> None:
    """A tag that is missing from the export is named, with the nearest existing tag."""
    plant_day().to_parquet(tmp_path / "day.parquet")
    with pytest.raises(InputError, match=r"FIC101\.PW is not in the export.*FIC101\.PV"):
        open_export([tmp_path]).read(["FIC101.PW"])


@pytest.mark.skipif(not RECORDINGS.exists(), reason="the real recordings lie outside the repository")
@pytest.mark.parametrize("folder", ["isdb", "isdb-op", "refinery", "rigs"])
def test_real_recordings(folder: str) -> None:
    """Each tag of the real recordings is read with increasing stamps, and less than 5 % of its values are bad."""
    export = open_export([RECORDINGS / folder])
    for tag in export.tags:
        series = export.read([tag])[tag]
        assert (np.diff(series.stamp_s) > 0).all()
        assert series.bad.mean() < 0.05


def test_an_unreadable_file_in_a_folder_loses_only_its_own_loops(tmp_path: Path) -> None:
    """A readme, an empty file and a damaged Parquet in a folder with good exports are left out and reported.

    If such a file is named directly, it is refused.
    """
    good = pd.DataFrame(
        {"timestamp": pd.date_range("2026-03-02", periods=50, freq="s"), "FIC1.PV": range(50)}
    )
    good.to_parquet(tmp_path / "good.parquet")
    (tmp_path / "readme.txt").write_text("How this was exported\nby hand")
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "bad.parquet").write_bytes(b"PAR1 and then nothing")
    export = open_export([tmp_path])
    assert export.tags == ("FIC1.PV",)
    notes = " ".join(export.file_notes)
    assert all(name in notes for name in ("readme.txt", "empty.csv", "bad.parquet"))
    with pytest.raises(InputError, match=r"bad\.parquet"):
        open_export([tmp_path / "good.parquet", tmp_path / "bad.parquet"])
