"""Lock of a store for one run at a time, and its owner.

In a directory the lock is that of the operating system (filelock: flock or similar). It ends with its owner, in any
case, and the signature file is for people. Shared storage has no locks: there the signature is the lock, and its
owner renews it.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import secrets
import shutil
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analyzer.history.parquet import forget_halves, holds_copies
from analyzer.locations import content, is_remote, refusals_as_errors
from analyzer.store.notes import user
from identification.errors import InputError

if TYPE_CHECKING:
    from filelock import BaseFileLock

SETTLE_S = 2.0
"""Time after which a lock taken over from a dead run is tested again [s]: another run may take it over at the
same moment."""
ALIVE_S = 60.0  # How often a holder of shared storage renews its lock [s]
DEAD_S = 600.0  # Age from which its signature is that of a dead run [s]: ten renewals are missing
LEFT_OVER_S = 86400.0  # Age from which unfinished files count as remains of a process that died [s]

LOCK, OWNER = "run.lock", "run.owner.json"
"""Names within the store."""
SCRATCH, MAKING = ".copies-", ".making"
"""Prefix of the names of directories of copies, and the additional prefix until they are locked."""
TRIED = ".written"
"""Name of an object that tests whether shared storage can be written."""
Signature = dict[str, Any]
"""User, host, process, start time, a mark of its own, and time of the last signature (ALIVE_S [s])."""


@contextmanager
def scratch(store: Path, resume: bool = False) -> Iterator[Path]:
    """A directory in the store for a run's copies of packed and of large exports; for a store on shared storage a
    local one.

    Its creation tests, before any work, that the store can be written. It is removed after the run. If an exception
    ends the run after a complete copy was made, it stays, as after a killed run: a resumed run (`resume`) uses it,
    any other removes it. Raises OSError where the store cannot be made or written.
    """
    if is_remote(store):
        with refusals_as_errors(store):
            (store / TRIED).write_text("")
            (store / TRIED).unlink()
        with tempfile.TemporaryDirectory(prefix="triage-copies-", ignore_cleanup_errors=True) as made:
            yield Path(made)
        return
    store.mkdir(parents=True, exist_ok=True)
    place, lock = _held_scratch(store, resume)
    kept = False
    try:
        yield place
    except BaseException:
        kept = holds_copies(place)
        raise
    finally:
        lock.release()
        if not kept:
            shutil.rmtree(place, ignore_errors=True)


def _lock(folder: Path) -> BaseFileLock | None:
    """The acquired lock of a directory; None if another process has it."""
    from filelock import FileLock, Timeout

    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        return None
    return lock


def _held_scratch(store: Path, resume: bool) -> tuple[Path, BaseFileLock]:
    """A directory of copies and its lock: for a resumed run the newest unused one, otherwise a new one. Other unused
    ones are removed."""
    for unused in store.glob(f"{MAKING}{SCRATCH}*"):
        if time.time() - _changed_s(unused) > LEFT_OVER_S:
            shutil.rmtree(unused, ignore_errors=True)
    taken: tuple[Path, BaseFileLock] | None = None
    for unused in sorted(store.glob(f"{SCRATCH}*"), key=_changed_s, reverse=True):
        with contextlib.suppress(OSError):
            lock = _lock(unused)
            if lock is None:
                continue
            if resume and taken is None and holds_copies(unused):
                taken = unused, lock
                continue
            lock.release()
            shutil.rmtree(unused, ignore_errors=True)
    if taken is not None:
        forget_halves(taken[0])
        return taken
    folder = Path(tempfile.mkdtemp(prefix=f"{MAKING}{SCRATCH}", dir=store))
    own = _lock(folder)
    assert own is not None  # no other process knows the directory yet
    return folder.rename(folder.with_name(folder.name.removeprefix(MAKING))), own  # others see it when locked


def _changed_s(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


@contextmanager
def locked(store: Path) -> Iterator[None]:
    """Lock the store for one run. Raises InputError if another run has it, with user, host and start time."""
    signature = _signature_of_this()
    with ExitStack() as held:
        if is_remote(store):
            _sign_alone(store, signature)
            held.callback(_unsign, store, signature)
            held.enter_context(_renewed(store, signature))
        else:
            store.mkdir(parents=True, exist_ok=True)
            lock = _lock(store)
            if lock is None:
                raise _in_use(store)
            held.callback(lock.release)
            held.callback(_unsign, store, signature)
            _sign_lock(store, signature)
        yield


def _sign_alone(store: Path, signature: Signature) -> None:
    """Sign a store on shared storage that has no owner. The storage creates the object only if there is none, so that
    of two runs starting at the same time one is rejected. Raises InputError where another run has it."""
    with refusals_as_errors(store):
        dead = _require_unsigned(store)
        if dead:
            (store / OWNER).unlink(missing_ok=True)
        try:
            known = _made_alone(store / OWNER, _as_text(signature).encode("utf-8"))
        except Exception:
            if _signature(store).get("mark") != signature["mark"]:  # otherwise only the response was lost
                _require_unsigned(store)
                raise
            known = True
        if dead or not known:
            time.sleep(SETTLE_S)
            if _signature(store).get("mark") != signature["mark"]:
                raise _in_use(store)


def _made_alone(path: Any, data: bytes) -> bool:
    """Create an object if there is none; return whether the storage is known to reject an existing one."""
    try:
        path.fs.pipe_file(path.path, data, mode="create")
    except (TypeError, NotImplementedError):
        path.write_bytes(data)
        return False
    return True


def _is_dead_here(known: Signature) -> bool:
    """Whether a signature is of a process of this machine that has ended."""
    process = known.get("process")
    if sys.platform == "win32" or known.get("host") != socket.gethostname() or not isinstance(process, int):
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False


def _require_unsigned(store: Path) -> bool:
    """Whether shared storage has the signature of a dead run. Raises InputError if the run may be alive."""
    known = _signature(store)
    alive_s = known.get("alive_s")
    if _is_dead_here(known):
        return True
    if isinstance(alive_s, int | float) and time.time() - alive_s < DEAD_S:
        minutes = max(math.ceil((DEAD_S + alive_s - time.time()) / 60.0), 1)
        raise _in_use(store, f"; if it died, its hold ends in {minutes} min, then --resume continues it")
    return bool(known)


@contextmanager
def _renewed(store: Path, signature: Signature) -> Iterator[None]:
    """Renew the signature periodically, in a thread, until the end."""
    ended = threading.Event()

    def live() -> None:
        while not ended.wait(ALIVE_S):
            with contextlib.suppress(Exception):  # the next one may succeed
                _sign_lock(store, signature)

    alive = threading.Thread(target=live, daemon=True)
    alive.start()
    try:
        yield
    finally:
        ended.set()
        alive.join()


def _in_use(store: Path, more: str = "") -> InputError:
    owner = "another run"
    with contextlib.suppress(OSError, KeyError):  # as far as it is known
        known = _signature(store)
        owner = f"process {known['process']} of {known['user']} on {known['host']} since {known['since']}"
    remedy = f"wait until that run ends, or give another --store{more}"
    return InputError(f"{store}: in use by {owner}", "one run on a store at a time", remedy)


def _signature_of_this() -> Signature:
    """Signature of this process as owner of a store."""
    return {
        "user": user() or "a user without a name",
        "host": socket.gethostname(),
        "process": os.getpid(),
        "since": datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC"),
        "mark": secrets.token_hex(8),
    }


def _sign_lock(store: Path, signature: Signature) -> None:
    """Write the signature of the living owner of a store."""
    (store / OWNER).write_text(_as_text(signature), encoding="utf-8")


def _as_text(signature: Signature) -> str:
    return json.dumps(signature | {"alive_s": time.time()})


def _unsign(store: Path, signature: Signature) -> None:
    """Remove a signature if it is still this process's; one left on shared storage expires in ten minutes."""
    with contextlib.suppress(Exception):  # including a failing storage
        if _signature(store).get("mark") == signature["mark"]:
            (store / OWNER).unlink(missing_ok=True)


def _signature(store: Path) -> Signature:
    """The signature of the owner of a store; empty if there is none, or no valid one."""
    try:
        found = json.loads(content(store / OWNER).decode("utf-8"))
    except (FileNotFoundError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
