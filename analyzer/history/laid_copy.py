"""A copy of an export as Parquet, laid whole or not at all, so that a run that goes on takes it up.

A copy is known by the file's name, size and both ends, by how it was read, and by this program's version.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from analyzer.history.files import ends_of
from identification.errors import InputError

DONE = "done.json"
"""What a copy says of itself; written last."""
NAMED = "converted-"


@dataclass(frozen=True, slots=True)
class Laid:
    """What a pass over an export found out: notes, the tags met in their order, and whether quotes were no quotes."""

    notes: tuple[str, ...] = ()
    tags: tuple[str, ...] = ()
    unquoted: bool = False


def laid(
    place: Path, path: Path, room: int, how: tuple[object, ...], lay: Callable[[Path], Laid]
) -> tuple[Path, Laid]:
    """The folder of a copy of a file and what it says of itself; laid by `lay` where `place` has none yet.

    Parameters
    ----------
    place : Path
        The directory of copies.
    path : Path
        The export.
    room : int
        Free bytes that a new copy needs.
    how : tuple
        How the export is read.
    lay : callable
        Writes the copy into a folder that is given.

    Raises
    ------
    InputError
        The disk has no room; and what `lay` raises.
    """
    mark = hashlib.blake2b(ends_of(path), digest_size=16)
    mark.update(repr((path.name, how, version("loop-triage"))).encode())
    folder = place / f"{NAMED}{mark.hexdigest()}"
    found = _said(folder)
    if found is not None:
        return folder, found
    if shutil.disk_usage(place).free < room:
        seen = f"{path}: no room for a copy of {room / 1e9:.1f} GB in {place}"
        raise InputError(seen, "free disk", "make room")
    made = Path(tempfile.mkdtemp(prefix=NAMED, dir=place))
    done = lay(made)
    (made / DONE).write_text(json.dumps(asdict(done)), encoding="utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    os.replace(made, folder)
    return folder, done


def _said(folder: Path) -> Laid | None:
    """What a whole copy says of itself; None where there is none, or a file of it lost its end with the power."""
    try:
        found = json.loads((folder / DONE).read_text(encoding="utf-8"))
        for path in folder.glob("*.parquet"):
            pq.read_metadata(path)
        return Laid(tuple(found["notes"]), tuple(found["tags"]), found["unquoted"])
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError):
        return None


def holds_copies(place: Path) -> bool:
    """Whether a directory of copies holds a whole one."""
    return any(place.glob(f"{NAMED}*/{DONE}"))


def forget_halves(place: Path) -> None:
    """Remove what a process that died left half done in a directory of copies."""
    for left in place.iterdir():
        if left.is_dir() and not (left / DONE).exists():
            shutil.rmtree(left, ignore_errors=True)
