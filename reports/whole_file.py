"""Atomic writing of files: a reader sees a complete file or none."""

from __future__ import annotations

import errno
import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

FULL = frozenset(getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EFBIG") if hasattr(errno, name))
"""System errors for a full disk, an exceeded quota or the largest file size."""


def is_full(error: OSError) -> bool:
    """Whether there was no space to write."""
    return error.errno in FULL


SUFFIX = ".tmp"
"""Ending of a file being written; such files of a process that died may be deleted."""


@contextmanager
def whole_file(path: Path, kept: bool = False) -> Iterator[Path]:
    """A temporary path whose file replaces `path` at the end, and is deleted after an error.

    Parameters
    ----------
    path : Path
        Its folder is created if necessary. If it is on shared storage, the object is replaced as a whole when the
        file is closed.
    kept : bool
        Wait until the file is on the disk, so that it is complete after a loss of power too.
    """
    if not isinstance(path, Path):
        with _uploaded(path) as begun:
            yield begun
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name[:80]}.{secrets.token_hex(8)}{SUFFIX}")
    flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY  # a link placed there is not followed
    os.close(os.open(temporary, flags, 0o666))
    try:
        yield temporary
        if kept:
            with temporary.open("r+b") as handle:
                os.fsync(handle.fileno())
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        named = error.filename is not None and str(error.filename) != str(temporary)
        if named or error.errno is None:
            raise
        raise OSError(error.errno, os.strerror(error.errno), str(path)) from error
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextmanager
def _uploaded(path: Any) -> Iterator[Path]:
    """A local path whose file replaces an object of shared storage."""
    with tempfile.TemporaryDirectory(prefix="triage-") as folder:
        temporary = Path(folder) / path.name
        temporary.touch()
        yield temporary
        path.fs.put_file(str(temporary), path.path)
