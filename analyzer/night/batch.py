"""A night over many loops: in chunks on worker processes, pieces kept as they come, then put together.

A killed run goes on where it stood; a worker that dies costs the loop in hand at most. The plant-wide pass and the
joining happen once all pieces are there.
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
from analyzer.history.export import met_told
from analyzer.history.files import ChangedError, ends_of, require_unchanged
from analyzer.loop.decisions import Status
from analyzer.loops.tags import no_loops
from analyzer.night import chunk
from analyzer.night.chunk import Done, Task
from analyzer.night.finish import TELLS_EMPTY, finish_night, is_empty
from analyzer.night.nights import Night, Plant, nights_of
from analyzer.night.workers import Executor, WorkerDeath, executor
from analyzer.places import afresh, is_passing, not_now
from analyzer.store.draft import drafted
from analyzer.store.lock import locked
from analyzer.store.store import GO_ON, Store
from analyzer.store.table import OF_A_NIGHT, DamagedError
from identification.errors import InputError

CHUNKS, FEWEST, MOST = 16, 4, 32
"""Tasks of a run that is small, and loops per task: enough to carry its four small tables, few enough for a smooth
progress bar and for workers that end together."""
PACKAGES = ("identification", "tuning", "analyzer", "reports")
Identity = Mapping[str, Any]
"""A run as it is written down beside its pieces: fingerprint, and words for people (export, loops, begun)."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run did.

    nights, those written, oldest first; unassessed and failed, loop and reason in the last of them; notes, sentences
    on what was read and on what the store had already.
    """

    nights: tuple[Night, ...]
    unassessed: tuple[tuple[str, str], ...]
    failed: tuple[tuple[str, str], ...]
    notes: tuple[str, ...] = ()


def chunk_size(loops: int) -> int:
    """Loops per task of a run over so many."""
    return min(max(-(-loops // CHUNKS), FEWEST), MOST)


def _tasks(plant: Plant, store: Store, nights: Sequence[Night], known: set[str]) -> list[Task]:
    """Chunks of the loops that no piece of the last night holds yet."""
    left = [s for s in plant.specs if s.loop not in known]
    size = chunk_size(len(left))
    mark = uuid.uuid4().hex[:8]  # a worker of a killed run may write yet; its pieces have another mark
    held = held_pairs(store, nights[0].name)
    whole = Task(replace(plant, notes=()), tuple(nights), store, mark)
    tasks = []
    for i in range(0, len(left), size):
        part = tuple(left[i : i + size])
        told = {s.loop: held[s.loop] for s in part if s.loop in held}
        tasks.append(replace(whole.part(part, f"{i:06d}"), held=told))
    return tasks


def _results(
    tasks: Sequence[Task], jobs: int, config: Config, scheduler: str | None, watch: Callable[[int], None]
) -> Iterator[Done]:
    """What the chunks give, on a cluster, on worker processes or, with no jobs, in this process, unprotected; `watch`
    is told now and then how many loops of the chunks in hand are done."""
    with executor(jobs, len(tasks), chunk.work, config.workers, scheduler) as workers:
        workers.watch = watch
        for task in tasks:
            workers.submit(task)
        for result in workers.results():
            yield from _retry_or_give_up(workers, result) if isinstance(result, WorkerDeath) else (result,)


def _retry_or_give_up(workers: Executor[Task, Done], died: WorkerDeath[Task]) -> Iterator[Done]:
    """The loop that was in hand is tried once alone, then given up with the reason; others go to other workers. Where
    it is not known which it was, each is tried by itself."""
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


def in_one_order(value: object) -> bytes:
    """A value as bytes that are the same in every process: sets and mappings sorted, dataclasses by their fields;
    TypeError where it holds something whose text may differ between processes."""

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
    """Whether the pieces that `path` speaks of are of this run; not where nothing says of which. Raises InputError
    where they are of another."""
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
        remedy = "give them again, or leave out --resume to give up what the stopped run had done"
        raise InputError(seen, expected, remedy)
    return True


def of_code() -> bytes:
    """A digest of the code and the limits that judge: pieces of a run that others began are no pieces of this one."""
    mark, here = hashlib.blake2b(digest_size=16), Path(__file__).parents[2]
    for package in PACKAGES:
        for path in sorted(p for p in (here / package).rglob("*") if p.suffix in (".py", ".toml", ".json")):
            mark.update(path.read_bytes())
    return mark.digest()


def identity(plant: Plant) -> Identity:
    """What a run that goes on with the pieces of another must have in common with it."""
    mark = hashlib.blake2b(of_code(), digest_size=16)
    for source in plant.export.sources:
        mark.update(ends_of(source.path))
        mark.update(in_one_order(source.clock))
    stated = (*plant.specs, *plant.changes, plant.zone)
    mark.update(in_one_order((stated, *plant.span, plant.config)))
    first, *others = [source.path.name for source in plant.export.sources]
    read = first + (f" and {len(others)} more files" if others else "")
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return {"fingerprint": mark.hexdigest(), "export": read, "loops": len(plant.specs), "begun": now}


def _begun(plant: Plant, store: Store, nights: Sequence[Night], resume: bool) -> list[str]:
    """Keys of the chunks that a stopped run left whole; all else of it is forgotten."""
    mine = identity(plant)
    if resume and is_same(store.run_file, mine):
        keys = [key for key in store.whole_chunks(nights[-1].name) if _is_readable(store, nights, key)]
    else:
        store.drop_parts()
        keys = []
    store.run_file.parent.mkdir(parents=True, exist_ok=True)
    store.run_file.write_text(json.dumps(mine), encoding="utf-8")
    return keys


def _is_readable(store: Store, nights: Sequence[Night], key: str) -> bool:
    """Whether a chunk's pieces are whole; one of which a piece is damaged or gone is worked on again."""
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
    """Assess all loops of a plant and keep the results.

    store : where, held for the run alone; jobs : worker processes; 0 works in this one, where a loop that takes all
    memory takes the run with it; resume : go on with the pieces of a run that was stopped, instead of starting anew;
    replacing : forget what the store has of these nights; scheduler : address of a Dask scheduler whose workers do
    the loops, instead of processes of this machine; progress : called with loops done and loops in all. Raises
    InputError for no loops, no nights, another run on the store, or pieces of another run to be gone on with.
    """
    if not plant.specs:
        raise no_loops(plant.export.tags)
    with locked(store.path):
        store.upgrade()
        nights = nights_of(plant)
        _require_one_clock(store, plant.zone, [night.name for night in nights] if replacing else [])
        said = [line for night in nights for line in store.set_aside_damaged(night.name)]
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
        except ChangedError:  # some pieces may be of another export
            store.drop_parts()
            raise
        written, more = _finished(plant, store, nights, keys, replacing)
        return _outcome(plant, store, written, (*plant.export.file_notes, *met_told(met), *said, *more))


def _require_one_clock(store: Store, zone: str, replaced: Sequence[str]) -> None:
    """Raise InputError where the nights that stay in a store were cut by the clock of another time zone."""
    stay = [night for night in store.nights() if night not in replaced]
    kept = None
    with suppress(DamagedError):  # set aside, or named by others
        kept = store.stated_zone(stay[-1:])
    if kept is not None and kept != zone:
        seen = f"--timezone {zone}: the nights of {store.path} are of {kept}"
        raise InputError(seen, "one clock in one store", f"say --timezone {kept}, or give another --store")


def _require_kept(store: Store, night: str, key: str) -> None:
    """Raise DamagedError where a chunk that is done has left no piece in this store."""
    piece = store.part(night, "nights", key)
    if not afresh(piece).exists():
        raise store.gone(piece)


def _finished(
    plant: Plant, store: Store, nights: Sequence[Night], keys: Sequence[str], replacing: bool
) -> tuple[list[Night], list[str]]:
    """The nights put together, those without a sample left out unless they are all there is."""
    order = [s.loop for s in plant.specs]
    held = [_require_all(store, night.name, keys, order) for night in nights]
    full = [night for night, rows in zip(nights, held, strict=True) if not is_empty(rows)] or list(
        nights[-1:]
    )
    said = []
    if len(full) < len(nights):
        said.append(f"{len(nights) - len(full)} nights without a good sample of any loop are left out")
    with drafted(store) as draft:
        for night in full:
            said += finish_night(draft, night.name, order, plant.config, keys, replacing)
    store.drop_parts()
    return full, said


def _require_all(store: Store, night: str, keys: Sequence[str], order: Sequence[str]) -> list[Row]:
    """What the pieces of a night hold of each loop of the run. Raises DamagedError where they lack one."""
    table = store.read_parts(night, "nights", keys, ("loop", *TELLS_EMPTY))
    rows = [] if table is None else table.to_pylist()
    missing = set(order) - {r["loop"] for r in rows}
    if missing:
        seen = f"{store.path}: the pieces of night {night} hold {len(order) - len(missing)} of {len(order)} loops"
        raise DamagedError(seen, "all of them", GO_ON)
    return rows


def _require_in(store: Store, night: str, wanted: AbstractSet[str]) -> None:
    """Raise DamagedError where the finished table of a night lacks a loop of the run."""
    lacking = wanted - set(store.read("nights", night, ["loop"]).column(0).to_pylist())
    if lacking:
        seen = f"{store.file('nights', night)}: lacks {len(lacking)} of the {len(wanted)} loops of this run"
        raise DamagedError(seen, "a store that nobody else changes", "run it again")


def _outcome(plant: Plant, store: Store, nights: Sequence[Night], notes: Sequence[str]) -> Outcome:
    """The outcome as the last night's table has it, for the loops of this run."""
    wanted = {s.loop for s in plant.specs}
    for night in nights:
        _require_in(store, night.name, wanted)
    rows = store.read("nights", nights[-1].name, ["loop", "status", "reason"]).to_pylist()
    lost = [r for r in rows if r["loop"] in wanted and r["status"] != Status.OK]
    unassessed = tuple((r["loop"], r["reason"]) for r in lost if r["status"] == Status.NOT_ASSESSED)
    failed = tuple((r["loop"], r["reason"]) for r in lost if r["status"] != Status.NOT_ASSESSED)
    return Outcome(tuple(nights), unassessed, failed, tuple(notes))
