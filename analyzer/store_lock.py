"""One run on a store at a time: the lock, and who holds it.

The lock is the system's own (filelock: flock or its like), so it ends with its owner, however that ends; the text
beside it is for people.
"""

from __future__ import annotations

import contextlib
import getpass
import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from identification.errors import InputError
from reports.whole_file import whole_file

LOCK, OWNER = "run.lock", "run.owner.json"
"""Names within the store."""


def require_writable(store: Path) -> None:
    """Make the store's directory and try to write in it, before any work is done for it.

    Raises
    ------
    OSError
        It cannot be made or written.
    """
    store.mkdir(parents=True, exist_ok=True)
    with whole_file(store / "writable") as trial:
        trial.write_bytes(b"x")
    (store / "writable").unlink()


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
