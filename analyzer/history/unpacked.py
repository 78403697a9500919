"""Packed exports laid beside as plain ones, bounded: gzip, bzip2, xz, a zip archive of one file, and workbooks."""

from __future__ import annotations

import atexit
import bz2
import gzip
import lzma
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from analyzer.history import workbook
from identification.errors import InputError

BLOCK_BYTES = 1 << 20
MOST_TIMES = 200.0
"""Times that a file may be larger unpacked than packed, beyond `ALWAYS_BYTES`; ours: exports of a plant at rest
shrink to a hundredth, and what shrinks further is made to fill a disk."""
ALWAYS_BYTES = 100e6
"""Size up to which anything is unpacked [bytes]."""
MOST_OF_DISK = 0.8
"""Share of the disk's room that an unpacked file may take [-]; ours: the night needs the rest."""
STREAMS: dict[bytes, Callable[..., Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zX": lzma.open,
}
"""How files that begin so are opened."""
ZIP = b"PK\x03\x04"
PACKED_ENDINGS = frozenset({".gz", ".bz2", ".xz", ".zip"})


@lru_cache(maxsize=1)
def own_scratch() -> Path:
    """A directory of this process, gone with it."""
    made = Path(tempfile.mkdtemp(prefix="triage-"))
    atexit.register(shutil.rmtree, made, True)
    return made


def unpacked(path: Path, scratch: Path | None) -> list[Path]:
    """The file itself, or, where it is packed, a plain copy of it under `scratch` (None: this process's own), or the
    tables of a workbook.

    Raises
    ------
    InputError
        It is damaged, would fill the disk, or is an archive of several files or with a password.
    """
    with path.open("rb") as file:
        start = file.read(5)
    if workbook.is_workbook(path, start):
        _check_parts(path, scratch or own_scratch())
        return workbook.as_text(
            path, Path(tempfile.mkdtemp(prefix="workbook-", dir=scratch or own_scratch()))
        )
    stream = next((STREAMS[magic] for magic in STREAMS if start.startswith(magic)), None)
    if stream is None and not start.startswith(ZIP):
        return [path]
    folder = Path(tempfile.mkdtemp(prefix="unpacked-", dir=scratch or own_scratch()))
    try:
        if stream is not None:
            out = folder / (path.stem if path.suffix.lower() in PACKED_ENDINGS else path.name)
            with stream(path, "rb") as source:
                _copied(source, out, path)
            return [out]
        return [_member(path, folder)]
    except (OSError, EOFError, zipfile.BadZipFile, lzma.LZMAError, RuntimeError, zlib.error) as error:
        why = " ".join(str(error).split())[:80] or type(error).__name__
        raise InputError(
            f"{path}: cannot be unpacked ({why})", "a whole archive", "export it again"
        ) from error


def _member(path: Path, folder: Path) -> Path:
    """The one file of a zip archive."""
    with zipfile.ZipFile(path) as archive:
        held = [info for info in archive.infolist() if not info.is_dir()]
        if len(held) != 1:
            seen = f"{path}: an archive of {len(held)} files"
            raise InputError(seen, "an archive of one file", "unpack it and name the folder")
        if held[0].flag_bits & 1:
            raise InputError(
                f"{path}: an archive with a password", "one without", "unpack it and name the file"
            )
        _check_size(path, held[0].file_size, 0, folder)
        out = folder / Path(held[0].filename.replace("\\", "/")).name
        with archive.open(held[0]) as source:
            _copied(source, out, path)
        return out


def _check_parts(path: Path, folder: Path) -> None:
    """Raise InputError for a workbook (an archive, but for the old kind) whose parts unpack beyond all measure."""
    try:
        with zipfile.ZipFile(path) as archive:
            declared = sum(info.file_size for info in archive.infolist())
    except zipfile.BadZipFile:  # of the old kind, or damaged, which its reader tells
        return
    _check_size(path, declared, 0, folder)


def _copied(source: IO[Any], out: Path, path: Path) -> None:
    """Copy what a stream unpacks, stopping where it grows beyond all measure."""
    done = 0
    with out.open("wb") as file:
        while block := source.read(BLOCK_BYTES):
            done += len(block)
            _check_size(path, done, done, out.parent)
            file.write(block)


def _check_size(path: Path, size: int, written: int, folder: Path) -> None:
    """Raise InputError where a file of `size` bytes, some of them `written` to a folder, is beyond all measure or the
    disk's room."""
    packed = path.stat().st_size
    if size > max(MOST_TIMES * packed, ALWAYS_BYTES):
        raise InputError(
            f"{path}: {packed} bytes that unpack to more than {size / 1e6:.0f} MB",
            f"at most {MOST_TIMES:g} times as much",
            "unpack it where there is room, and name what comes out",
        )
    if size > ALWAYS_BYTES and size > MOST_OF_DISK * (shutil.disk_usage(folder).free + written):
        raise InputError(
            f"{path}: no room to unpack it", "free disk", "unpack it elsewhere and name what comes out"
        )
