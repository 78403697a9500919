"""Batch run of a night over many loops: in chunks on worker processes, with pieces stored at once and combined later.

A killed run can be resumed; a worker that dies loses at most the current loop. The plant-wide pass and the
combination follow once all pieces exist.
"""

from __future__ import annotations

import hashlib
import json
import uuid
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from datetime import UTC, datetime
from itertools import product
from pathlib import Path
from typing import Any

from analyzer.belief.nights import held_pairs
from analyzer.columns import Row
from analyzer.config import Config
from analyzer.history.export import problems_text
from analyzer.history.files import ChangedError, ends_of, require_unchanged
from analyzer.locations import afresh, is_passing, not_now
from analyzer.loop.decisions import Status
from analyzer.loops.tags import no_loops
from analyzer.night import chunk
from analyzer.night.chunk import Done, Task
from analyzer.night.finish import PRESENCE_COLUMNS, finish_night, is_empty
from analyzer.night.nights import Night, Plant, nights_of
from analyzer.night.workers import Executor, WorkerDeath, executor
from analyzer.store.draft import drafted
from analyzer.store.lock import locked
from analyzer.store.store import GO_ON, Store
from analyzer.store.table import OF_A_NIGHT, DamagedError
from identification.errors import InputError

CHUNKS, FEWEST, MOST = 16, 4, 32
"""Number of tasks of a small run; fewest and most loops per task. Fewer loops would not justify the four
small tables of a task. With more the progress bar would jump, and workers would end at different times."""
PACKAGES = ("identification", "tuning", "analyzer", "reports")
Identity = Mapping[str, Any]
"""A run as stored with its pieces: fingerprint, and texts for people (export, loops, begun)."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a run.

    nights, those written, oldest first; unassessed and failed, loop and reason in the last of them; notes, sentences
    on the data read and on the previous contents of the store.
    """

    nights: tuple[Night, ...]
    unassessed: tuple[tuple[str, str], ...]
    failed: tuple[tuple[str, str], ...]
    notes: tuple[str, ...] = ()


def chunk_size(loops: int) -> int:
    """Loops per task of a run over so many."""
    return min(max(-(-loops // CHUNKS), FEWEST), MOST)


def _tasks(plant: Plant, store: Store, nights: Sequence[Night], known: set[str]) -> list[Task]:
    """Chunks of the loops that are not yet in a piece of the last night."""
    remaining = [s for s in plant.specs if s.loop not in known]
    size = chunk_size(len(remaining))
    mark = uuid.uuid4().hex[:8]  # a worker of a killed run may still write; its pieces have another mark
    held = held_pairs(store, nights[0].name)
    whole = Task(replace(plant, notes=()), tuple(nights), store, mark)
    tasks = []
    for i in range(0, len(remaining), size):
        part = tuple(remaining[i : i + size])
        pairs = {s.loop: held[s.loop] for s in part if s.loop in held}
        tasks.append(replace(whole.part(part, f"{i:06d}"), held=pairs))
    return tasks


def _results(
    tasks: Sequence[Task], jobs: int, config: Config, scheduler: str | None, watch: Callable[[int], None]
) -> Iterator[Done]:
    """The results of the chunks, on a cluster, on worker processes or, with no jobs, unprotected in this process;
    `watch` is called from time to time with the number of finished loops in the current chunks."""
    with executor(jobs, len(tasks), chunk.work, config.workers, scheduler) as workers:
        workers.watch = watch
        for task in tasks:
            workers.submit(task)
        for result in workers.results():
            yield from _retry_or_give_up(workers, result) if isinstance(result, WorkerDeath) else (result,)


def _retry_or_give_up(workers: Executor[Task, Done], died: WorkerDeath[Task]) -> Iterator[Done]:
    """Try the current loop once alone, then give it up with the reason; the others go to other workers. If the
    current loop is unknown, each is tried alone."""
    task, at = died.task, died.at
    if at is None and len(task.specs) > 1:
        for k, spec in enumerate(task.specs):
            workers.submit(task.part((spec,), k, alone=True))
        return
    at = at or 0
    others, hand = task.specs[:at] + task.specs[at + 1 :], task.specs[at : at + 1]
    if others:
        workers.submit(task.part(others, len(others)))
    if died.again and not task.alone:
        workers.submit(task.part(hand, "alone", alone=True), alone=True)
    else:
        yield chunk.lose(task.part(hand, "lost"), died.why)


def canonical_bytes(value: object) -> bytes:
    """A value as bytes that are the same in every process: sets and mappings sorted, dataclasses by their fields;
    TypeError for contents whose text may differ between processes."""

    def plain(part: Any) -> object:
        if is_dataclass(part):
            return [type(part).__name__, {f.name: getattr(part, f.name) for f in fields(part)}]
        if isinstance(part, AbstractSet):
            return sorted(part)
        if isinstance(part, Mapping):
            return dict(part)
        raise TypeError(f"{type(part).__name__} has no stated order")

    return json.dumps(value, sort_keys=True, default=plain).encode()


def is_same(path: Path, run: Identity) -> bool:
    """Whether the pieces described by `path` are of this run; False without a description. Raises InputError if they
    are of another run."""
    try:
        stopped = json.loads(path.read_text(encoding="utf-8"))
        begun = f"{stopped['export']} ({stopped['loops']} loops, begun {stopped['begun']})"
        same = stopped["fingerprint"] == run["fingerprint"]
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        if is_passing(error) and not isinstance(error, FileNotFoundError):
            raise not_now(path, error) from error
        return False
    if not same:
        seen = f"the run that was stopped read {begun}, this one reads {run['export']} ({run['loops']} loops)"
        expected = "--resume with the same EXPORT, --loops, --changes, --since, --until, --config and version"
        remedy = "give them again, or leave out --resume to discard the stopped run"
        raise InputError(seen, expected, remedy)
    return True


def of_code() -> bytes:
    """A digest of the code and the limits, because pieces of another version cannot be used."""
    mark, here = hashlib.blake2b(digest_size=16), Path(__file__).parents[2]
    for package in PACKAGES:
        for path in sorted(p for p in (here / package).rglob("*") if p.suffix in (".py", ".toml", ".json")):
            mark.update(path.read_bytes())
    return mark.digest()


def identity(plant: Plant) -> Identity:
    """Properties that a resumed run must have in common with the earlier one."""
    mark = hashlib.blake2b(of_code(), digest_size=16)
    for source in plant.export.sources:
        mark.update(ends_of(source.path))
        mark.update(canonical_bytes(source.clock))
    stated = (*plant.specs, *plant.changes, plant.zone)
    mark.update(canonical_bytes((stated, *plant.span, plant.config)))
    first, *others = [source.path.name for source in plant.export.sources]
    read = first + (f" and {len(others)} more files" if others else "")
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return {"fingerprint": mark.hexdigest(), "export": read, "loops": len(plant.specs), "begun": now}


def _begun(plant: Plant, store: Store, nights: Sequence[Night], resume: bool) -> list[str]:
    """Keys of the complete chunks of a stopped run; everything else of it is deleted."""
    own = identity(plant)
    if resume and is_same(store.run_file, own):
        keys = [key for key in store.whole_chunks(nights[-1].name) if _is_readable(store, nights, key)]
    else:
        store.drop_parts()
        keys = []
    store.run_file.parent.mkdir(parents=True, exist_ok=True)
    store.run_file.write_text(json.dumps(own), encoding="utf-8")
    return keys


def _is_readable(store: Store, nights: Sequence[Night], key: str) -> bool:
    """Whether a chunk's pieces are complete; a chunk with a damaged or missing piece is repeated."""
    try:
        for night, table in product(nights, OF_A_NIGHT):
            if table.in_pieces:
                store.read_parts(night.name, table.name, [key])
    except DamagedError:
        return False
    return True


def run(
    plant: Plant,
    store: Store,
    jobs: int = 0,
    resume: bool = False,
    replacing: bool = False,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Outcome:
    """Assess all loops of a plant and store the results.

    store : the store, locked for the run; jobs : worker processes; 0: this process, which ends if a loop uses all
    memory; resume : use the pieces of a stopped run instead of starting again; replacing : delete what the store has
    of these nights; scheduler : address of a Dask scheduler whose workers assess the loops, instead of processes of
    this machine; progress : called with loops done and loops in all. Raises InputError for no loops, no nights,
    another run on the store, or pieces of another run on resumption.
    """
    if not plant.specs:
        raise no_loops(plant.export.tags)
    with locked(store.path):
        store.upgrade()
        nights = nights_of(plant)
        _require_one_clock(store, plant.zone, [night.name for night in nights] if replacing else [])
        notes = [line for night in nights for line in store.set_aside_damaged(night.name)]
        keys, met = _begun(plant, store, nights, resume), Counter[str]()
        whole = store.read_parts(nights[-1].name, "nights", keys, ["loop"])
        known = set() if whole is None else set(whole.column("loop").to_pylist())
        done, of = len(known), len(plant.specs)
        progress(done, of)

        def watch(in_hand: int) -> None:
            progress(done + in_hand, of)

        try:
            tasks = _tasks(plant, store, nights, known)
            for result in _results(tasks, jobs, plant.config, scheduler, watch):
                _require_kept(store, nights[-1].name, result.key)
                keys.append(result.key)
                done += result.loops
                met.update(result.met)
                progress(done, of)
            require_unchanged(plant.export.marks)
        except ChangedError:  # some pieces may be of the changed export
            store.drop_parts()
            raise
        written, more = _finished(plant, store, nights, keys, replacing)
        return _outcome(plant, store, written, (*plant.export.file_notes, *problems_text(met), *notes, *more))


def _require_one_clock(store: Store, zone: str, replaced: Sequence[str]) -> None:
    """Raise InputError if the remaining nights of a store were cut in another time zone."""
    stay = [night for night in store.nights() if night not in replaced]
    kept = None
    with suppress(DamagedError):  # set aside, or reported elsewhere
        kept = store.stated_zone(stay[-1:])
    if kept is not None and kept != zone:
        seen = f"--timezone {zone}: the nights of {store.path} are of {kept}"
        remedy = f"state --timezone {kept}, or give another --store"
        raise InputError(seen, "one time zone in one store", remedy)


def _require_kept(store: Store, night: str, key: str) -> None:
    """Raise DamagedError if a finished chunk has no piece in this store."""
    piece = store.part(night, "nights", key)
    if not afresh(piece).exists():
        raise store.gone(piece)


def _finished(
    plant: Plant, store: Store, nights: Sequence[Night], keys: Sequence[str], replacing: bool
) -> tuple[list[Night], list[str]]:
    """The combined nights, without those without a sample unless there are no others."""
    order = [s.loop for s in plant.specs]
    held = [_require_all(store, night.name, keys, order) for night in nights]
    full = [night for night, rows in zip(nights, held, strict=True) if not is_empty(rows)] or list(
        nights[-1:]
    )
    notes = []
    if len(full) < len(nights):
        notes.append(f"{len(nights) - len(full)} nights without a good sample of any loop are left out")
    with drafted(store) as draft:
        for night in full:
            notes += finish_night(draft, night.name, order, plant.config, keys, replacing)
    store.drop_parts()
    return full, notes


def _require_all(store: Store, night: str, keys: Sequence[str], order: Sequence[str]) -> list[Row]:
    """Contents of a night's pieces for each loop of the run. Raises DamagedError if a loop is missing."""
    table = store.read_parts(night, "nights", keys, ("loop", *PRESENCE_COLUMNS))
    rows = [] if table is None else table.to_pylist()
    missing = set(order) - {r["loop"] for r in rows}
    if missing:
        seen = f"{store.path}: the pieces of night {night} hold {len(order) - len(missing)} of {len(order)} loops"
        raise DamagedError(seen, "all of them", GO_ON)
    return rows


def _require_in(store: Store, night: str, wanted: AbstractSet[str]) -> None:
    """Raise DamagedError if a loop of the run is missing in the finished table of a night."""
    lacking = wanted - set(store.read("nights", night, ["loop"]).column(0).to_pylist())
    if lacking:
        seen = f"{store.file('nights', night)}: lacks {len(lacking)} of the {len(wanted)} loops of this run"
        raise DamagedError(seen, "a store that nobody else changes", "run it again")


def _outcome(plant: Plant, store: Store, nights: Sequence[Night], notes: Sequence[str]) -> Outcome:
    """The outcome from the last night's table, for the loops of this run."""
    wanted = {s.loop for s in plant.specs}
    for night in nights:
        _require_in(store, night.name, wanted)
    rows = store.read("nights", nights[-1].name, ["loop", "status", "reason"]).to_pylist()
    lost = [r for r in rows if r["loop"] in wanted and r["status"] != Status.OK]
    unassessed = tuple((r["loop"], r["reason"]) for r in lost if r["status"] == Status.NOT_ASSESSED)
    failed = tuple((r["loop"], r["reason"]) for r in lost if r["status"] != Status.NOT_ASSESSED)
    return Outcome(tuple(nights), unassessed, failed, tuple(notes))
