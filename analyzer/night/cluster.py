"""Tasks on a Dask cluster: what they write goes into the store that all machines share.

Answers do not depend on where they are computed. A worker that dies costs nothing: its task goes to another; one that
ends several workers comes back as `Died`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any, Self

from analyzer.night.workers import Died, Executor, R, T
from identification.errors import InputError

CONNECT = "10s"
"""How long a scheduler may take to answer."""
WHY = "ended several workers of the cluster"


class Cluster(Executor[T, R]):
    """The workers of a scheduler at an address, tcp://HOST:PORT. Raises InputError where Dask is not installed, no
    scheduler answers there, or it died before all was done."""

    def __init__(self, address: str, function: Callable[[T], R]) -> None:
        super().__init__(function)
        self._address = address
        self._tasks: dict[Any, T] = {}
        self._coming: Any = None

    def __enter__(self) -> Self:
        try:
            from distributed import Client, as_completed
        except ImportError as error:
            seen = f"--scheduler {self._address}: no Dask here"
            raise InputError(seen, "the extra 'cluster'", "pip install 'loop-triage[cluster]'") from error
        try:
            self._client: Any = Client(self._address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            seen = f"--scheduler {self._address}: no scheduler answers"
            expected = "the address that 'dask scheduler' prints"
            raise InputError(seen, expected, "start it, or correct it") from error
        # what ends the run is told in one line below
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        self._coming = as_completed([], loop=self._client.loop)
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def submit(self, task: T, alone: bool = False) -> None:
        with self._told():
            future = self._client.submit(self._function, task, pure=False)
            self._tasks[future] = task
            self._coming.add(future)

    def results(self) -> Iterator[R | Died[T]]:
        from distributed import KilledWorker

        with self._told():
            for future in self._coming:
                task = self._tasks.pop(future)
                try:
                    yield future.result()
                except KilledWorker:
                    yield Died(task, None, WHY, again=False)

    @contextmanager
    def _told(self) -> Iterator[None]:
        """The end of the scheduler in one line."""
        from distributed.comm import CommClosedError

        try:
            yield
        except (CancelledError, CommClosedError) as error:
            raise InputError(
                f"--scheduler {self._address}: lost in mid-run",
                "a scheduler that lives until the run ends",
                "what is done is kept in the store: start the scheduler again, then the same command with --resume",
            ) from error
