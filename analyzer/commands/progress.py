"""Progress of long work on the terminal: a line that changes where somebody looks, one now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

Report = Callable[[int, int], None]
QUIET_S = 5.0
"""Seconds between two lines on what is being tried, where nobody looks at a terminal [s]."""


@contextmanager
def bar(what: str) -> Iterator[Report]:
    """A callable to be told of things done and things in all."""
    if not sys.stderr.isatty():
        yield _tenths(what)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


def _tenths(what: str) -> Report:
    """A line on stderr at every tenth."""
    said = {0}

    def report(done: int, total: int) -> None:
        tenth = 10 * done // max(total, 1)
        if tenth not in said:
            said.add(tenth)
            print(f"{what}: {done} of {total}", file=sys.stderr, flush=True)

    return report


@contextmanager
def trying() -> Iterator[Callable[[str], None]]:
    """A callable to be told what is tried."""
    watched, begun = sys.stderr.isatty(), time.monotonic()
    said_s = begun
    if not watched:
        click.echo("explain: reading the export, fitting the plain loop", err=True)

    def tell(name: str) -> None:
        nonlocal said_s
        if watched:
            click.echo(f"\r\033[K{f'trying {name}' if name else ''}", nl=False, err=True)
        elif name and time.monotonic() - said_s >= QUIET_S:
            said_s = time.monotonic()
            click.echo(f"explain: {said_s - begun:.0f} s, trying {name}", err=True)

    try:
        yield tell
    finally:
        tell("")
