"""Workbooks laid beside as text: each sheet that holds a table, cell by cell as it is stored and not as it is shown.

Read by python-calamine (extra `excel`): xlsx, xlsm, xlsb, xls and ods. What a sheet holds is found out as of text.
"""

from __future__ import annotations

import csv
import datetime as dt
import importlib.util
import re
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from identification.errors import InputError

ENDINGS = frozenset({".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"})
OLD = b"\xd0\xcf\x11\xe0"
"""First bytes of a workbook of the old kind."""
FEWEST = 2
"""Rows and columns of a table at least: a header and a sample, stamps and values."""
PLAIN = re.compile(r"[^\w.-]+")
"""What stands for nothing in the name of a file."""


def is_workbook(path: Path, start: bytes) -> bool:
    """Whether a file that begins so is a workbook; text that is only called one is none."""
    if start.startswith(OLD):
        return True
    if not start.startswith(b"PK\x03\x04"):
        return False
    if path.suffix.lower() in ENDINGS:
        return True
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name.startswith("xl/") for name in archive.namelist())
    except (zipfile.BadZipFile, OSError):
        return False


def can_be_read() -> bool:
    """Whether the package that reads workbooks is there."""
    return importlib.util.find_spec("python_calamine") is not None


def sheets_as_text(path: Path, folder: Path) -> list[Path]:
    """Each sheet of a workbook that holds a table as a text file of its own under `folder`, in their order.

    Raises
    ------
    InputError
        The package is missing, the file is damaged or has a password, or no sheet holds a table.
    """
    if not can_be_read():
        raise InputError(
            f"{path}: a workbook",
            "delimited text or Parquet, or the extra 'excel'",
            "pip install 'loop-triage[excel]', or save the sheet as CSV and name that file",
        )
    try:
        found = _sheets(path, folder)
    except (OSError, ValueError, RuntimeError) as error:
        raise _damaged(path, error) from error
    except BaseException as error:  # a panic of the reader is no Exception
        if type(error).__name__ != "PanicException":
            raise
        raise _damaged(path, error) from error
    if not found:
        raise InputError(
            f"{path}: no sheet with a table", "stamps, tags and samples in a sheet", "name another file"
        )
    return found


def _damaged(path: Path, error: BaseException) -> InputError:
    why = " ".join(str(error).split())[:80] or type(error).__name__
    remedy = "open it and save it anew, without a password, or as CSV"
    return InputError(f"{path}: cannot be read as a workbook ({why})", "a whole workbook", remedy)


def _sheets(path: Path, folder: Path) -> list[Path]:
    from python_calamine import CalamineError, CalamineWorkbook

    try:
        book = CalamineWorkbook.from_path(str(path))
        names = list(book.sheet_names)
    except CalamineError as error:
        raise ValueError(str(error)) from error
    out = []
    for at, name in enumerate(names):
        try:
            sheet = book.get_sheet_by_index(at)
        except CalamineError:  # a chart, or a macro
            continue
        if sheet.height < FEWEST or sheet.width < FEWEST:
            continue
        written = folder / f"{path.name}, sheet {at + 1} {PLAIN.sub('_', name)[:40]}".rstrip()
        _write(sheet.iter_rows(), written)
        out.append(written)
    return out


def _write(rows: Iterable[list[Any]], path: Path) -> None:
    """Rows as tab-delimited text; rows without a cell are left out, and titles above a table stand alone."""
    above = True
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, delimiter="\t", lineterminator="\n")
        for row in rows:
            cells = [_text(cell) for cell in row]
            filled = [cell for cell in cells if cell]
            above = above and len(filled) < FEWEST
            if filled:
                writer.writerow(filled if above else cells)


def _text(cell: Any) -> str:
    """A cell as text: stamps in ISO form, numbers with all their digits."""
    if isinstance(cell, bool):
        return str(int(cell))
    if isinstance(cell, float):
        return f"{cell:.15g}"
    if isinstance(cell, dt.datetime):
        return cell.isoformat(sep=" ")
    if isinstance(cell, dt.date | dt.time):
        return cell.isoformat()
    return str(cell)
