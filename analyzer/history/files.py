"""Files of an export. Packed files (gzip, bzip2, xz, zip archives of one file) and workbooks are converted to plain
copies within size limits, workbooks one sheet at a time as text, with cells as stored, not as displayed.

Workbooks are read by python-calamine (extra `excel`): xlsx, xlsm, xlsb, xls and ods.
"""

from __future__ import annotations

import atexit
import bz2
import codecs
import csv
import gzip
import hashlib
import lzma
import re
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from analyzer.history.cell_spread import require_dense
from identification.errors import InputError

ENDS_BYTES = 65536
"""Part at both ends of a file that identifies it together with its size [bytes]: headers, footers and the
newest samples are there, and a folder of thousands of files is known in a second."""
UNPACKED_TIMES = 200.0
"""Largest ratio of unpacked to packed size of a file above unpacked_bytes. Exports of an idle plant shrink
to a hundredth; a file that shrinks further is made to fill a disk."""
UNPACKED_BYTES = 100000000.0  # Size up to which anything is unpacked [bytes]
DISK_SHARE = 0.8  # Share of the disk's room that an unpacked file may take: the night needs the rest

TEXT_ENDINGS = frozenset({".csv", ".txt", ".tsv"})
PARQUET_ENDINGS = frozenset({".parquet", ".pq"})
PACKED_ENDINGS = frozenset({".gz", ".bz2", ".xz", ".zip"})
WORKBOOK_ENDINGS = frozenset({".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"})
READ_ENDINGS = TEXT_ENDINGS | PARQUET_ENDINGS | PACKED_ENDINGS | WORKBOOK_ENDINGS
NOT_READ_ENDING = ".7z"
NO_EXPORTS = frozenset({"loops.csv", "labels.csv", "changes.csv"})
PARQUET, ZIP, SEVEN_ZIP = b"PAR1", b"PK\x03\x04", b"7z\xbc\xaf"
STREAMS: dict[bytes, Callable[..., Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zX": lzma.open,
}
"""Openers by the first bytes of a file."""
OLD = b"\xd0\xcf\x11\xe0"
"""First bytes of a workbook of the old format."""
FEWEST = 2
"""Minimum rows and columns of a table: a header and a sample, stamps and values."""
PLAIN = re.compile(r"[^\w.-]+")
"""Characters that are replaced in the name of a copy."""
BLOCK_BYTES = 1 << 20


ENCODINGS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def detect_encoding(head: bytes) -> str:
    """Encoding by byte-order mark, by the zeros of UTF-16, by valid UTF-8; else Windows Latin."""
    for mark, name in ENCODINGS:
        if head.startswith(mark):
            return name
    if head[1:400:2].count(0) > 100 or (len(head) < 400 and head[1::2].count(0) * 3 > len(head)):
        return "utf-16-le"
    if head[0:400:2].count(0) > 100:
        return "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def export_files(paths: Sequence[Path]) -> list[Path]:
    """Files of the given paths, each once: in the given order, within a folder by name.

    Raises
    ------
    InputError
        A path is missing, cannot be opened, or is a folder without exports.
    """
    found = list(dict.fromkeys(file for path in paths for file in _exports_at(Path(path))))
    if not found:
        raise InputError("no path to an export", "a file or a folder", "name the export to read")
    return found


def ends_of(path: Path) -> bytes:
    """Size and both ends of a file, by which it is identified."""
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(0)
        head = file.read(ENDS_BYTES)
        file.seek(max(size - ENDS_BYTES, 0))
        return str(size).encode() + head + file.read()


@dataclass(frozen=True, slots=True)
class Mark:
    """Identification of a file: size, time of its last change [ns], and a digest of both ends."""

    size: int
    changed_ns: int
    ends: bytes


def mark_of(path: Path) -> Mark:
    """The present mark of a file. Raises OSError where it cannot be read."""
    stat = path.stat()
    return Mark(stat.st_size, stat.st_mtime_ns, hashlib.blake2b(ends_of(path), digest_size=16).digest())


class ChangedError(InputError):
    """A file of an export was changed or removed while it was read."""


def require_unchanged(marks: Mapping[Path, Mark]) -> None:
    """Raise ChangedError where a file has changed since it was opened."""
    for path, mark in marks.items():
        try:
            same, seen = mark_of(path) == mark, f"{path}: was written to while it was read"
        except OSError as error:
            same, seen = False, f"{path}: was removed while it was read ({error.strerror or error})"
        if not same:
            remedy = "nothing of it was kept; run it when the historian has finished"
            raise ChangedError(seen, "an export that stays as it is until the run ends", remedy)


def is_parquet(path: Path) -> bool:
    """True for files with the ending or the first bytes of Parquet.

    Raises
    ------
    InputError
        The file is empty, or packed in an unsupported way.
    """
    with path.open("rb") as file:
        start = file.read(4)
    if not start:
        raise InputError(f"{path}: empty file", "a table with a header and samples", "export it again")
    if start == SEVEN_ZIP:
        remedy = "unpack it and name what comes out"
        raise InputError(f"{path}: a 7z archive", "delimited text or Parquet", remedy)
    return start == PARQUET or path.suffix.lower() in PARQUET_ENDINGS


def unsupported_archives(paths: Sequence[Path]) -> list[str]:
    """Sentences on export files in the given folders that are packed in an unsupported way."""
    notes = []
    for folder in (Path(p) for p in paths if Path(p).is_dir()):
        found = sorted(p.name for p in folder.iterdir() if p.suffix.lower() == NOT_READ_ENDING)
        if found:
            notes.append(f"{folder}: {', '.join(found[:5])} not read: unpack it, or save it as CSV")
    return notes


def _exports_at(path: Path) -> list[Path]:
    try:
        if not path.exists():
            expected = "an export or a folder of exports"
            raise InputError(f"{path}: no such file or folder", expected, "correct the path")
        if not path.is_dir():
            return [path]
        files = [found for found in sorted(path.iterdir()) if found.is_file() and _is_export(found)]
        files = files or [p for p in sorted(path.rglob("*")) if p.suffix.lower() in PARQUET_ENDINGS]
        seen = next(iter(unsupported_archives([path])), f"{path}: a folder without exports")
    except OSError as error:
        seen = f"{path}: cannot be opened ({error.strerror or error})"
        raise InputError(seen, "a file that may be read", "grant the permission to read") from error
    if not files:
        expected = "files ending in .csv, .txt, .tsv, .parquet, .pq or .xlsx"
        raise InputError(seen, expected, "name the folder that holds the exports")
    return files


def _is_export(path: Path) -> bool:
    known = path.suffix.lower() in READ_ENDINGS and path.name.lower() not in NO_EXPORTS
    return known and not path.name.startswith((".", "~$"))


@lru_cache(maxsize=1)
def own_scratch() -> Path:
    """A temporary directory of this process."""
    folder = Path(tempfile.mkdtemp(prefix="triage-"))
    atexit.register(shutil.rmtree, folder, True)
    return folder


def unpacked(path: Path, place: Path) -> list[Path]:
    """The file itself, or, if it is packed, a plain copy of it under `place`, or the tables of a workbook.

    Raises
    ------
    InputError
        It is damaged, would fill the disk, or is an archive of several files or with a password.
    """
    with path.open("rb") as file:
        start = file.read(5)
    members = _members(path) if start.startswith(ZIP) else []
    # a text file with the ending of a workbook is no workbook
    named = start.startswith(ZIP) and path.suffix.lower() in WORKBOOK_ENDINGS
    if start.startswith(OLD) or named or any(info.filename.startswith("xl/") for info in members):
        _check_size(path, sum(info.file_size for info in members), 0, place)
        require_dense(path, members)
        return sheets_as_text(path, Path(tempfile.mkdtemp(prefix="workbook-", dir=place)))
    stream = next((STREAMS[magic] for magic in STREAMS if start.startswith(magic)), None)
    if stream is None and not start.startswith(ZIP):
        return [path]
    folder = Path(tempfile.mkdtemp(prefix="unpacked-", dir=place))
    try:
        if stream is None:
            return [_archive_member(path, folder)]
        out = folder / (path.stem if path.suffix.lower() in PACKED_ENDINGS else path.name)
        with stream(path, "rb") as source:
            return [_copied(source, out, path)]
    except (OSError, EOFError, zipfile.BadZipFile, lzma.LZMAError, RuntimeError, zlib.error) as error:
        seen = f"{path}: cannot be unpacked ({_why(error)})"
        raise InputError(seen, "a whole archive", "export it again") from error


def _members(path: Path) -> list[zipfile.ZipInfo]:
    """Members of an archive; empty for a damaged one, which its reader reports."""
    try:
        with zipfile.ZipFile(path) as archive:
            return archive.infolist()
    except (zipfile.BadZipFile, OSError):
        return []


def _archive_member(path: Path, folder: Path) -> Path:
    """The one file of a zip archive."""
    with zipfile.ZipFile(path) as archive:
        members = [info for info in archive.infolist() if not info.is_dir()]
        if len(members) != 1:
            seen = f"{path}: an archive of {len(members)} files"
            raise InputError(seen, "an archive of one file", "unpack it and name the folder")
        if members[0].flag_bits & 1:
            seen = f"{path}: an archive with a password"
            raise InputError(seen, "an archive without a password", "unpack it and name the file")
        _check_size(path, members[0].file_size, 0, folder)
        out = folder / Path(members[0].filename.replace("\\", "/")).name
        with archive.open(members[0]) as source:
            return _copied(source, out, path)


def _copied(source: IO[Any], out: Path, path: Path) -> Path:
    """Copy the unpacked contents of a stream, up to a size limit."""
    done = 0
    with out.open("wb") as file:
        while block := source.read(BLOCK_BYTES):
            done += len(block)
            _check_size(path, done, done, out.parent)
            file.write(block)
    return out


def _check_size(path: Path, size: int, written: int, folder: Path) -> None:
    """Raise InputError if a file of `size` bytes, some of them `written` to a folder, exceeds the size limit or the
    free space of the disk."""
    packed = path.stat().st_size
    if size > max(UNPACKED_TIMES * packed, UNPACKED_BYTES):
        seen = f"{path}: {packed} bytes that unpack to more than {size / 1e6:.0f} MB"
        remedy = "unpack it where there is space, and name the result"
        raise InputError(seen, f"at most {UNPACKED_TIMES:g} times as much", remedy)
    room = shutil.disk_usage(folder).free + written
    if size > UNPACKED_BYTES and size > DISK_SHARE * room:
        remedy = "unpack it elsewhere and name the result"
        raise InputError(f"{path}: no room to unpack it", "free space on the disk", remedy)


def sheets_as_text(path: Path, folder: Path) -> list[Path]:
    """Each sheet of a workbook that has a table as a separate text file under `folder`, in their order.

    Raises
    ------
    InputError
        The package is missing, the file is damaged or has a password, or no sheet has a table.
    """
    try:
        from python_calamine import CalamineError
    except ImportError as error:
        remedy = "pip install 'loop-triage[excel]', or save the sheet as CSV and name that file"
        seen, expected = f"{path}: a workbook", "delimited text or Parquet, or the extra 'excel'"
        raise InputError(seen, expected, remedy) from error
    try:
        found = _sheets(path, folder)
    except BaseException as error:  # a panic of the reader is not an Exception
        known = isinstance(error, OSError | ValueError | RuntimeError | CalamineError)
        if not known and type(error).__name__ != "PanicException":
            raise
        seen = f"{path}: cannot be read as a workbook ({_why(error)})"
        remedy = "open it and save it again, without a password, or as CSV"
        raise InputError(seen, "a whole workbook", remedy) from error
    if not found:
        seen = f"{path}: no sheet with a table"
        raise InputError(seen, "stamps, tags and samples in a sheet", "name another file")
    return found


def _why(error: BaseException) -> str:
    return " ".join(str(error).split())[:80] or type(error).__name__


def _sheets(path: Path, folder: Path) -> list[Path]:
    from python_calamine import CalamineError, CalamineWorkbook

    book = CalamineWorkbook.from_path(str(path))
    out = []
    for at, name in enumerate(book.sheet_names):
        try:
            sheet = book.get_sheet_by_index(at)
        except CalamineError:  # a chart, or a macro
            continue
        if sheet.height >= FEWEST and sheet.width >= FEWEST:
            out.append(folder / f"{path.name}, sheet {at + 1} {PLAIN.sub('_', name)[:40]}".rstrip())
            _write(sheet.iter_rows(), out[-1])
    return out


def _write(rows: Iterable[list[Any]], path: Path) -> None:
    """Rows as tab-delimited text, without empty rows; titles above a table are separate lines."""
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
    return f"{cell:.15g}" if isinstance(cell, float) else str(cell)
