"""The time of beliefs in a store of 90 nights: python -m benchmarks.beliefs [--loops 1000] [--nights 90]

One day of the sample mill is run. Its rows are repeated as the rows of a plant's loops, night after night. The
beliefs of the last night follow from those of the night before. Their time is compared with the time of a night of as
many loops, at the sample's time for each loop. The time for all beliefs, computed again from the first night, is
measured too. Writes beliefs.md here.
"""

from __future__ import annotations

import tempfile
import time
from datetime import date, timedelta
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from analyzer.belief.nights import recompute_beliefs, update_beliefs
from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loops.tags import match, read_loops
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.store.store import Store
from proofs.common import command, command_line, publish, table

SAMPLE = Path(__file__).resolve().parents[1] / "sample_data"


def sample_night(store: Store) -> tuple[pa.Table, float]:
    """The rows of the sample's day, and the time of one of its loops [s]; the first of two runs compiles."""
    export = open_export([SAMPLE / "mill-day.csv"])
    specs = match(read_loops(SAMPLE / "loops.csv"), export.tags)[0]
    took = 0.0
    for _ in range(2):
        started = time.perf_counter()
        batch.run(Plant(export, specs, Config()), store, 1)
        took = time.perf_counter() - started
    return store.read("nights", store.nights()[-1]), took / len(specs)


def plant(rows: pa.Table, loops: int, night: str) -> pa.Table:
    """The sample's rows as the rows of a plant's loops in a night."""
    copies = -(-loops // rows.num_rows)
    out = pa.concat_tables([rows] * copies).slice(0, loops)
    names = [f"L{k:05d}" for k in range(loops)]
    for column, values in (("loop", names), ("night", [night] * loops)):
        out = out.set_column(out.column_names.index(column), column, pa.array(values))
    started = out.column_names.index("start_s")
    later = 86400.0 * (date.fromisoformat(night) - date(2026, 3, 2)).days
    return out.set_column(started, "start_s", pc.add(out.column(started), later))


def main() -> None:
    """Time them and write the page."""
    given = command_line(__doc__, loops=1000, nights=90)
    with tempfile.TemporaryDirectory() as folder:
        rows, each = sample_night(Store(Path(folder) / "sample"))
        store = Store(Path(folder) / "plant")
        for k in range(given.nights):
            night = (date(2026, 3, 2) + timedelta(days=k)).isoformat()
            store.write("nights", night, plant(rows, given.loops, night))
        started = time.perf_counter()
        lost = recompute_beliefs(store, Config())
        again_s = time.perf_counter() - started
        assert not lost
        started = time.perf_counter()
        update_beliefs(store, night, Config())
        last = time.perf_counter() - started
    publish(
        __file__,
        "What beliefs cost",
        command(__file__, loops=given.loops, nights=given.nights),
        f"A store of {given.nights} nights of {given.loops:,} loops, on one core.",
        table(
            "what | time | a loop and night | share of the night",
            [
                ("the night itself", f"{each * given.loops:.0f} s", f"{1e3 * each:.0f} ms", ""),
                (
                    "beliefs of the last night",
                    f"{last:.1f} s",
                    f"{1e3 * last / given.loops:.2f} ms",
                    f"{100 * last / (each * given.loops):.1f} %",
                ),
                (
                    "all beliefs again",
                    f"{again_s:.0f} s",
                    f"{1e3 * again_s / given.loops / given.nights:.2f} ms",
                    "",
                ),
            ],
        ),
    )


if __name__ == "__main__":
    main()
