"""One run on a store at a time: the lock, and who holds it.

The lock is the system's own (filelock: flock or its like), so it ends with its owner, however that ends; the text
beside it is for people.
"""

from __future__ import annotations

import contextlib
import getpass
import json
import math
import os
import secrets
import shutil
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analyzer.history.converted import forget_halves, holds_copies
from analyzer.places import answering, content, is_remote
from identification.errors import InputError

if TYPE_CHECKING:
    from filelock import BaseFileLock

LOCK, OWNER = "run.lock", "run.owner.json"
"""Names within the store."""
SCRATCH, MAKING = ".copies-", ".making"
"""Beginning of the names of directories of copies, and what stands before it until they are locked."""
TRIED = ".written"
"""Name of an object that shows whether shared storage can be written."""
ALIVE_S, DEAD_S = 60.0, 600.0
"""How often a holder of shared storage signs anew, and the age from which its signature is a dead run's [s]; ours."""
LEFT_OVER_S = 86_400.0
"""Age from which something half done is left over from a process that died [s]; ours."""


@contextmanager
def scratch(store: Path, resume: bool = False) -> Iterator[Path]:
    """A directory in the store for the copies that a run makes of packed and of big exports; beside a store of shared
    storage one of this machine.

    That it can be made shows, before any work is done, that the store can be written. It goes with the run; where an
    exception ends the run and a whole copy was made, it stays, as that of a run that was killed does: a run that
    goes on (`resume`) takes it up, any other forgets it.

    Raises
    ------
    OSError
        The store cannot be made or written.
    """
    if is_remote(store):
        with answering(store):
            (store / TRIED).write_text("")
            (store / TRIED).unlink()
        with tempfile.TemporaryDirectory(prefix="triage-copies-", ignore_cleanup_errors=True) as made:
            yield Path(made)
        return
    store.mkdir(parents=True, exist_ok=True)
    place, mine = _held_scratch(store, resume)
    kept = False
    try:
        yield place
    except BaseException:
        kept = holds_copies(place)
        raise
    finally:
        mine.release()
        if not kept:
            shutil.rmtree(place, ignore_errors=True)


def _held_scratch(store: Path, resume: bool) -> tuple[Path, BaseFileLock]:
    """A directory of copies and the lock that says that it is in use: the newest that nobody uses where a run goes
    on, else a new one. Others that nobody uses are removed."""
    from filelock import FileLock, Timeout

    for left in store.glob(f"{MAKING}{SCRATCH}*"):
        if time.time() - _changed_s(left) > LEFT_OVER_S:
            shutil.rmtree(left, ignore_errors=True)
    taken: tuple[Path, BaseFileLock] | None = None
    for left in sorted(store.glob(f"{SCRATCH}*"), key=_changed_s, reverse=True):
        lock = FileLock(left / LOCK)
        try:
            lock.acquire(timeout=0)
        except (Timeout, OSError):
            continue
        if resume and taken is None and holds_copies(left):
            taken = left, lock
            continue
        lock.release()
        shutil.rmtree(left, ignore_errors=True)
    if taken is not None:
        forget_halves(taken[0])
        return taken
    made = Path(tempfile.mkdtemp(prefix=f"{MAKING}{SCRATCH}", dir=store))
    lock = FileLock(made / LOCK)
    lock.acquire(timeout=0)
    place = made.with_name(made.name.removeprefix(MAKING))  # others see it once it is locked
    made.rename(place)
    return place, lock


def _changed_s(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


@contextmanager
def locked(store: Path) -> Iterator[None]:
    """Hold the store for one run.

    Raises
    ------
    InputError
        Another run holds it; says who, where and since when.
    """
    if is_remote(store):
        with _signed(store):
            yield
        return
    from filelock import FileLock, Timeout

    store.mkdir(parents=True, exist_ok=True)
    lock = FileLock(store / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise _in_use(store) from error
    try:
        _sign(store)
        yield
    finally:
        with contextlib.suppress(OSError):
            (store / OWNER).unlink()
        lock.release()


@contextmanager
def _signed(store: Path) -> Iterator[None]:
    """Hold a store of shared storage, which has no locks, by a signature that is written anew while the run lives."""
    with answering(store):
        held = _signature(store)
    alive_s = (held or {}).get("alive_s")
    if isinstance(alive_s, int | float) and time.time() - alive_s < DEAD_S:
        left = max(math.ceil((DEAD_S + alive_s - time.time()) / 60.0), 1)
        raise _in_use(store, f"; if it died, its hold ends in {left} min, then --resume goes on with it")
    mine, ended = secrets.token_hex(8), threading.Event()
    _sign(store, mine)

    def live() -> None:
        while not ended.wait(ALIVE_S):
            with contextlib.suppress(Exception):  # the next one may succeed
                _sign(store, mine)

    alive = threading.Thread(target=live, daemon=True)
    alive.start()
    try:
        yield
    finally:
        ended.set()
        alive.join()
        with contextlib.suppress(OSError):  # what stays is a dead run's in ten minutes
            if (_signature(store) or {}).get("mark") == mine:
                (store / OWNER).unlink(missing_ok=True)


def _in_use(store: Path, more: str = "") -> InputError:
    return InputError(
        f"{store}: in use by {_owner(store)}",
        "one run on a store at a time",
        f"wait until that run ends, or give another --store{more}",
    )


def _sign(store: Path, mark: str = "") -> None:
    """Write down who holds the store."""
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    owner = {"user": _user(), "host": socket.gethostname(), "process": os.getpid(), "since": now}
    if mark:
        owner |= {"mark": mark, "alive_s": time.time()}
    (store / OWNER).write_text(json.dumps(owner), encoding="utf-8")


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return "a user without a name"


def _owner(store: Path) -> str:
    """Who holds the store, as far as it is written down."""
    try:
        owner = _signature(store)
        return f"process {owner['process']} of {owner['user']} on {owner['host']} since {owner['since']}"  # type: ignore[index]
    except (OSError, KeyError, TypeError):
        return "another run"


def _signature(store: Path) -> dict[str, Any] | None:
    """What the holder of a store has written down; None where that is nothing, or no signature."""
    try:
        found = json.loads(content(store / OWNER).decode("utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    return found if isinstance(found, dict) else None
