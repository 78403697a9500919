"""Exports too big for memory are streamed once and give the same result as exports that are read completely."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from analyzer.history import parquet
from analyzer.history.export import Export, open_export
from analyzer.history.parquet import ParquetTable
from analyzer.history.series import Series
from analyzer.history.table import ReadOptions
from analyzer.store.lock import scratch

TAGS = [f"FIC{k:03d}.{role}" for k in range(40) for role in ("PV", "OP")]
ROWS = 300


def stamp(k: int) -> str:
    """A stamp at 10 s."""
    return f"21.11.2024 {8 + k // 360:02d}:{k // 6 % 60:02d}:{10 * (k % 6):02d}"


def wide(path: Path) -> Path:
    """A wide CSV with German conventions, a text late in one column, a mode column, and a line that does not fit."""
    rng = np.random.default_rng(1)
    lines = [";".join(["Zeit", *TAGS, "FIC000.MODE"])]
    for k in range(ROWS):
        cells = [f"{x:.3f}".replace(".", ",") for x in rng.normal(50, 5, len(TAGS))]
        cells[3] = "Bad Input" if k > ROWS - 20 else cells[3]
        lines.append(";".join([stamp(k), *cells, "AUTO" if k % 7 else "MAN"]))
    lines.insert(200, "cut;short")
    path.write_text("\n".join(lines) + "\n", encoding="cp1252")
    return path


def long(path: Path, umlaut: bool = False) -> Path:
    """A long CSV in the order of time with 80 interleaved tags and quality."""
    rng = np.random.default_rng(2)
    lines = ["Tag,Time,Value,Quality"]
    for k in range(ROWS):
        for tag in TAGS:
            good = "192" if rng.random() > 0.02 else "0"
            value = "Bad" if k == ROWS - 1 and tag == TAGS[5] else f"{rng.normal(50, 5):.3f}"
            lines.append(f"{tag},{stamp(k)},{value},{good}")
    if umlaut:
        lines.append(f"FIC000.\u00fc,{stamp(0)},1.5,192")
    path.write_bytes(("\n".join(lines) + "\n").encode("cp1252"))
    return path


def both(path: Path, monkeypatch: pytest.MonkeyPatch, scratch: Path) -> tuple[Export, Export]:
    """The export read completely, and streamed."""
    whole = open_export([path])
    monkeypatch.setattr("analyzer.history.export.WHOLE_BYTES", 100)
    monkeypatch.setattr("analyzer.history.sheet.BLOCK_BYTES", 1 << 14)
    streamed = open_export([path], ReadOptions(scratch=scratch))
    table = streamed.sources[0].table
    assert isinstance(table, ParquetTable)
    assert table.folder is not None
    return whole, streamed


def test_a_tag_that_ends_in_a_quote_keeps_its_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tag has the same name and the same samples if its file is read completely or streamed."""
    rows = [f'"FIC1 ""a""",{stamp(k)},{k},192\nFIC1 b,{stamp(k)},{-k},192\n' for k in range(ROWS)]
    (tmp_path / "x.csv").write_text("Tag,Time,Value,Quality\n" + "".join(rows))
    whole, streamed = both(tmp_path / "x.csv", monkeypatch, tmp_path)
    assert streamed.tags == whole.tags == ('FIC1 "a"', "FIC1 b")
    np.testing.assert_array_equal(streamed.read(whole.tags)[whole.tags[0]].value, np.arange(ROWS))


@pytest.mark.parametrize("kind", ["wide", "long", "long, umlaut late"])
def test_a_streamed_export_equals_the_complete_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Tags, samples, quality, texts, span and notes of a streamed file are those of the file read completely."""
    path = wide(tmp_path / "x.csv") if kind == "wide" else long(tmp_path / "x.csv", "umlaut" in kind)
    whole, streamed = both(path, monkeypatch, tmp_path)
    assert streamed.tags == whole.tags
    assert streamed.span() == whole.span()
    for tags in (list(whole.tags[:7]), list(whole.tags[-3:])):
        a, b = whole.read(tags), streamed.read(tags)
        for tag in tags:
            np.testing.assert_array_equal(a[tag].stamp_s, b[tag].stamp_s)
            np.testing.assert_array_equal(a[tag].value, b[tag].value)
            np.testing.assert_array_equal(a[tag].bad, b[tag].bad)
            assert (a[tag].text is None) == (b[tag].text is None)
    assert whole.met(whole.tags[:7]) == streamed.met(whole.tags[:7])
    assert [n for n in whole.notes if "left out" in n] == [n for n in streamed.notes if "left out" in n]


def test_late_texts_do_not_prevent_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Words after megabytes of numbers, in one column after another, are bad samples of those columns only."""
    path, rows, rng = tmp_path / "x.csv", 12_000, np.random.default_rng(4)
    words = {9000 + 300 * k: k for k in range(8)}
    lines = ["Time," + ",".join(TAGS[:8])]
    for k in range(rows):
        cells = [f"{x:.9f}" for x in rng.normal(50, 5, 8)]
        if k in words:
            cells[words[k]] = "I/O Timeout"
        lines.append(f"2026-03-02 {k // 3600:02d}:{k // 60 % 60:02d}:{k % 60:02d},{','.join(cells)}")
    path.write_text("\n".join(lines) + "\n")
    assert path.stat().st_size > 1 << 20  # the parser decides the types on the first megabyte
    whole, streamed = both(path, monkeypatch, tmp_path)
    a, b = whole.read(TAGS[:8]), streamed.read(TAGS[:8])
    for k, tag in enumerate(TAGS[:8]):
        np.testing.assert_array_equal(a[tag].value, b[tag].value)
        assert np.flatnonzero(b[tag].bad).tolist() == [9000 + 300 * k]


def test_a_long_parquet_is_divided_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A long Parquet file with a dictionary of tags gives the same result if it is searched or divided by loop."""
    n, stamps = ROWS * len(TAGS), np.arange(ROWS) * 1_000_000 + 1_772_409_600_000_000
    table = pa.table(
        {
            "TagName": pa.DictionaryArray.from_arrays(
                np.tile(np.arange(len(TAGS), dtype=np.int32), ROWS), TAGS
            ),
            "DateTime": np.repeat(stamps, len(TAGS)).astype("datetime64[us]"),
            "Value": np.random.default_rng(3).normal(50, 5, n),
            "Quality": np.where(np.arange(n) % 50, 192, 0),
        }
    )
    pq.write_table(table, tmp_path / "x.parquet", row_group_size=1000)
    whole = open_export([tmp_path / "x.parquet"])
    monkeypatch.setattr("analyzer.history.export.WHOLE_ROWS", 100)
    parted = open_export([tmp_path / "x.parquet"], ReadOptions(scratch=tmp_path))
    table = parted.sources[0].table
    assert isinstance(table, ParquetTable)
    assert table.folder is not None
    assert (parted.tags, parted.span()) == (whole.tags, whole.span())
    a, b = whole.read(TAGS[:9]), parted.read(TAGS[:9])
    for tag in TAGS[:9]:
        np.testing.assert_array_equal(a[tag].value, b[tag].value)
        np.testing.assert_array_equal(a[tag].bad, b[tag].bad)


def test_an_open_quote_loses_no_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A quote that is not closed loses no other row of the file."""
    path = wide(tmp_path / "x.csv")
    text = path.read_text(encoding="cp1252").replace(stamp(5), '"' + stamp(5), 1)
    path.write_text(text, encoding="cp1252")
    whole, streamed = both(path, monkeypatch, tmp_path)
    a, b = (e.read([TAGS[0]])[TAGS[0]] for e in (whole, streamed))
    np.testing.assert_array_equal(a.value, b.value)
    assert any("a quote is not closed" in note for note in streamed.notes)


def test_the_copy_of_a_stopped_run_is_used_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A resumed run does not stream an unchanged big export again, reads the same samples, and streams a changed
    export again.
    """
    path, store = long(tmp_path / "x.csv", umlaut=True), tmp_path / "store"
    monkeypatch.setattr("analyzer.history.export.WHOLE_BYTES", 100)
    first: dict[str, Series] = {}

    def stop() -> None:
        with scratch(store) as copies:
            first.update(open_export([path], ReadOptions(scratch=copies)).read(TAGS[:4]))
            (copies / "converted-half").mkdir()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stop()
    passes: list[Path] = []
    plain = parquet._sheet_parted
    monkeypatch.setattr(parquet, "_sheet_parted", lambda *a: passes.append(a[2]) or plain(*a))  # type: ignore[func-returns-value]
    with scratch(store, resume=True) as copies:
        opened = open_export([path], ReadOptions(scratch=copies))
        again = opened.read(TAGS[:4])
        assert passes == []
        assert not (copies / "converted-half").exists()
        next(copies.glob("converted-*/*.parquet")).write_bytes(b"PAR1")  # without its end
        open_export([path], ReadOptions(scratch=copies))
        assert len(passes) == 1
        path.write_bytes(path.read_bytes().replace(b"192", b"000", 1))
        open_export([path], ReadOptions(scratch=copies))
        assert len(passes) == 2
    for tag in TAGS[:4]:
        np.testing.assert_array_equal(first[tag].value, again[tag].value)
        np.testing.assert_array_equal(first[tag].bad, again[tag].bad)
    assert not list(store.glob(".copies-*"))


def test_copies_of_an_active_run_are_used_by_no_other(tmp_path: Path) -> None:
    """A run uses or removes only copies of runs that have ended, and never those of a run that is still active."""
    with scratch(tmp_path) as living:
        (living / "converted-1").mkdir()
        (living / "converted-1" / "done.json").write_text("{}")
        with scratch(tmp_path, resume=True) as other:
            assert other != living
        with scratch(tmp_path):
            assert (living / "converted-1").exists()
    assert not list(tmp_path.glob(".*copies-*"))


MEASURE = """
import json, resource, sys
from pathlib import Path
import analyzer.history.export as export
export.WHOLE_BYTES = 1
from analyzer.history.table import ReadOptions
found = export.open_export([Path(sys.argv[1])], ReadOptions(scratch=Path(sys.argv[2])))
found.read(list(found.tags[:4]))
print(json.dumps(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no resource module")
def test_memory_does_not_grow_with_the_file(tmp_path: Path) -> None:
    """For a long file three times as large (75 MB), opening and reading a loop needs at most 25 % more memory."""
    peak = {}
    for times in (30, 90):
        path = tmp_path / f"{times}.csv"
        head, *rows = long(tmp_path / "part.csv").read_text().splitlines()
        with path.open("w") as file:
            file.write(head + "\n")
            for _ in range(times):
                file.write("\n".join(rows) + "\n")
        (tmp_path / str(times)).mkdir()
        command = [sys.executable, "-c", MEASURE, str(path), str(tmp_path / str(times))]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        peak[times] = json.loads(done.stdout)
    assert peak[90] < 1.25 * peak[30], peak
