"""One run on a store at a time: the lock, and who holds it.

The lock is the system's own (filelock: flock or its like), so it ends with its owner, however that ends; the text
beside it is for people.
"""

from __future__ import annotations

import contextlib
import getpass
import json
import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from identification.errors import InputError

LOCK, OWNER = "run.lock", "run.owner.json"
"""Names within the store."""
SCRATCH = ".copies-"
"""Beginning of the names of directories of copies."""
LEFT_OVER_S = 86_400.0
"""Age from which something half done is left over from a process that died [s]; ours."""


@contextmanager
def scratch(store: Path) -> Iterator[Path]:
    """A directory in the store for the copies that a run makes of packed exports, gone with the run.

    That it can be made shows, before any work is done, that the store can be written; those of runs that were killed
    go after a day.

    Raises
    ------
    OSError
        The store cannot be made or written.
    """
    store.mkdir(parents=True, exist_ok=True)
    for left in store.glob(f"{SCRATCH}*"):
        if time.time() - left.stat().st_mtime > LEFT_OVER_S:
            shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=SCRATCH, dir=store, ignore_cleanup_errors=True) as made:
        yield Path(made)


@contextmanager
def locked(store: Path) -> Iterator[None]:
    """Hold the store for one run.

    Raises
    ------
    InputError
        Another run holds it; says who, where and since when.
    """
    from filelock import FileLock, Timeout

    store.mkdir(parents=True, exist_ok=True)
    lock = FileLock(store / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise InputError(
            f"{store}: in use by {_owner(store)}",
            "one run on a store at a time",
            "wait until that run ends, or give another --store",
        ) from error
    try:
        _sign(store)
        yield
    finally:
        with contextlib.suppress(OSError):
            (store / OWNER).unlink()
        lock.release()


def _sign(store: Path) -> None:
    """Write down who holds the store."""
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    owner = {"user": _user(), "host": socket.gethostname(), "process": os.getpid(), "since": now}
    (store / OWNER).write_text(json.dumps(owner), encoding="utf-8")


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return "a user without a name"


def _owner(store: Path) -> str:
    """Who holds the store, as far as it is written down."""
    try:
        owner = json.loads((store / OWNER).read_text(encoding="utf-8"))
        return f"process {owner['process']} of {owner['user']} on {owner['host']} since {owner['since']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "another run"
