"""Execution of tasks by one interface: this process, worker processes that may die, or a cluster (cluster.py).

Each worker process has its own pipe, so that the death of one affects no other.

A pool with a shared queue ends when the system kills one of its workers. Here a worker reports the current item of
its task; if it dies, that item is known and the others go to other workers. Workers end with the process that started
them, and have a limit of memory and, for each item, of processor time and of clock time.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Generic, NamedTuple, Self, TypeVar

from analyzer.config import WorkerLimits
from analyzer.night.own_limits import limit_memory, limit_processor

T = TypeVar("T")
R = TypeVar("R")
Began = Callable[[int], None]
"""Called by a worker's function with the number of the item that it starts."""
PRELOADED = "analyzer.night.chunk"
"""Module that workers need, imported once for all of them."""
POLL_S = 0.5
"""Interval of the check of the items' times [s]."""
OUT_OF_TIME = -int(getattr(signal, "SIGXCPU", 24))
"""Exit status of a worker that exceeded its processor time."""
NEW_S = 43_200.0
"""Age up to which a server's folder is kept [s], because its process may be alive and remove it itself: longer than a
night's run, shorter than a day."""
SERVER_GONE = 255
"""Exit status reported for workers whose server ended; only the server knows their own
(multiprocessing.popen_forkserver)."""


@dataclass(frozen=True, slots=True)
class WorkerDeath(Generic[T]):
    """A worker died during a task, or was ended.

    task : its task; at : number of the current item, None if unknown; why, in words; again : whether another try may
    succeed (not after too much time).
    """

    task: T
    at: int | None
    why: str
    again: bool


class Executor(Generic[T, R]):
    """Executes one function on many tasks while the context is entered; this base class uses this process, one task
    after another, unprotected. `watch` is called from time to time with the number of finished items of the current
    tasks, if known."""

    def __init__(self, function: Callable[..., R]) -> None:
        self._function = function
        self._waiting: deque[T] = deque()
        self.watch: Callable[[int], None] = lambda items: None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Cancel unfinished tasks."""
        self._waiting.clear()

    def submit(self, task: T, alone: bool = False) -> None:
        """Add a task; a task that must run alone waits until no other one runs that it might end."""
        self._waiting.append(task)

    def results(self) -> Iterator[R | WorkerDeath[T]]:
        """Results in order of arrival until no task remains; tasks may be added meanwhile.

        Exceptions of the function are raised: it must handle errors of items itself.
        """
        while self._waiting:
            yield self._function(self._waiting.popleft())


@dataclass(slots=True)
class _Worker:
    process: Any
    pipe: Connection
    task: Any = None
    at: int = 0
    since_s: float = 0.0

    @property
    def busy(self) -> bool:
        return self.task is not None


class Workers(Executor[T, R]):
    """Up to a number of processes of this machine.

    The function, of a task and of `Began`, is importable by name, because the processes share no memory with this
    one.
    """

    def __init__(self, count: int, function: Callable[[T, Began], R], limits: WorkerLimits) -> None:
        super().__init__(function)
        self.count, self.limits = count, limits
        self._alone: deque[T] = deque()
        self._workers: list[_Worker] = []

    def __exit__(self, *_: object) -> None:
        """End all processes immediately."""
        for worker in self._workers:
            worker.process.kill()
        for worker in self._workers:
            worker.process.join()
            worker.pipe.close()
        self._workers.clear()

    def submit(self, task: T, alone: bool = False) -> None:
        (self._alone if alone else self._waiting).append(task)

    def results(self) -> Iterator[R | WorkerDeath[T]]:
        while self._waiting or self._alone or any(w.busy for w in self._workers):
            self._feed()
            yield from self._gathered()

    def _feed(self) -> None:
        """Give each idle worker a task, and start workers if there are more tasks than idle ones."""
        busy = sum(w.busy for w in self._workers)
        alone = not self._waiting and not busy
        queue = self._alone if alone else self._waiting
        room = 1 if alone else self.count - busy
        for _ in range(min(room, len(queue))):
            worker = next((w for w in self._workers if not w.busy), None) or self._started()
            worker.task, worker.at, worker.since_s = queue.popleft(), 0, time.monotonic()
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # its death is handled below
                worker.pipe.send(worker.task)

    def _started(self) -> _Worker:
        ours, theirs = multiprocessing.Pipe()
        process = _process(theirs, self._function, self.limits)
        theirs.close()
        worker = _Worker(process, ours)
        self._workers.append(worker)
        return worker

    def _gathered(self) -> Iterator[R | WorkerDeath[T]]:
        busy = [w for w in self._workers if w.busy]
        ready = set(wait([w.pipe for w in busy], POLL_S))
        for worker in busy:
            if worker.pipe in ready:
                yield from self._heard(worker)
            elif time.monotonic() - worker.since_s > self.limits.wall_s:
                worker.process.kill()
                yield self._buried(worker, f"took longer than {self.limits.wall_s:g} s", again=False)
        self.watch(sum(worker.at for worker in self._workers if worker.busy))

    def _heard(self, worker: _Worker) -> Iterator[R | WorkerDeath[T]]:
        try:
            kind, content = worker.pipe.recv()
        except (EOFError, OSError):
            worker.process.join()
            status = worker.process.exitcode
            yield self._buried(worker, _cause_of_death(status, self.limits), again=status != OUT_OF_TIME)
            return
        if kind == "began":
            worker.at, worker.since_s = content, time.monotonic()
            return
        worker.task = None
        if kind == "raised":
            raise content
        yield content

    def _buried(self, worker: _Worker, why: str, again: bool) -> WorkerDeath[T]:
        worker.process.join()
        worker.pipe.close()
        self._workers.remove(worker)
        return WorkerDeath(worker.task, worker.at, why, again)


def executor(
    jobs: int, tasks: int, function: Callable[..., R], limits: WorkerLimits, scheduler: str | None = None
) -> Executor[Any, R]:
    """The cluster of a scheduler, otherwise worker processes for so many tasks, or this process if there are no
    jobs."""
    if scheduler is not None:
        from analyzer.night.cluster import Cluster  # it is one of these

        return Cluster(scheduler, function)
    return Workers(min(jobs, max(tasks, 1)), function, limits) if jobs else Executor(function)


def _process(pipe: Connection, *given: Any) -> Any:
    """The started process of a worker: on Linux forked from a server with common imports, otherwise, or if the server
    is not available, a new one."""
    options: dict[str, Any] = {"target": _serve, "args": (pipe, _surroundings(), *given), "daemon": True}
    if sys.platform == "linux":
        with contextlib.suppress(OSError, EOFError):  # no space for its socket, or it died at the start
            forked = multiprocessing.get_context("forkserver")
            forked.set_forkserver_preload([PRELOADED])
            _forget_dead_servers(Path(tempfile.gettempdir()))
            with _undisturbed():
                forkserver.ensure_running()
            process: Any = forked.Process(**options)
            process.start()
            return process
    process = multiprocessing.get_context("spawn").Process(**options)
    process.start()
    return process


def _forget_dead_servers(folder: Path) -> None:
    """Remove the folders of sockets without a listener: kill -9 of a run leaves its server's."""
    known = _open_sockets()
    if forkserver._forkserver._forkserver_pid is not None or known is None:  # type: ignore
        return
    for server_folder in folder.glob("pymp-*"):
        with contextlib.suppress(OSError):
            held, of = list(server_folder.iterdir()), server_folder.stat()
            old = of.st_uid == os.getuid() and time.time() - of.st_mtime > NEW_S
            if old and held and all(path.is_socket() and str(path) not in known for path in held):
                shutil.rmtree(server_folder, ignore_errors=True)


def _open_sockets() -> str | None:
    """The kernel's list of this machine's sockets; None if not available. No connection is made, because a server
    ends on a connection from a stranger."""
    try:
        return Path("/proc/net/unix").read_text()
    except OSError:
        return None


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Environment for starting the server: it imports nothing from the current folder, such as a script named
    reports.py, and ignores Ctrl-C, which this process handles."""
    before, name = os.environ.get("PYTHONSAFEPATH"), "PYTHONSAFEPATH"
    os.environ[name] = "1"
    resource_tracker.ensure_running()  # which unblocks signals as it begins
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


class _Surroundings(NamedTuple):
    """Environment variables and file mode mask of the process that starts a worker."""

    environ: dict[str, str]
    mask: int


def _surroundings() -> _Surroundings:
    mask = os.umask(0o77)
    os.umask(mask)
    return _Surroundings(dict(os.environ), mask)


def _take_on(given: _Surroundings) -> None:
    """Set the environment of the process that starts this one, instead of that of the server at its start; values
    that libraries read on import stay as they were then."""
    os.environ.clear()
    os.environ.update(given.environ)
    os.umask(given.mask)
    if sys.platform != "win32":
        time.tzset()


def _cause_of_death(status: int | None, limits: WorkerLimits) -> str:
    if status == OUT_OF_TIME:
        return f"took more than {limits.processor_s:g} s of processor time"
    if status == SERVER_GONE:
        return "the process that starts workers was ended, as the system does where memory ends"
    if status is None or status >= 0:
        return f"its worker process ended by itself (status {status})"
    name = signal.Signals(-status).name if -status in set(signal.Signals) else f"signal {-status}"
    hint = ", as the system does where memory ends" if name == "SIGKILL" else ""
    return f"its worker process was ended by {name}{hint}"


def _serve(
    pipe: Connection,
    surroundings: _Surroundings,
    function: Callable[[Any, Began], Any],
    limits: WorkerLimits,
) -> None:
    """Main loop of a worker: tasks in, results out, until the pipe closes."""
    _take_on(surroundings)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # a library's warning is useless to an engineer
    _end_with_parent()
    limit_memory(limits.memory_mb, limits.machine_share)

    def began(at: int) -> None:
        limit_processor(limits.processor_s)
        pipe.send(("began", at))

    while True:
        try:
            task = pipe.recv()
        except (EOFError, OSError):
            return
        limit_processor(limits.processor_s)
        try:
            answer = ("done", function(task, began))
        except Exception as error:  # sent to the parent, which raises it
            answer = ("raised", error)
        try:
            pipe.send(answer)
        except (BrokenPipeError, ConnectionResetError):
            return
        except Exception as error:  # a result that cannot be sent
            pipe.send(("raised", RuntimeError(f"{type(error).__name__}: {error}; {answer[1]!r}"[:500])))


def _end_with_parent() -> None:
    """End this process when its parent ends in any way: immediately on Linux, otherwise when a thread detects it.

    On Linux the end of the parent's pipe sends a signal to this process, which no long call delays; so does the death
    of the process that forked it, the parent or a server of the parent's.
    """
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    if sys.platform == "linux":
        import ctypes
        import fcntl

        set_death_signal = 1
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(set_death_signal, int(signal.SIGKILL))
        if parent is not None:
            with contextlib.suppress(OSError):
                fcntl.fcntl(parent.sentinel, fcntl.F_SETOWN, os.getpid())
                flags = fcntl.fcntl(parent.sentinel, fcntl.F_GETFL)
                fcntl.fcntl(parent.sentinel, fcntl.F_SETFL, flags | os.O_ASYNC)
