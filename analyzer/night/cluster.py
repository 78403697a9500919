"""The same batch on a Dask cluster: each chunk a task, its pieces written into the store that all machines share.

Answers do not depend on where they are computed. A worker that dies costs no loop: its chunk goes to another; one
that ends several workers is parted into its loops, and a loop that does so alone is lost with the reason.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import replace
from typing import Any

from analyzer.night import chunk
from analyzer.night.chunk import Done, Task
from identification.errors import InputError

CONNECT = "10s"
"""How long a scheduler may take to answer."""
WHY = "ended several workers of the cluster"


def results(address: str, tasks: Sequence[Task]) -> Iterator[Done]:
    """What the chunks give, as they come.

    Parameters
    ----------
    address : str
        Of the scheduler, tcp://HOST:PORT.
    tasks : sequence of Task

    Raises
    ------
    InputError
        Dask is not installed, no scheduler answers there, or it died before all was done.
    """
    try:
        from distributed import Client
        from distributed.comm import CommClosedError
    except ImportError as error:
        raise InputError(
            f"--scheduler {address}: no Dask here",
            "the extra 'cluster'",
            "pip install 'loop-triage[cluster]'",
        ) from error
    try:
        client: Any = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        seen = f"--scheduler {address}: no scheduler answers"
        raise InputError(
            seen, "the address that 'dask scheduler' prints", "start it, or correct it"
        ) from error
    logging.getLogger("distributed.client").setLevel(
        logging.CRITICAL
    )  # what ends the run is told in one line below
    with client:
        try:
            yield from _gathered(client, tasks)
        except (CancelledError, CommClosedError) as error:
            seen, kept = f"--scheduler {address}: lost in mid-run", "what is done is kept in the store"
            raise InputError(
                seen,
                "a scheduler that lives until the run ends",
                f"{kept}: start the scheduler again, then the same command with --resume",
            ) from error


def _gathered(client: Any, tasks: Sequence[Task]) -> Iterator[Done]:
    """What the chunks give, as they come; those that ended several workers in parts."""
    from distributed import KilledWorker, as_completed

    waiting = {_submitted(client, task): task for task in tasks}
    coming = as_completed(list(waiting), loop=client.loop)
    for future in coming:
        task = waiting.pop(future)
        try:
            yield future.result()
        except KilledWorker:
            if len(task.specs) == 1:
                yield chunk.lose(replace(task, key=f"{task.key}-lost"), WHY)
                continue
            for again in _parted(task):
                future = _submitted(client, again)
                waiting[future] = again
                coming.add(future)


def _submitted(client: Any, task: Task) -> Any:
    return client.submit(chunk.work, task, key=f"triage-{task.key}", pure=False)


def _parted(task: Task) -> list[Task]:
    """A chunk as tasks of one loop each."""
    return [
        replace(task, specs=(spec,), key=f"{task.key}-{k}", alone=True) for k, spec in enumerate(task.specs)
    ]
