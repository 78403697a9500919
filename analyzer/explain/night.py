"""Explanation of the flagged loops of a night, one by one on worker processes, each answer stored immediately.

An error of one loop, including a dead worker, is that loop's answer. Stored in STORE/explained/NIGHT.parquet: one row
per loop with verdict, block, reason, the answer as JSON and its page ready for rendering (reports/page_file.py).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from analyzer.columns import EXPLAINED
from analyzer.config import Config
from analyzer.history.export import Export
from analyzer.loop.decisions import Action, Cause, Fault, Status, counts, decided_fault
from analyzer.loops.spec import LoopSpec
from analyzer.night.nights import Night, Plant, cut
from analyzer.night.workers import WorkerDeath, executor
from analyzer.store.store import Store
from analyzer.store.table import rows_table
from identification.errors import TriageError

TABLE = "explained"
QUIET = (Cause.NONE, Action.NONE, "", None)
"""Causes and actions that mean none."""
COLUMNS = [
    *("loop", "status", "oscillating_pct", "oscillation_significance", "cause", "valve_fault", "action"),
    "source_loop",
]
"""Columns for deciding whether a loop needs an explanation, its valve fault, and the loop that leads it."""
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class FlaggedLoop:
    """One loop of a night to be explained, with the loop that leads it if known, and the night's valve fault."""

    export: Export
    spec: LoopSpec
    source: LoopSpec | None
    night: Night
    config: Config
    fault: Fault | None = None


def flagged(row: Mapping[str, Any]) -> bool:
    """Whether a loop of a night needs an explanation: it oscillates, or has a cause or an action."""
    if row["status"] != Status.OK:
        return False
    return counts(row["oscillating_pct"]) or row["cause"] not in QUIET or row["action"] not in QUIET


def answered(q: FlaggedLoop, began: Callable[[int], None] = lambda at: None) -> Row:
    """The row of one loop, in any case; runs in a worker process."""
    from analyzer.explain.explained import abstained

    page = ""
    try:
        data, page = _answer_and_page(q)
    except TriageError as error:
        data = abstained(q.spec.loop, str(error))
    except Exception as error:  # an error of one loop is that loop's answer and never ends the night
        data = abstained(q.spec.loop, f"not explained: {type(error).__name__}: {error}")
    return answer_row(data, q.night.name, page)


def _answer_and_page(q: FlaggedLoop) -> tuple[dict[str, Any], str]:
    """The answer as data, and its page."""
    from analyzer.explain.case import case
    from analyzer.explain.explained import explained
    from analyzer.explain.page import explanation_page
    from reports.page_file import dumps

    with_source = [q.source.op] if q.source is not None and q.source.op else []
    tags = list(dict.fromkeys([*q.spec.tags, *with_source]))
    series = {tag: cut(s, q.night) for tag, s in q.export.read(tags).items()}
    specs = (q.spec,) if q.source is None else (q.spec, q.source)
    found = explained(case(q.spec, specs, series, q.config, fault=q.fault), lambda name: None)
    return found.data, dumps(explanation_page(found, q.night.zone))


def answer_row(data: Mapping[str, Any], night: str, page: str = "") -> Row:
    """An answer as a row of the store."""
    texts = {k: data[k] for k in ("loop", "verdict", "block", "reason")}
    return {**texts, "night": night, "answer": json.dumps(data), "page": page}


def questions(plant: Plant, rows: Sequence[Mapping[str, Any]], night: Night) -> list[FlaggedLoop]:
    """The flagged loops of a night, the most significant first."""
    by_name, config = {s.loop: s for s in plant.specs}, plant.config
    chosen = sorted((r for r in rows if flagged(r)), key=lambda r: -(r["oscillation_significance"] or 0.0))
    return [
        FlaggedLoop(
            plant.export,
            by_name[r["loop"]],
            by_name.get(r["source_loop"] or ""),
            night,
            config,
            decided_fault(r),
        )
        for r in chosen
        if r["loop"] in by_name
    ]


def known(store: Store, night: str) -> list[Row]:
    """Rows of a night in the store; empty if nothing was explained."""
    table = store.read_if_there(TABLE, night)
    return [] if table is None else table.to_pylist()


def keep(store: Store, night: str, rows: Sequence[Row]) -> None:
    """Write the explanations so far."""
    store.write(TABLE, night, rows_table(rows, EXPLAINED))


def explain_flagged(
    plant: Plant,
    store: Store,
    night: Night,
    jobs: int = 0,
    resume: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Row]:
    """Explain the flagged loops of an assessed night and store the answers: the rows, in order of completion.

    store : the store with the night; jobs : worker processes, 0: this one; resume : skip loops that already have an
    answer in the store; progress : called with loops done and loops in all.
    """
    from analyzer.explain.explained import abstained

    loops = questions(plant, store.read("nights", night.name, COLUMNS).to_pylist(), night)
    names = {q.spec.loop for q in loops}
    rows = [r for r in known(store, night.name) if resume or r["loop"] not in names]
    done = {r["loop"] for r in rows} & names
    remaining = [q for q in loops if q.spec.loop not in done]
    keep(store, night.name, rows)
    progress(len(done), len(loops))
    with executor(jobs, len(remaining), answered, plant.config.workers) as workers:
        for q in remaining:
            workers.submit(q)
        for at, result in enumerate(workers.results(), len(done) + 1):
            if isinstance(result, WorkerDeath):
                why = abstained(result.task.spec.loop, f"not explained: {result.why}")
                result = answer_row(why, night.name)
            rows.append(result)
            keep(store, night.name, rows)
            progress(at, len(loops))
    return [r for r in rows if r["loop"] in names]
