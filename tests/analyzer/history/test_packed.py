"""Packed exports are read as their content, and decompression bombs are refused before they are unpacked."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from analyzer.history.export import open_export
from analyzer.history.table import ReadOptions
from identification.errors import InputError

ROWS = [f"2026-03-02 00:00:{k:02d},{20 + k},50" for k in range(60)]
TEXT = "timestamp,FIC1.PV,FIC1.OP\n" + "\n".join(ROWS) + "\n"


def zipped(data: bytes) -> bytes:
    """A zip archive of one file in a folder."""
    import io

    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("../deep/export.csv", data)
    return out.getvalue()


@pytest.mark.parametrize(
    ("ending", "pack"),
    [(".csv.gz", gzip.compress), (".csv.bz2", bz2.compress), (".csv.xz", lzma.compress), (".zip", zipped)],
)
def test_packed_reads_as_plain(tmp_path: Path, ending: str, pack: Callable[[bytes], bytes]) -> None:
    """A packed CSV has the samples of the unpacked one, and nothing is written outside the scratch directory."""
    folder, scratch = tmp_path / "in", tmp_path / "scratch"
    folder.mkdir()
    scratch.mkdir()
    (folder / f"export{ending}").write_bytes(pack(TEXT.encode()))
    for path in (folder / f"export{ending}", folder):
        found = open_export([path], ReadOptions(scratch=scratch)).read(["FIC1.PV"])["FIC1.PV"]
        assert np.array_equal(found.value, np.arange(20.0, 80.0))
    assert [p.name for p in folder.iterdir()] == [f"export{ending}"]
    assert {p.relative_to(tmp_path).parts[0] for p in tmp_path.rglob("*")} == {"in", "scratch"}


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    """A file of some hundred kilobytes that unpacks to 200 MB is refused in one line, and no such file remains."""
    path, scratch = tmp_path / "bomb.csv.gz", tmp_path / "scratch"
    scratch.mkdir()
    with gzip.open(path, "wb", compresslevel=6) as file:
        for _ in range(200):
            file.write(b"0" * 1_000_000)
    with pytest.raises(InputError, match="unpack to more than"):
        open_export([path], ReadOptions(scratch=scratch))
    assert sum(p.stat().st_size for p in scratch.rglob("*") if p.is_file()) < 110_000_000


@pytest.mark.parametrize("shared", [True, False])
def test_texts_of_megabytes_are_refused_by_the_footer(tmp_path: Path, shared: bool) -> None:
    """A Parquet file of a few kilobytes whose texts unpack to megabytes is refused in one line; short texts are
    read.
    """
    rows, start = 5, 1_772_409_600_000_000
    stamps = (start + 1_000_000 * np.arange(rows)).astype("datetime64[us]")
    for name, text in (("long", "x" * 12_000_000), ("short", "Good")):
        table = pa.table({"time": stamps, "FIC1.PV": np.arange(rows) * 1.0, "note": [text] * rows})
        path = tmp_path / f"{name}.parquet"
        pq.write_table(table, path, compression="zstd", use_dictionary=shared)
        assert path.stat().st_size < 50_000
        if name == "long":
            with pytest.raises(InputError, match="bytes on average"):
                open_export([path])
        else:
            assert "FIC1.PV" in open_export([path]).tags


def test_a_long_list_of_tags_before_few_rows_is_read(tmp_path: Path) -> None:
    """A dictionary of ten thousand tags in groups of a few rows is no decompression bomb."""
    tags = [f"unit-{k:05d}/controller/FIC{k:05d}.PV" for k in range(10_000)]
    rows, start = 60, 1_772_409_600_000_000
    table = pa.table(
        {
            "TagName": pa.DictionaryArray.from_arrays(np.zeros(rows, dtype=np.int32), tags),
            "DateTime": (start + 1_000_000 * np.arange(rows)).astype("datetime64[us]"),
            "Value": np.arange(rows) * 1.0,
        }
    )
    pq.write_table(table, tmp_path / "x.parquet", row_group_size=20)
    group = pq.read_metadata(tmp_path / "x.parquet").row_group(0)
    assert group.column(0).total_uncompressed_size > 300_000  # all tags are stored before twenty rows
    assert open_export([tmp_path / "x.parquet"]).tags == (tags[0],)


def test_an_archive_of_several_files_is_refused(tmp_path: Path) -> None:
    """An archive of several files is refused, because the intended file is unknown."""
    with zipfile.ZipFile(tmp_path / "two.zip", "w") as archive:
        archive.writestr("a.csv", TEXT)
        archive.writestr("b.csv", TEXT)
    with pytest.raises(InputError, match="an archive of 2 files"):
        open_export([tmp_path / "two.zip"])


@pytest.mark.parametrize("keep", [10, 60, 200])
def test_a_cut_archive_is_one_line(tmp_path: Path, keep: int) -> None:
    """A truncated archive is reported as such and never read in part."""
    (tmp_path / "cut.csv.gz").write_bytes(gzip.compress(TEXT.encode())[:keep])
    with pytest.raises(InputError, match="cannot be unpacked"):
        open_export([tmp_path / "cut.csv.gz"])
