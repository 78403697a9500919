"""Writing of pages to a folder: HTML or Markdown, shared assets, a CSV file of every table."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from reports import html, markdown, pictures
from reports.pages import Page
from reports.plain import as_csv
from reports.whole_file import whole_file


def write_text(path: Path, text: str) -> Path:
    """Write a file atomically: a reader sees either the new file or the previous one."""
    with whole_file(path) as temporary:
        temporary.write_text(text, "utf-8", newline="\n")
    return path


WRITTEN = "pages.json"
"""File in a folder with the names of the pages written there."""


def forget_stale(out: Path, names: Sequence[str], kept_names: Collection[str] = ()) -> list[str]:
    """Delete pages of an earlier run from a folder, except the files of this run (`names`) and `kept_names`; no other
    file is deleted."""
    try:
        before = json.loads((out / WRITTEN).read_text("utf-8"))
    except (OSError, ValueError):
        before = []
    known = [n for n in before if isinstance(n, str) and Path(n).name == n and Path(n).suffix == ".html"]
    stale = [n for n in known if n not in names and n not in kept_names]
    for name in stale:
        (out / name).unlink(missing_ok=True)
    _forget_tables(out / "csv", {Path(n).stem for n in stale}, {Path(n).stem for n in (*names, *kept_names)})
    write_text(out / WRITTEN, json.dumps(sorted({*names, *(set(known) - set(stale))})))
    return stale


def _forget_tables(folder: Path, stale: Collection[str], kept: Collection[str]) -> None:
    """Delete the tables of stale pages; a table belongs to the page with the longest matching name."""
    for table in sorted(folder.glob("*.csv")) if stale else ():
        owners = [s for s in (*stale, *kept) if table.name[: len(s) + 1] == f"{s}-"]
        if owners and max(owners, key=len) in stale:
            table.unlink(missing_ok=True)


def write_csv(page: Page, out: Path) -> list[Path]:
    """Write a CSV file of every table of a page to `out`/csv."""
    return [write_text(out / "csv" / f"{page.name}-{t.name}.csv", as_csv(t)) for t in page.tables()]


def write_html(pages: Iterable[Page], out: Path, single_file: bool = False) -> list[Path]:
    """Write pages as HTML, with shared assets in the folder unless each page is a single file."""
    if not single_file:
        for name in (*html.ASSETS, html.LICENCE):
            write_text(out / "assets" / name, html.asset(name))
    return [write_text(out / f"{page.name}.html", html.render(page, single_file)) for page in pages]


def write_markdown(pages: Iterable[Page], out: Path) -> list[Path]:
    """Write pages as Markdown, with their pictures in a folder of the page's name."""
    written = []
    for page in pages:
        folder = f"{page.name}-pictures"
        for block in markdown.pictures(page):
            write_text(out / folder / f"{block.name}.svg", pictures.as_file(block, page.zone))
        written.append(write_text(out / f"{page.name}.md", markdown.render(page, folder)))
    return written
