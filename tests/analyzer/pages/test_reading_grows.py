"""The cost of reading grows with the size of the store, not with its square."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from analyzer.columns import NIGHTS
from analyzer.pages import night as night_pages
from analyzer.pages.reading import remembered_columns
from analyzer.store.store import Store
from analyzer.store.table import read_stored, rows_table, write_table


def test_parts_of_a_table_without_a_requested_loop_are_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loops in any order are found, and only the parts that contain them are read completely."""
    names = [f"L{(7 * k) % 40:02d}" for k in range(40)]
    parts = [pa.table({"loop": names[k : k + 4], "reason": ["x" * 9] * 4}) for k in range(0, 40, 4)]
    write_table(parts, tmp_path / "2026-03-02.parquet")
    read, whole = pq.ParquetFile.read_row_group, []

    def counted(file: pq.ParquetFile, group: int, columns: list[str]) -> pa.Table:
        whole.extend([group] if "reason" in columns else [])
        return read(file, group, columns=columns)

    monkeypatch.setattr(pq.ParquetFile, "read_row_group", counted)
    found = read_stored(tmp_path / "2026-03-02.parquet", ["loop", "reason"], {names[0], names[1], names[30]})
    assert found.column("loop").to_pylist() == [names[0], names[1], names[30]]
    assert whole == [0, 7]


def test_pages_of_many_nights_read_each_night_before_them_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pages of several nights read each earlier night once, although each page uses all of them."""
    store = Store(tmp_path)
    store.upgrade()
    for k in range(2, 9):
        rows = [{"loop": f"L{i}", "status": "ok", "timezone": "UTC"} for i in range(3)]
        store.write("nights", f"2026-03-0{k}", rows_table(rows, NIGHTS))
    read = Counter[str]()

    def counted(store: Store, night: str) -> list[dict[str, object]]:
        read[night] += 1
        return remembered_columns(store, night)

    monkeypatch.setattr(night_pages, "remembered_columns", counted)
    pages = list(night_pages.dated_pages(store, None, lambda _: False))
    assert [page.name for page in pages] == [f"morning-2026-03-0{k}" for k in range(2, 9)]
    assert read == {f"2026-03-0{k}": 1 for k in range(2, 8)}
