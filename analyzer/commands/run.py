"""The command `run`: the nightly batch, its messages, and its end after a signal.

Its log can be searched by people and parsed by programs: one line per event, appended, logfmt.

2026-03-03T01:00:02Z triage[4711] lost loop=FIC2101 status="not assessed" reason="no PV tag FIC2101.PV in the export"
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from analyzer.commands.options import (
    EXIT_NOTHING_DONE,
    EXIT_SOME_FAILED,
    EXIT_TRY_LATER,
    PLACE,
    age_note,
    bar,
    export_options,
    finding,
    print_visible,
    unforeseen,
    watched,
    what_failed,
    what_went_wrong,
)
from identification.errors import InputError
from reports.texts import visible
from reports.whole_file import is_full

if TYPE_CHECKING:
    from analyzer.night.batch import Outcome
    from analyzer.night.nights import Night, Plant
    from analyzer.night.request import ExportRequest
    from analyzer.store.store import Store

STOPPED = 128
"""The exit status of a run that a signal stopped is this plus the signal's number, as shells and
schedulers expect."""
FEW = 10
"""Notes on the read data that are printed; the others are counted."""
PLAIN = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._:/+-%")
"""Characters of values that are logged without quotes."""


def logfmt(value: object) -> str:
    """A value as one word or one quoted text, with printable characters only."""
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    shown = visible(text)
    if shown and set(shown) <= PLAIN:
        return shown
    return '"' + shown.replace("\\", "\\\\").replace('"', '\\"') + '"'


class RunLog:
    """Log of a run; no output without a path.

    A log that cannot be written gives one line on stderr, and never ends the night.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path

    def write(self, event: str, **facts: object) -> None:
        """Append one line: time [UTC], process, event, and facts as name=value."""
        if self._path is None:
            return
        now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        fields = "".join(f" {name}={logfmt(value)}" for name, value in facts.items())
        line = f"{now} triage[{os.getpid()}] {event}{fields}\n".encode()
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab", buffering=0) as file:
                file.write(line)
        except OSError as error:
            print(f"triage: no log is kept: {self._path}: {error.strerror}", file=sys.stderr)
            self._path = None


class StoppedError(Exception):
    """A signal requests the end of the run."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


@contextmanager
def stoppable() -> Iterator[None]:
    """Convert SIGINT, SIGTERM and SIGHUP to `StoppedError`, once; further ones are ignored while the run ends.

    An ignored signal, such as SIGHUP under nohup, stays ignored.
    """
    known = (getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
    numbers = [number for number in known if signal.getsignal(number) != signal.SIG_IGN]

    def stop(number: int, frame: FrameType | None) -> None:
        for each in numbers:
            signal.signal(each, signal.SIG_IGN)
        raise StoppedError(number)

    try:
        before = {number: signal.signal(number, stop) for number in numbers}
    except ValueError:  # not the main thread, which handles signals
        yield
        return
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@click.command()
@finding
@export_options
@click.option(
    "--store", required=True, type=PLACE, help="Directory, or URL of shared storage, that keeps the results."
)
@click.option("--jobs", default=1, show_default=True, type=click.IntRange(1), help="Worker processes.")
@click.option(
    "--scheduler", help="Dask scheduler, tcp://HOST:PORT, whose workers compute the loops instead of --jobs."
)
@click.option("--resume", is_flag=True, help="Continue a run that was stopped.")
@click.option("--replace", "replacing", is_flag=True, help="First delete these nights from the store.")
@click.option(
    "--log",
    "log_file",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File to which each event is appended as a line.",
)
@click.option("--explain", "explaining", is_flag=True, help="Explain the last night's flagged loops as well.")
def run(request: ExportRequest, store: Path, log_file: Path | None, explaining: bool, **how: Any) -> None:
    """The nightly batch: assess every loop and keep the results in a store.

    An export of several days is split by day; new settings are advised for the last day. A second export of a night
    adds its loops; of two records of a loop the fuller one is kept.

    Exit status: 0 the night was written, 1 some loops failed, 2 nothing could be done, 75 shared storage failed for
    minutes: the same command with --resume may succeed later.

    Example: triage run export.parquet --loops loops.csv --store store --jobs 4
    """
    from importlib.metadata import version

    log, begun_s = RunLog(log_file), time.monotonic()
    export = " ".join(map(str, request.export))
    log.write("begin", version=version("loop-triage"), store=store, export=export, jobs=how["jobs"])
    try:
        request = _for_all_workers(request, store, how["scheduler"])
        with stoppable():
            outcome, loops = _run_night(request, store, log, explaining, how)
    except StoppedError as stopped:
        log.write("stopped", signal=stopped, status=STOPPED + stopped.number)
        with suppress(OSError):  # the terminal may be closed
            print_visible(f"triage: stopped by {stopped}; {_go_on(store)}", err=True)
        sys.exit(STOPPED + stopped.number)
    except Exception as error:
        message, again = (
            what_went_wrong(error) or unforeseen(error),
            _may_answer_again(error, (store, *request.export)),
        )
        log.write("nothing done", error=message, status=EXIT_TRY_LATER if again else EXIT_NOTHING_DONE)
        if again:
            why = message.partition("; ")[0]
            why = why if "://" in why else f"{store}: {why}"
            print_visible(f"triage: {why}; the storage failed for minutes: {_go_on(store)}", err=True)
            sys.exit(EXIT_TRY_LATER)
        if isinstance(error, OSError) and is_full(error):
            raise InputError(what_failed(error), "room to write", f"make room; {_go_on(store)}") from error
        raise
    lost = EXIT_NOTHING_DONE if len(outcome.failed) + len(outcome.unassessed) == loops else EXIT_SOME_FAILED
    status = lost if outcome.failed or lost == EXIT_NOTHING_DONE else 0
    log.write("end", status=status, night=outcome.nights[-1].name, seconds=time.monotonic() - begun_s)
    sys.exit(status)


def _for_all_workers(request: ExportRequest, store: Path, scheduler: str | None) -> ExportRequest:
    """The request in a form valid for remote workers. Raises InputError if their store would be a different one."""
    from analyzer.locations import is_remote

    if scheduler is None:
        return request
    if not is_remote(store) and not store.is_absolute():
        seen = f"--store {store} with --scheduler: each worker would write its own store"
        raise InputError(
            seen, "an absolute path, or a URL, that all machines share", f"state --store {store.resolve()}"
        )
    return replace(request, export=tuple(p if is_remote(p) else p.absolute() for p in request.export))


def _may_answer_again(error: Exception, places: Sequence[Path]) -> bool:
    """Whether a run ends because shared storage failed temporarily."""
    from analyzer.locations import is_outage, is_remote

    return any(map(is_remote, places)) and is_outage(error)


def _go_on(store: Path) -> str:
    return f"finished work is kept in {store}: continue with the same command and --resume"


def _run_night(
    request: ExportRequest, place: Path, log: RunLog, explaining: bool, how: Mapping[str, Any]
) -> tuple[Outcome, int]:
    """Read the export, assess it with the options `how` of analyzer/night/batch.py and, if requested, explain it;
    return the outcome and the number of loops."""
    from analyzer.store.lock import scratch
    from analyzer.store.store import Store, require_place

    require_place(place)
    with scratch(place, how["resume"]) as copies:
        more = f" and {len(request.export) - 1} more" if len(request.export) > 1 else ""
        with watched(f"reading {request.export[0]}{more}"):
            from analyzer.night.opened import opened_apart  # takes a second

            plant = opened_apart(replace(request, reading={**request.reading, "scratch": copies}))
        store = Store(place)
        _report_notes(plant.notes, log)
        outcome = _assessed(plant, store, how, log)
        if explaining and len(outcome.unassessed) + len(outcome.failed) < len(plant.specs):
            _explain_night(plant, store, outcome.nights[-1], how["jobs"], how["resume"])
    return outcome, len(plant.specs)


def _report_notes(notes: Sequence[str], log: RunLog) -> None:
    for note in notes:
        print_visible(f"triage: {note}", err=True)
        log.write("note", text=note)


def _assessed(plant: Plant, store: Store, how: Mapping[str, Any], log: RunLog) -> Outcome:
    """Run the batch with progress and print the result: lost loops, number of assessed loops, night."""
    from analyzer.night import batch

    with bar("loops") as progress:
        outcome = batch.run(plant, store, **how, progress=progress)
    _report_notes(outcome.notes[:FEW], log)
    if len(outcome.notes) > FEW:
        more = len(outcome.notes) - FEW
        _report_notes([f"{more} further notes on what was read; 'triage check' prints them all"], log)
    for status, lost_loops in (("not assessed", outcome.unassessed), ("failed", outcome.failed)):
        for loop, reason in lost_loops:
            print_visible(f"{loop}: {reason}", err=True)
            log.write("lost", loop=loop, status=status, reason=reason)
    nights, loops, failed = outcome.nights, len(plant.specs), len(outcome.failed)
    done = loops - len(outcome.unassessed) - failed
    log.write("assessed", loops=done, of=loops, failed=failed, nights=len(nights))
    several = f" ({len(nights)} nights from {nights[0].name})" if len(nights) > 1 else ""
    summary = f"{done} of {loops} loops assessed{f', {failed} failed' if failed else ''}"
    click.echo(f"{summary}, night {nights[-1].name}{several}, in {store.path}", err=True)
    _report_notes(list(filter(None, [age_note(nights[-1].name, plant.zone)])), log)
    return outcome


def _explain_night(plant: Plant, store: Store, night: Night, jobs: int, resume: bool) -> None:
    """Explain the flagged loops of a night, with progress, and print their number."""
    from analyzer.explain.night import explain_flagged

    with bar("explained") as progress:
        rows = explain_flagged(plant, store, night, jobs, resume, progress)
    named = sum(r["verdict"] not in ("none", "unexplained") for r in rows)
    click.echo(f"{len(rows)} flagged loops explained, {named} with a named effect", err=True)
