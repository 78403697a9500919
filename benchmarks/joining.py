"""The time of a run alone, and the time to read a store of many nights: python -m benchmarks.joining

The pieces that workers wrote for a small plant are repeated under other names, each time with other phases, so that
copies share no oscillation. A separate process joins each night. Then a store of several nights, each with the
results of the first one, is checked and made into pages. Processor time and memory are those of that process alone.
Writes joining.md here.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from analyzer.belief.nights import recompute_beliefs
from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loops.tags import match, read_loops
from analyzer.night.chunk import Task, work
from analyzer.night.finish import finish_night
from analyzer.night.nights import Plant, nights_of
from analyzer.plantwide.oscillation_lines import oscillation_table, oscillations_in
from analyzer.plantwide.structure import moves_in, moves_table
from analyzer.store.draft import drafted
from analyzer.store.store import Store
from analyzer.store.table import KEPT, further_tables, read_stored, write_table
from benchmarks import Own, own_of
from benchmarks.plant_night import DISTINCT, make, tenth
from proofs.common import command, command_line, publish, table

CHUNK = 30
"""Loops of a piece."""
TIMES = ("time_s", "hour_s", "start_s", "judged_since_s", "settings_changed_s")
"""Columns that change with the night."""


def small_plant(folder: Path) -> tuple[Store, str]:
    """The pieces of a small plant, computed in this process, and its night."""
    made = make(folder, DISTINCT, 2.0, 5, tenth)
    export = open_export(list(made.exports))
    specs = match(read_loops(made.loops_csv), export.tags)[0]
    plant, store = Plant(export, specs), Store(folder / "small")
    nights = tuple(nights_of(plant))
    for k in range(0, len(specs), CHUNK):
        work(Task(plant, nights, store, "x").part(specs[k : k + CHUNK], f"{k:06d}"))
    return store, nights[0].name


def repeat(small: Store, of: str, big: Store, night: str, loops: int) -> None:
    """Copy the pieces of a small plant's night as those of a large plant's night."""
    keys, rng = small.whole_chunks(of), np.random.default_rng(date.fromisoformat(night).toordinal())
    for k in range(0, loops, CHUNK):
        copy, key = divmod(k // CHUNK, len(keys))
        if key == 0:
            turns = np.exp(2j * np.pi * rng.random(1 << 17))
            moved = int(rng.integers(50, 5000))
        for name in (*further_tables(small.part(of, "nights", keys[key])), "nights"):
            held = read_stored(small.part(of, name, keys[key])).slice(0)
            if name == "waves":
                oscillations = (
                    replace(
                        w,
                        lines=w.lines * turns[w.first : w.first + w.lines.size],
                        trend=np.roll(w.trend, moved),
                    )
                    for w in oscillations_in([held])
                )
                held = oscillation_table(list(oscillations))
            elif name == "moves":
                rolled = (
                    {r: np.roll(getattr(m, r), moved) for r in ("sp", "pv", "op")} for m in moves_in(held)
                )
                held = moves_table([replace(m, **r) for m, r in zip(moves_in(held), rolled, strict=True)])
            write_table(_renamed(held, copy, of, night), big.part(night, name, f"x-{k:06d}"))


def _renamed(held: pa.Table, copy: int, of: str, night: str) -> pa.Table:
    """A piece with other names of loops, of another night."""
    names = pa.array([f"U{copy:04d}{loop}" for loop in held.column("loop").to_pylist()])
    encoded = pa.types.is_dictionary(held.schema.field("loop").type)
    at = held.column_names.index("loop")
    held = held.set_column(at, "loop", names.dictionary_encode() if encoded else names)
    return _moved(held, of, night)


def _moved(held: pa.Table, of: str, night: str) -> pa.Table:
    """A table of a night, or a part of it, with the times of another night."""
    later = 86400.0 * (date.fromisoformat(night) - date.fromisoformat(of)).days
    fresh = {
        t: pc.add(held.column(t), later)
        for t in TIMES
        if t in held.column_names and held.schema.names[0] != "period_s"
    }
    if "night" in held.column_names:
        fresh["night"] = pa.array([night] * held.num_rows)
    for name, values in fresh.items():
        held = held.set_column(held.column_names.index(name), name, values)
    return held


def join(place: str, night: str) -> None:
    """Join a night from its pieces, as a run does when its workers have finished."""
    store = Store(Path(place))
    keys = store.whole_chunks(night)
    order = [
        loop
        for key in keys
        for loop in store.read_parts(night, "nights", [key], ["loop"]).column(0).to_pylist()
    ]
    store.upgrade()
    with drafted(store) as draft:
        finish_night(draft, night, order, Config(), keys)
    store.drop_parts()


JOIN = "import sys; import benchmarks; from benchmarks.joining import join; join(*sys.argv[1:])"


def joined(store: Store, night: str) -> Own:
    """Resources of a process that joins a night, minus those of its start."""
    begun = own_of([sys.executable, "-c", JOIN.replace("join(*", "print(*")])
    done = own_of([sys.executable, "-c", JOIN, str(store.path), night])
    return replace(done, processor_s=done.processor_s - begun.processor_s)


def nights_from(first: str, count: int) -> Iterator[str]:
    """Names of `count` nights."""
    return ((date.fromisoformat(first) + timedelta(days=k)).isoformat() for k in range(count))


def joinings(small: Store, of: str, sizes: Sequence[int], folder: Path) -> str:
    """A table of one night of plants of several sizes."""
    rows = []
    for loops in sizes:
        store = Store(folder / f"plant{loops}")
        repeat(small, of, store, of, loops)
        own = joined(store, of)
        size = sum(p.stat().st_size for p in store.path.rglob("*.parquet"))
        each = f"{1000 * own.processor_s / loops:.1f}", f"{own.memory_mb:.0f}", f"{size / loops / 1000:.1f}"
        rows.append((loops, f"{own.processor_s:.1f}", *each))
        print(rows[-1], file=sys.stderr)
    return table("loops|processor s|ms a loop|memory MB|kB a loop kept", rows, numbers=True)


def readings(small: Store, of: str, loops: int, nights: int, folder: Path) -> str:
    """A table of commands on a store of many nights."""
    store = Store(folder / "nights")
    repeat(small, of, store, of, loops)
    joined(store, of)
    for night in list(nights_from(of, nights))[1:]:
        for kept in KEPT:
            store.write(kept.name, night, (_moved(t, of, night) for t in store.parts_if_there(kept.name, of)))
    recompute_beliefs(store, Config())
    place, rows, triage = str(store.path), [], [sys.executable, "-m", "analyzer.cli"]
    pages = ["pages", place, "--out", str(folder / "pages")]
    first = [*pages, "--top", "20"]
    commands = (["store", "check", place], first, first, [*pages, "--loop", "U0001A00009"], ["rank", place])
    for words in commands:
        own = own_of([*triage, *words])
        shown = " ".join(w for w in words if w not in (place, str(folder / "pages"))).replace(" --out", "")
        rows.append(
            (f"`triage {shown}`", f"{own.wall_s:.1f}", f"{own.processor_s:.1f}", f"{own.memory_mb:.0f}")
        )
        print(rows[-1], file=sys.stderr)
    return table("command|wall s|processor s|memory MB", rows, numbers=True)


def main() -> None:
    """Measure and write the page."""
    given = command_line(__doc__, loops=[500, 2000, 10_000], plant=2000, nights=15)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        small, of = small_plant(folder)
        one = joinings(small, of, given.loops, folder)
        many = readings(small, of, given.plant, given.nights, folder)
    about = "A night of 2 h at 5 s, one loop in ten flagged; processor time of the process alone, without its start."
    ran = command(__file__, loops=given.loops, plant=given.plant, nights=given.nights)
    store = f"A store of {given.nights} nights of {given.plant} loops; pages twice, then those of one loop:"
    publish(__file__, "The time of a run alone, and the time to read a store", ran, about, one, store, many)


if __name__ == "__main__":
    main()
