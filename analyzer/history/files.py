"""Which files an export consists of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from analyzer.history import workbook
from identification.errors import InputError

TEXT_ENDINGS = frozenset({".csv", ".txt", ".tsv"})
PARQUET_ENDINGS = frozenset({".parquet", ".pq"})
READ_PACKED = frozenset({".gz", ".bz2", ".xz", ".zip"})
PACKED_ENDINGS = frozenset({".7z"})
NO_EXPORTS = frozenset({"loops.csv", "labels.csv", "changes.csv"})
ENDS_BYTES = 65_536
"""Bytes at both ends of a file that stand for it beside its size; ours: headers, footers and the newest samples are
there, and a folder of thousands of files is known in a second."""
MAGIC = b"PAR1"
PACKED = {
    b"7z\xbc\xaf": ("a 7z archive", "unpack it and name what comes out"),
}
"""First bytes of files that hold an export in another wrapping: what they are, and what to do."""


def export_files(paths: Sequence[Path]) -> list[Path]:
    """Files behind the paths given, each once: in the order given, within a folder by name.

    Raises
    ------
    InputError
        A path is missing, cannot be opened, or is a folder without exports.
    """
    found: dict[Path, None] = {}
    for path in paths:
        found.update(dict.fromkeys(_within(Path(path))))
    if not found:
        raise InputError("no path to an export", "a file or a folder", "name the export to read")
    return list(found)


def ends_of(path: Path) -> bytes:
    """Size and both ends of a file, by which it is known."""
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(0)
        head = file.read(ENDS_BYTES)
        file.seek(max(size - ENDS_BYTES, 0))
        return str(size).encode() + head + file.read()


def is_parquet(path: Path) -> bool:
    """True for files that end as Parquet or begin as Parquet.

    Raises
    ------
    InputError
        The file is empty or cannot be opened.
    """
    try:
        with path.open("rb") as file:
            start = file.read(4)
    except OSError as error:
        raise _closed(path, error) from error
    if not start:
        raise InputError(f"{path}: empty file", "a table with a header and samples", "export it again")
    for magic, (what, remedy) in PACKED.items():
        if start.startswith(magic):
            raise InputError(f"{path}: {what}", "delimited text or Parquet", remedy)
    return start == MAGIC or path.suffix.lower() in PARQUET_ENDINGS


def packed_beside(paths: Sequence[Path]) -> list[str]:
    """Sentences on files of the folders given that hold an export in a wrapping that is not read."""
    said = []
    for folder in (Path(p) for p in paths if Path(p).is_dir()):
        found = sorted(p.name for p in folder.iterdir() if p.suffix.lower() in PACKED_ENDINGS)
        if found:
            said.append(f"{folder}: {', '.join(found[:5])} not read: unpack it, or save it as CSV")
    return said


def _within(path: Path) -> list[Path]:
    try:
        if not path.exists():
            raise InputError(
                f"{path}: no such file or folder", "an export or a folder of exports", "correct the path"
            )
        return _listed(path) if path.is_dir() else [path]
    except OSError as error:
        raise _closed(path, error) from error


def _listed(folder: Path) -> list[Path]:
    files = [path for path in sorted(folder.iterdir()) if path.is_file() and _is_export(path)]
    files = files or [path for path in sorted(folder.rglob("*")) if path.suffix.lower() in PARQUET_ENDINGS]
    if not files:
        packed = packed_beside([folder])
        raise InputError(
            packed[0] if packed else f"{folder}: a folder without exports",
            "files ending in .csv, .txt, .tsv, .parquet, .pq or .xlsx",
            "name the folder that holds the exports",
        )
    return files


def _is_export(path: Path) -> bool:
    known = path.suffix.lower() in TEXT_ENDINGS | PARQUET_ENDINGS | READ_PACKED | workbook.ENDINGS
    return known and path.name.lower() not in NO_EXPORTS and not path.name.startswith((".", "~$"))


def _closed(path: Path, error: OSError) -> InputError:
    return InputError(
        f"{path}: cannot be opened ({error.strerror or error})",
        "a file that may be read",
        "grant the permission to read",
    )
