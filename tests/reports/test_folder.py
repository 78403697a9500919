"""A folder of pages holds the files that were written last, and no file of an earlier run."""

from __future__ import annotations

from pathlib import Path

from reports.folder import forget_stale


def test_tables_of_a_stale_page_are_removed(tmp_path: Path) -> None:
    """Tables of a removed page are removed too. Tables of a page whose name starts with the same text, and
    other files, stay."""
    kept = ["csv/FIC1-2-ranking.csv", "csv/index-worst.csv", "mine.html", "FIC1-2.html"]
    (tmp_path / "csv").mkdir()
    for name in (*kept, "FIC1.html", "csv/FIC1-ranking.csv"):
        (tmp_path / name).write_text("x", encoding="utf-8")
    forget_stale(tmp_path, ["FIC1.html", "FIC1-2.html"])
    assert forget_stale(tmp_path, ["FIC1-2.html", "index.html"]) == ["FIC1.html"]
    left = {p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*") if p.is_file()}
    assert left == {*kept, "pages.json"}
