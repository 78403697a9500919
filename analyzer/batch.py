"""A night over many loops: each loop on its own, in chunks on an executor, pieces kept as they come.

An error of one loop is a result of that loop. Chunks are written as pieces of the night, so that a killed run
goes on where it stood; the plant-wide pass and the joining happen once all pieces are there.
"""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa

from analyzer.advice import Advice, advise
from analyzer.assess import Assessment, assess
from analyzer.assessments import Assessments
from analyzer.columns import ALL_COLUMNS, TEXT_COLUMNS
from analyzer.config import Config
from analyzer.history.export import Export
from analyzer.history.loops_csv import LoopSpec
from analyzer.history.series import Series
from analyzer.nights import Night, cut, nights_of
from analyzer.plantwide import Fingerprint, Peer, trace
from analyzer.present import advised, follower_row
from analyzer.quality import prepare
from analyzer.rows import hour_rows, lost_row, night_row
from analyzer.store import Store, rows_table, write_table
from analyzer.tags import controller
from identification.errors import InputError, NotAssessedError, TriageError

CHUNK = 8
"""Loops per task: enough to carry the cost of a task, few enough for a smooth progress bar."""
HISTORY = {"none": "none", "load": "none"}
"""Actions of nights that are not the last: settings are advised on for tomorrow, not for the week before."""
HOUR_COLUMNS = ("loop", "night", "hour_s", "oscillation_significance", "oscillating_pct")


@dataclass(frozen=True, slots=True)
class Task:
    """One chunk of loops over some nights, small enough to send to a worker."""

    export: Export
    specs: tuple[LoopSpec, ...]
    nights: tuple[Night, ...]
    store: Store
    config: Config
    key: str


@dataclass(frozen=True, slots=True)
class Done:
    """What a worker says of its chunk: loops done and, per loop that was lost, the reason."""

    loops: int
    lost: tuple[tuple[str, str], ...]


def assess_loop(
    spec: LoopSpec, series: dict[str, Series], config: Config, advising: bool = True
) -> tuple[Assessment, Advice]:
    """Prepare and assess one loop from its raw samples, and advise on it if wanted."""
    prepared = prepare(spec, series, config.quality)
    stated = controller(spec, prepared.scale.span)
    if stated is not None and spec.scan_s is None:
        stated = replace(stated, scan_s=prepared.record.dt_s)
    found = assess(prepared, stated, config, spec.type)
    if not advising:
        return found, Advice(HISTORY.get(found.verdict.cause, "undecided"))
    first = found.oscillations.first
    period = first.period_s if first is not None else None
    return found, advise(found.verdict, spec, stated, prepared.scale.span, period)


def _loop_row(
    spec: LoopSpec, series: dict[str, Series], night: Night, config: Config, advising: bool
) -> tuple[dict[str, Any], Assessment | None]:
    """The row of one loop and night, whatever happens."""
    try:
        found, advice = assess_loop(spec, {tag: cut(s, night) for tag, s in series.items()}, config, advising)
    except NotAssessedError as error:
        return lost_row(spec, night.name, "not assessed", str(error)), None
    except TriageError as error:
        return lost_row(spec, night.name, "failed", str(error)), None
    except Exception as error:  # an error of one loop is that loop's result, never the night's end
        return lost_row(spec, night.name, "failed", f"{type(error).__name__}: {error}"), None
    return advised(night_row(found, spec, night.name), found.verdict.needs, advice), found


def _read(task: Task, spec: LoopSpec) -> dict[str, Series] | str:
    """The loop's raw samples, or why there are none."""
    if spec.pv is None:
        return f"no PV tag {spec.wanted_pv or spec.loop + '.PV'} in the export"
    try:
        return task.export.read(spec.tags)
    except TriageError as error:
        return str(error)
    except Exception as error:  # a broken column is that loop's result
        return f"{type(error).__name__}: {error}"


def work(task: Task) -> Done:
    """Assess a chunk and write its pieces; runs in a worker process."""
    rows: dict[str, list[dict[str, Any]]] = {n.name: [] for n in task.nights}
    found: dict[str, list[Assessment]] = {n.name: [] for n in task.nights}
    for spec in task.specs:
        series = _read(task, spec)
        for night in task.nights:
            if isinstance(series, str):
                row, assessment = lost_row(spec, night.name, "not assessed", series), None
            else:
                advising = night is task.nights[-1]
                row, assessment = _loop_row(spec, series, night, task.config, advising)
            rows[night.name].append(row)
            if assessment is not None:
                found[night.name].append(assessment)
    for night in task.nights:
        _write_pieces(task, night.name, rows[night.name], found[night.name])
    last = rows[task.nights[-1].name]
    lost = [(r["loop"], r["reason"]) for r in last if r["status"] != "ok"]
    return Done(len(task.specs), tuple(lost))


def _write_pieces(task: Task, night: str, rows: list[dict[str, Any]], found: list[Assessment]) -> None:
    hours = [row for a in found for row in hour_rows(a, night)]
    columns = (*HOUR_COLUMNS, *Assessments(0.0).as_row())
    if hours:
        write_table(rows_table(hours, columns, ("loop", "night")), task.store.part(night, "hours", task.key))
    if found:
        write_table(_trend_table(found), task.store.part(night, "trends", task.key))
    prints = [a.print for a in found if a.print is not None]
    if prints:
        write_table(_print_table(prints), task.store.part(night, "prints", task.key))
    write_table(rows_table(rows, ALL_COLUMNS, TEXT_COLUMNS), task.store.part(night, "nights", task.key))


def _trend_table(found: Sequence[Assessment]) -> pa.Table:
    tables = []
    for a in found:
        columns = {k: pa.array(v) for k, v in a.trend.items()}
        n = len(a.trend["time_s"])
        tables.append(pa.table({"loop": pa.array([a.loop] * n).dictionary_encode(), **columns}))
    return pa.concat_tables(tables).unify_dictionaries()


def _print_table(prints: Sequence[Fingerprint]) -> pa.Table:
    return pa.table(
        {
            "loop": [p.loop for p in prints],
            "period_s": [p.period_s for p in prints],
            "start_s": [p.start_s for p in prints],
            "duration_s": [p.duration_s for p in prints],
            "first": [p.first for p in prints],
            "real": [p.lines.real.astype(np.float32) for p in prints],
            "imag": [p.lines.imag.astype(np.float32) for p in prints],
        }
    )


def _prints(table: pa.Table | None) -> list[Fingerprint]:
    rows = [] if table is None else table.to_pylist()
    return [
        Fingerprint(
            r["loop"],
            r["period_s"],
            r["start_s"],
            r["duration_s"],
            int(r["first"]),
            np.array(r["real"]) + 1j * np.array(r["imag"]),
        )
        for r in rows
    ]


def finish_night(store: Store, night: str, order: Sequence[str], config: Config) -> None:
    """The plant-wide pass over a night's pieces, then the night as one table in the order of the loops."""
    table = store.read_parts(night, "nights")
    if table is None:
        return
    rows = {row["loop"]: row for row in table.to_pylist()}
    peers = {
        k: Peer(r["cause"] or "none", r["evidence"] or 0.0, r["osc_tuning_pct"] or 0.0)
        for k, r in rows.items()
    }
    for loop, source in trace(_prints(store.read_parts(night, "prints")), peers, config.cause).items():
        rows[loop] = follower_row(rows[loop], source)
    known = [rows[loop] for loop in order if loop in rows]
    store.finish(night, rows_table(known, ALL_COLUMNS, TEXT_COLUMNS))


def _tasks(
    export: Export, specs: Sequence[LoopSpec], spans: Sequence[Night], store: Store, config: Config
) -> list[Task]:
    """Chunks of the loops that no piece of the last night holds yet."""
    done = store.read_parts(spans[-1].name, "nights")
    known = set() if done is None else set(done.column("loop").to_pylist())
    left = [s for s in specs if s.loop not in known]
    at = len(store.parts(spans[-1].name, "nights"))
    return [
        Task(export, tuple(left[i : i + CHUNK]), tuple(spans), store, config, f"{at:05d}-{i:06d}")
        for i in range(0, len(left), CHUNK)
    ]


def executor(jobs: int) -> Executor:
    """A pool of worker processes; a cluster's client offers the same interface."""
    return ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"))


def _results(tasks: Sequence[Task], pool: Executor | None) -> Iterator[Done]:
    if pool is None:
        yield from map(work, tasks)
        return
    futures: list[Future[Done]] = [pool.submit(work, task) for task in tasks]
    for future in as_completed(futures):
        yield future.result()


def run(
    export: Export,
    specs: Sequence[LoopSpec],
    store: Store,
    config: Config,
    jobs: int = 1,
    resume: bool = False,
    since_s: float = -math.inf,
    until_s: float = math.inf,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[list[Night], list[tuple[str, str]]]:
    """Assess all loops of an export and keep the results.

    Parameters
    ----------
    export : Export
    specs : sequence of LoopSpec
        With the tags that the export has.
    store : Store
    config : Config
    jobs : int
        Worker processes; 1 works in this one.
    resume : bool
        Go on with the pieces of a run that was stopped, instead of starting anew.
    since_s, until_s : float
        Only samples of this span of time are assessed [s since 1970-01-01 UTC].
    progress : callable
        Called with loops done and loops in all.

    Returns
    -------
    list of Night, list of (loop, reason)
        The nights written, and the loops that could not be assessed in the last of them.
    """
    if not specs:
        raise InputError(
            "no loops in the export", "tags such as LOOP.PV", "state them with --loops loops.csv"
        )
    spans = nights_of(export, specs, since_s, until_s)
    if not resume:
        for span in spans:
            store.drop_parts(span.name)
    else:
        store.drop_unfinished([span.name for span in spans])
    tasks = _tasks(export, specs, spans, store, config)
    done = len(specs) - sum(len(t.specs) for t in tasks)
    progress(done, len(specs))
    pool = executor(jobs) if jobs > 1 and len(tasks) > 1 else None
    try:
        for result in _results(tasks, pool):
            done += result.loops
            progress(done, len(specs))
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)
    order = [s.loop for s in specs]
    for span in spans:
        finish_night(store, span.name, order, config)
    table = store.read("nights", spans[-1].name, ["loop", "status", "reason"]).to_pylist()
    return spans, [(r["loop"], r["reason"]) for r in table if r["status"] != "ok"]
