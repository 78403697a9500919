"""Parquet in the types that exports of historians and dataframes write."""

from __future__ import annotations

import contextlib
import decimal
import threading
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from analyzer.history import parquet
from analyzer.history.export import Export, open_export
from identification.errors import InputError

STAMPS = [datetime(2024, 11, 21, 8, 0, i) for i in range(4)]
FIRST_S = datetime(2024, 11, 21, 8, tzinfo=UTC).timestamp()


def written(folder: Path, **columns: pa.Array) -> Export:
    pq.write_table(pa.table(columns), folder / "x.parquet")
    return open_export([folder / "x.parquet"])


@pytest.mark.parametrize(
    "stamps",
    [
        *(pa.array(STAMPS, pa.timestamp(unit)) for unit in ("s", "ms", "us", "ns")),
        pa.array(STAMPS, pa.timestamp("ns", "Europe/Berlin")),
        pa.array([str(stamp) for stamp in STAMPS]),
        pa.array([f"{stamp:%d-%b-%y %H:%M:%S.0}".upper() for stamp in STAMPS]),
        pa.array([FIRST_S + i for i in range(4)]),
        pa.array([int(FIRST_S + i) * 1000 for i in range(4)]),
    ],
    ids=lambda stamps: str(stamps.type),
)
def test_stamps_of_any_type(tmp_path: Path, stamps: pa.Array) -> None:
    """Time stamps of any unit or zone, as texts or as numbers, give the same seconds."""
    export = written(tmp_path, timestamp=stamps, a=pa.array([1.0, 2, 3, 4]))
    assert export.read(["a"])["a"].stamp_s.tolist() == [FIRST_S + i for i in range(4)]
    assert export.span() == (FIRST_S, FIRST_S + 3)


@pytest.mark.parametrize(
    "column",
    [
        pa.array([1, 0, 1, 0], pa.int8()),
        pa.array([True, False, True, False]),
        pa.array(np.array([1, 0, 1, 0], dtype=np.float32)),
        pa.array([decimal.Decimal(i) for i in (1, 0, 1, 0)]),
        pa.array(["1", "0", "1.0", "0"]),
        pa.array(["1", "0", "1.0", "0"]).dictionary_encode(),
        pa.array([1, 0, 1, 0], pa.int64()).dictionary_encode(),
    ],
    ids=lambda column: str(column.type),
)
def test_values_of_any_type(tmp_path: Path, column: pa.Array) -> None:
    """Integers, booleans, decimals and texts of numbers are read as numbers."""
    series = written(tmp_path, timestamp=pa.array(STAMPS), a=column).read(["a"])["a"]
    assert series.value.tolist() == [1, 0, 1, 0]
    assert not series.bad.any()


def test_missing_and_infinite_values_are_bad(tmp_path: Path) -> None:
    """Nulls, NaN and infinities are bad samples, and no infinity remains in the values."""
    export = written(tmp_path, timestamp=pa.array(STAMPS), a=pa.array([1, None, float("nan"), float("-inf")]))
    series = export.read(["a"])["a"]
    assert series.bad.tolist() == [False, True, True, True]
    assert np.isnan(series.value[1:]).all()


def test_days_are_stamps(tmp_path: Path) -> None:
    """A column of dates alone is a time column."""
    days = pa.array([date(2024, 11, 21) + timedelta(i) for i in range(4)])
    series = written(tmp_path, day=days, a=pa.array([1.0, 2, 3, 4])).read(["a"])["a"]
    assert np.diff(series.stamp_s).tolist() == [86400] * 3


def test_tags_that_are_numbers(tmp_path: Path) -> None:
    """The tags of a long file may be numbers."""
    export = written(
        tmp_path, time=pa.array(STAMPS), tag=pa.array([7, 7, 8, 8]), value=pa.array([1.0, 2, 3, 4])
    )
    assert export.tags == ("7", "8")
    assert export.read(["8"])["8"].value.tolist() == [3, 4]


def test_modes_and_numbers_in_a_long_file(tmp_path: Path) -> None:
    """One column of values may contain numbers of one tag and modes of another."""
    export = written(
        tmp_path,
        time=pa.array(STAMPS),
        tag=pa.array(["F.PV", "F.PV", "F.MODE", "F.MODE"]),
        value=pa.array(["1.5", "2.5", "AUTO", "MAN"]),
    )
    read = export.read(["F.PV", "F.MODE"])
    assert (read["F.PV"].value.tolist(), read["F.PV"].text) == ([1.5, 2.5], None)
    assert read["F.MODE"].text is not None
    assert read["F.MODE"].text.tolist() == ["AUTO", "MAN"]


def test_pages_without_end_are_refused(tmp_path, monkeypatch):
    """A small file that cannot be read because of a damaged page ends in one line within the time limit."""
    path = tmp_path / "x.parquet"
    pq.write_table(pa.table({"time": pa.array([0, 1], pa.timestamp("s")), "a.PV": [1.0, 2.0]}), path)
    stop, ended = threading.Event(), []
    monkeypatch.setattr(parquet, "_read_through", lambda _: ended.append(stop.wait(60.0)))
    monkeypatch.setattr(parquet, "PROBE_S", 0.2)
    with pytest.raises(InputError, match=r"x\.parquet: its pages take longer than 0\.2 s to read"):
        open_export([path])
    assert not ended
    stop.set()


def test_changed_bytes_end_in_time(tmp_path, monkeypatch):
    """For changed bytes in a page, with any codec, no file is opened before its read test has ended."""
    through, probed = parquet._read_through, []
    monkeypatch.setattr(parquet, "_read_through", lambda path: (through(path), probed.append(path)))
    rng, n = np.random.default_rng(5), 400
    stamps = pa.array(np.arange(n), pa.timestamp("s"))
    table = pa.table({"time": stamps, "a.PV": rng.normal(size=n).round(2), "a.MODE": ["AUTO"] * n})
    for codec in ("snappy", "gzip", "brotli", "zstd", "lz4", "none"):
        pq.write_table(table, tmp_path / "whole.parquet", compression=codec)
        whole = (tmp_path / "whole.parquet").read_bytes()
        pages = len(whole) - 8 - int.from_bytes(whole[-8:-4], "little")
        for k in range(25):
            changed = bytearray(whole)
            for at in rng.integers(4, pages, size=3):
                changed[at] = rng.integers(256)
            path = tmp_path / f"{codec}{k}.parquet"
            path.write_bytes(changed)
            with contextlib.suppress(InputError):
                export = open_export([path])
                assert probed[-1] == path
                export.read(export.tags)
