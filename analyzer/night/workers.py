"""Who carries out tasks, by one interface: this process, worker processes that may die, or a cluster (cluster.py).

Each worker process has a pipe of its own, so that what kills one harms no other.

A pool whose workers share a queue ends with the first of them that the system kills. Here a worker says which item
of its task it has in hand; when it dies, that item is known and the rest is given to others. Workers end with the
process that started them, have a limit of memory and, for each item, of processor time and of time by the clock.
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
"""Told by a worker's function: the number of the item of its task that it begins with."""
PRELOADED = "analyzer.night.chunk"
"""What workers need, imported once for all of them."""
POLL_S = 0.5
"""How often the clocks of the items in hand are looked at [s]."""
OUT_OF_TIME = -int(getattr(signal, "SIGXCPU", 24))
"""Exit status of a worker that used up its processor time."""
NEW_S = 43_200.0
"""Age up to which the folder of a server stays [s], for the process that began it may live and remove it itself:
longer than a night's run, shorter than a day."""
SERVER_GONE = 255
"""Exit status of workers whose server is gone, which alone knows their own (multiprocessing.popen_forkserver)."""


@dataclass(frozen=True, slots=True)
class WorkerDeath(Generic[T]):
    """A worker died over a task, or was ended.

    task : what it worked on; at : number of the item in hand, None where that is not known; why, in words; again :
    whether the item may succeed on another try (not where it took too long).
    """

    task: T
    at: int | None
    why: str
    again: bool


class Executor(Generic[T, R]):
    """Who carries out one function on many tasks, for as long as it is entered: by itself this process, one after
    the other, unprotected. `watch` is told now and then how many items of the tasks in hand are done, where that is
    known."""

    def __init__(self, function: Callable[..., R]) -> None:
        self._function = function
        self._waiting: deque[T] = deque()
        self.watch: Callable[[int], None] = lambda items: None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Give up what is not done."""
        self._waiting.clear()

    def submit(self, task: T, alone: bool = False) -> None:
        """Add a task; one that is to run alone waits until nothing else does that it might end."""
        self._waiting.append(task)

    def results(self) -> Iterator[R | WorkerDeath[T]]:
        """What comes back, as it comes, until no task is left; tasks may be added meanwhile.

        Whatever the function raises is raised: an error of an item is the function's business.
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
    """Some processes of this machine, so many at most.

    The function, of a task and of `Began`, is importable by name, for the processes share no memory with this one.
    """

    def __init__(self, count: int, function: Callable[[T, Began], R], limits: WorkerLimits) -> None:
        super().__init__(function)
        self.count, self.limits = count, limits
        self._alone: deque[T] = deque()
        self._workers: list[_Worker] = []

    def __exit__(self, *_: object) -> None:
        """End all processes at once, whatever they are at."""
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
        """Give each idle worker a task, and start workers where there are more tasks than idle ones."""
        busy = sum(w.busy for w in self._workers)
        alone = not self._waiting and not busy
        queue = self._alone if alone else self._waiting
        room = 1 if alone else self.count - busy
        for _ in range(min(room, len(queue))):
            worker = next((w for w in self._workers if not w.busy), None) or self._started()
            worker.task, worker.at, worker.since_s = queue.popleft(), 0, time.monotonic()
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # seen as its death below
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
            kind, said = worker.pipe.recv()
        except (EOFError, OSError):
            worker.process.join()
            status = worker.process.exitcode
            yield self._buried(worker, _cause_of_death(status, self.limits), again=status != OUT_OF_TIME)
            return
        if kind == "began":
            worker.at, worker.since_s = said, time.monotonic()
            return
        worker.task = None
        if kind == "raised":
            raise said
        yield said

    def _buried(self, worker: _Worker, why: str, again: bool) -> WorkerDeath[T]:
        worker.process.join()
        worker.pipe.close()
        self._workers.remove(worker)
        return WorkerDeath(worker.task, worker.at, why, again)


def executor(
    jobs: int, tasks: int, function: Callable[..., R], limits: WorkerLimits, scheduler: str | None = None
) -> Executor[Any, R]:
    """The cluster of a scheduler, else worker processes for so many tasks, or this process where there are to be no
    jobs."""
    if scheduler is not None:
        from analyzer.night.cluster import Cluster  # it is one of these

        return Cluster(scheduler, function)
    return Workers(min(jobs, max(tasks, 1)), function, limits) if jobs else Executor(function)


def _process(pipe: Connection, *given: Any) -> Any:
    """A worker's process, started: on Linux forked from a server that has imported what all need, else, or where the
    server cannot be had, afresh."""
    asked: dict[str, Any] = {"target": _serve, "args": (pipe, _surroundings(), *given), "daemon": True}
    if sys.platform == "linux":
        with contextlib.suppress(OSError, EOFError):  # no room for its socket, or it died while it began
            forked = multiprocessing.get_context("forkserver")
            forked.set_forkserver_preload([PRELOADED])
            _forget_dead_servers(Path(tempfile.gettempdir()))
            with _undisturbed():
                forkserver.ensure_running()
            process: Any = forked.Process(**asked)
            process.start()
            return process
    process = multiprocessing.get_context("spawn").Process(**asked)
    process.start()
    return process


def _forget_dead_servers(folder: Path) -> None:
    """Remove the folders of sockets that nobody listens at any more: kill -9 of a run leaves its server's."""
    known = _open_sockets()
    if forkserver._forkserver._forkserver_pid is not None or known is None:  # type: ignore
        return
    for left in folder.glob("pymp-*"):
        with contextlib.suppress(OSError):
            held, of = list(left.iterdir()), left.stat()
            old = of.st_uid == os.getuid() and time.time() - of.st_mtime > NEW_S
            if old and held and all(path.is_socket() and str(path) not in known for path in held):
                shutil.rmtree(left, ignore_errors=True)


def _open_sockets() -> str | None:
    """What the kernel says of this machine's sockets; None where it does not. Nobody is connected to: a server that
    is asked by a stranger ends."""
    try:
        return Path("/proc/net/unix").read_text()
    except OSError:
        return None


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """What the server begins under: it imports nothing that lies in the folder where the night is run, as a script
    named reports.py, and leaves Ctrl-C to this process."""
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
    """Be in the surroundings of the process that starts this one now, and not of the server when it began; what
    libraries read as they are imported stays as it was then."""
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
    """A worker's life: tasks in, results out, until the pipe closes."""
    _take_on(surroundings)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # a library's warning says nothing to an engineer
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
        except Exception as error:  # told to the parent, which raises it
            answer = ("raised", error)
        try:
            pipe.send(answer)
        except (BrokenPipeError, ConnectionResetError):
            return
        except Exception as error:  # an answer that cannot be sent
            pipe.send(("raised", RuntimeError(f"{type(error).__name__}: {error}; {answer[1]!r}"[:500])))


def _end_with_parent() -> None:
    """End this process when its parent does, however that ends: at once on Linux, else as a thread sees it.

    On Linux the end of the parent's pipe is a signal to this process, which no long call holds up; so is the death of
    the process that forked it, the parent or a server of the parent's.
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
