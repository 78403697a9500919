"""Tasks on a Dask cluster: they write to the store, which all machines share.

Results do not depend on the machine. If a worker dies, its task goes to another; a task that ends several workers is
returned as a `WorkerDeath`.
"""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import Any, Self

from analyzer.night.workers import Executor, R, T, WorkerDeath
from identification.errors import InputError

QUIET_S = 60.0
"""Time without an answer of a cluster's workers after which its scheduler is queried for their number [s]."""
ANSWER_S = 10.0  # Time in which a scheduler answers [s]
GIVEN_UP_S = 900.0
"""Time without workers, or without an answer of the scheduler, after which a run ends [s]: as long as
machines need to start."""

GO_ON = (
    "finished work is kept in the store: start the scheduler and workers, then the same command with --resume"
)
WHY = "ended several workers of the cluster"


class Cluster(Executor[T, R]):
    """The workers of a scheduler at an address, tcp://HOST:PORT; a line on stderr reports when none has responded for
    a while. Raises InputError if Dask is not installed, no scheduler responds, it died before all was done, or there
    have been no workers for too long."""

    def __init__(self, address: str, function: Callable[[T], R]) -> None:
        super().__init__(function)
        self._address = address
        self._tasks: dict[Any, T] = {}
        self._coming: SimpleQueue[Any] = SimpleQueue()

    def __enter__(self) -> Self:
        try:
            from distributed import Client
        except ImportError as error:
            seen = f"--scheduler {self._address}: Dask is not installed"
            raise InputError(seen, "the extra 'cluster'", "pip install 'loop-triage[cluster]'") from error
        try:
            options = {"timeout": ANSWER_S, "set_as_default": False}
            self._client: Any = Client(self._address, **options)
        except (OSError, ValueError, TimeoutError) as error:
            seen = f"--scheduler {self._address}: no scheduler responds"
            expected = "the address that 'dask scheduler' prints"
            raise InputError(seen, expected, "start it, or correct it") from error
        # one line below reports what ended the run
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(Exception):  # do not wait for a scheduler that hangs
            self._client.close(timeout=ANSWER_S)

    def submit(self, task: T, alone: bool = False) -> None:
        with self._reported_loss():
            future = self._client.submit(self._function, task, pure=False)
            self._tasks[future] = task
            future.add_done_callback(self._coming.put)

    def results(self) -> Iterator[R | WorkerDeath[T]]:
        from distributed import KilledWorker

        with self._reported_loss():
            while self._tasks:
                future = self._next()
                task = self._tasks.pop(future)
                try:
                    yield future.result()
                except KilledWorker:
                    yield WorkerDeath(task, None, WHY, again=False)

    def _next(self) -> Any:
        """The next finished task. Raises InputError if no worker has worked on any for too long."""
        idle_s = time.monotonic()
        reported = ""
        while True:
            try:
                return self._coming.get(timeout=QUIET_S)
            except Empty:
                seen = self._who_works()
            if seen and seen != reported:
                most = GIVEN_UP_S / 60.0
                print(f"triage: --scheduler {self._address}: {seen}; waiting {most:.0f} min", file=sys.stderr)
            elif not seen:
                idle_s = time.monotonic()
            reported = seen
            if time.monotonic() - idle_s > GIVEN_UP_S:
                raise InputError(f"--scheduler {self._address}: {seen}", "workers that respond", GO_ON)

    def _who_works(self) -> str:
        """Why the cluster does not work; '' if it has workers."""
        try:
            options = {"callback_timeout": ANSWER_S}
            workers = self._client.sync(self._client.scheduler.ncores, **options)
        except (TimeoutError, OSError, ValueError):
            return "the scheduler does not respond"
        return "" if workers else "no workers, 'dask worker' starts one"

    @contextmanager
    def _reported_loss(self) -> Iterator[None]:
        """The end of the scheduler in one line."""
        from distributed.comm import CommClosedError

        try:
            yield
        except (CancelledError, CommClosedError) as error:
            seen, expected = (
                f"--scheduler {self._address}: connection lost during the run",
                "a scheduler that runs until the run ends",
            )
            raise InputError(seen, expected, GO_ON) from error
