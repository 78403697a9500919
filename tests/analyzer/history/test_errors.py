"""A file that cannot be read is reported with the content, the expectation and the remedy."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analyzer.history.export import ReadOptions, open_export
from identification.errors import InputError

ROW = "2024-11-21 08:00:00"


@pytest.mark.parametrize(
    ("content", "fragments"),
    [
        (b"", ["empty file"]),
        (b"\n \n", ["empty file"]),
        (b"\xef\xbb\xbf", ["empty file"]),
        (b"hello world\nthis is no table\n", ["no columns", "'hello world'", "comma, semicolon, tab or bar"]),
        (b"FIC1.SP,FIC1.PV\n1.5,2.5\n", ["no time column among FIC1.SP, FIC1.PV", "named timestamp"]),
        (f"{ROW},1,2\n{ROW},3,4\n".encode(), ["no header", "row 1", "timestamp,FIC101.SP"]),
        (b"1,2,3\n4,5,6\n", ["no header"]),
        (
            f"timestamp,comment\n{ROW},\n".encode().replace(b",comment", b","),
            ["no values next to", "'timestamp'"],
        ),
        (f"timestamp,a,b,a\n{ROW},1,2,3\n".encode(), ["column 'a' occurs twice"]),
        (b"timestamp,FIC1.PV\n", ["a header and no rows"]),
        (
            b"timestamp,FIC1.PV\nsoon,1\nlater,2\n",
            ["column 'timestamp'", "row 2", "'soon'", "state the date format"],
        ),
        (
            b"PK\x03\x04\x00\x00\x08\x00binary\x00\x00\x00stuff,\x00\n" * 20,
            ["cannot be unpacked", "a whole archive"],
        ),
        (b"\x1f\x8b\x08\x00" + b"x" * 40, ["cannot be unpacked", "a whole archive"]),
        (b"\x00timestamp,FIC1.PV\n" * 20, ["binary content"]),
    ],
)
def test_text_that_is_no_export(tmp_path: Path, content: bytes, fragments: list[str]) -> None:
    """Each error of a delimited text is reported with the file and a remedy."""
    path = tmp_path / "export.csv"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        open_export([path])
    assert str(path) in str(error.value)
    for fragment in fragments:
        assert fragment in str(error.value)


@pytest.mark.parametrize("content", [b"timestamp,a\n", b"PAR1 cut short", b"PAR1"])
def test_no_parquet(tmp_path: Path, content: bytes) -> None:
    """A file with a Parquet name that is not Parquet, or is cut short, is reported as such."""
    path = tmp_path / "export.parquet"
    path.write_bytes(content)
    with pytest.raises(InputError, match="named as Parquet, but cannot be read as such"):
        open_export([path])


def test_parquet_without_time_or_rows(tmp_path: Path) -> None:
    """Parquet without a time column, without values or without rows is reported."""
    frames = {
        "no time column": pd.DataFrame({"FIC1.PV": [1.0]}),
        "no values": pd.DataFrame({"timestamp": pd.to_datetime([ROW])}),
        "without rows": pd.DataFrame({"timestamp": pd.to_datetime([]), "FIC1.PV": []}),
    }
    for fragment, frame in frames.items():
        frame.to_parquet(tmp_path / "x.parquet")
        with pytest.raises(InputError, match=fragment):
            open_export([tmp_path / "x.parquet"])


def test_a_file_that_goes_or_breaks_after_it_was_opened(tmp_path: Path) -> None:
    """A Parquet file that is missing or damaged when its samples are read is reported with its name."""
    frame = pd.DataFrame({"timestamp": pd.date_range(ROW, periods=9000, freq="s"), "a": range(9000)})
    frame.to_parquet(tmp_path / "x.parquet", compression=None)
    frame.to_csv(tmp_path / "x.csv", index=False)
    for name in ("x.parquet", "x.csv"):
        export = open_export([tmp_path / name])
        (tmp_path / name).unlink()
        if name == "x.parquet":
            with pytest.raises(InputError, match=r"x\.parquet"):
                export.read(["a"])
    frame.to_parquet(tmp_path / "x.parquet")
    data = bytearray((tmp_path / "x.parquet").read_bytes())
    data[4:2000] = bytes(1996)
    (tmp_path / "x.parquet").write_bytes(data)
    with pytest.raises(InputError, match=r"x\.parquet"):
        open_export([tmp_path / "x.parquet"]).read(["a"])


CELLS = (
    *("timestamp", "tag", "value", "quality", "FIC1.PV", "2024-11-21", ROW, "21/11/24", "08:00", "1"),
    *("1,5", "", " ", '"', "#", "[Data]", "192", "Good", "45617.5", "1732176000", "nan", "ü", "01-xxx-24"),
    *("1e999", "-2.5", "\x00"),
)


@settings(max_examples=400, deadline=None)
@given(
    st.lists(st.lists(st.sampled_from(CELLS), max_size=5), max_size=7),
    st.sampled_from(",;\t|"),
    st.booleans(),
)
def test_any_text_is_read_or_refused(rows: list[list[str]], delimiter: str, headed: bool) -> None:
    """Any content of a text file is read, or refused with an error for the user."""
    header = [["timestamp", "FIC1.PV", "x"]] if headed else []
    text = "\n".join(delimiter.join(row) for row in header + rows)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.csv"
        path.write_text(text, encoding="utf-8")
        try:
            export = open_export([path])
            series = export.read(export.tags)
        except InputError:
            return
        for one in series.values():
            assert np.isfinite(one.stamp_s).all()
            assert (np.diff(one.stamp_s) > 0).all()
            assert (np.isfinite(one.value) | one.bad | (one.text is not None)).all()
        assert export.notes


def test_paths(tmp_path: Path) -> None:
    """A missing path and a folder without exports are reported; loops.csv is no export."""
    with pytest.raises(InputError, match=r"none\.csv: no such file or folder"):
        open_export([tmp_path / "none.csv"])
    (tmp_path / "loops.csv").write_text("loop\nFIC1\n")
    with pytest.raises(InputError, match="a folder without exports"):
        open_export([tmp_path])
    with pytest.raises(InputError, match="no path"):
        open_export([])


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind this user")
def test_no_permission(tmp_path: Path) -> None:
    """A file without read permission is reported."""
    path = tmp_path / "x.csv"
    path.write_text(f"timestamp,a\n{ROW},1\n")
    path.chmod(0)
    with pytest.raises(InputError, match="cannot be opened"):
        open_export([path])


def test_options_that_do_not_fit(tmp_path: Path) -> None:
    """An unknown time zone, a wrong encoding and a wrong date format are reported."""
    path = tmp_path / "x.csv"
    path.write_text(f"timestamp,a\n{ROW},1\n")
    with pytest.raises(InputError, match=r"time zone 'Mars/Olympus'.*IANA"):
        open_export([path], ReadOptions(timezone="Mars/Olympus"))
    with pytest.raises(InputError, match="encoding 'klingon'"):
        open_export([path], ReadOptions(encoding="klingon"))
    with pytest.raises(InputError, match=f"row 2: '{ROW}'"):
        open_export([path], ReadOptions(date_format="%d.%m.%Y"))
