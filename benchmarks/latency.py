"""How long a person waits for an answer, relative to a floor of the same run: python -m benchmarks.latency

Whole commands are timed by the processor time of the process. Their floor is a start of Python with the packages that
they need. Calls are timed by the processor time of this process. The least of some runs counts. Writes latency.md
here.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from analyzer.pages import night
from proofs.common import command, publish, table
from proofs.valve_loops import backlash_case, corners, stick_case
from reports.folder import write_html
from tests.reports.small_store import small_store
from tuning.recommend import recommend

RUNS = 3
LOOPS = (10_000, 100_000)
FORMS = ("csv", "table")


def command_s(*arguments: str | Path) -> float:
    """Least processor time of a Python with these arguments [s]."""
    least = float("inf")
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *map(str, arguments)], check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        least = min(least, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return least


def call_s(call: Callable[[], object]) -> float:
    """Least processor time of a call once it is compiled [s]."""
    call()
    least = float("inf")
    for _ in range(RUNS):
        begun = time.process_time()
        call()
        least = min(least, time.process_time() - begun)
    return least


def rows() -> list[tuple[str, float, str, float]]:
    """The timed item, its seconds, its floor, and the floor's seconds."""
    bare = command_s("-c", "import click")
    arrow = command_s("-c", "import pyarrow.parquet, click")
    transform = call_s(lambda: np.fft.rfft(np.ones(86_400)))
    found = [("triage --help", command_s("-m", "analyzer.cli", "--help"), "python with click", bare)]
    with tempfile.TemporaryDirectory() as folder:
        for loops in LOOPS:
            place = Path(folder) / f"store{loops}"
            store = small_store(place, loops=loops, nights=1, hours=False, buckets=4)
            commands = [
                (f"triage rank --format {f}", ("rank", store.path, "--top", "20", "--format", f))
                for f in FORMS
            ]
            commands.append(
                ("triage pages --top 20", ("pages", store.path, "--out", place / "out", "--top", "20"))
            )
            for name, words in commands:
                spent = command_s("-m", "analyzer.cli", *words)
                found.append((f"{name}, {loops:,} loops", spent, "python with pyarrow and click", arrow))
        big = small_store(Path(folder) / "big", loops=1500, nights=7, hours=False)
        pages = call_s(
            lambda: write_html(night.pages_of_night(big, None, 50), Path(folder) / "out", single_file=True)
        )
        found.append(
            ("morning page of 1,500 loops and 50 loop pages", pages, "one rfft of 86,400", transform)
        )
    for name, case in (("stick-slip", stick_case(2, 30_000)), ("play", backlash_case(2, 30_000))):
        spent = call_s(lambda case=case: recommend(case.loop, "valve", corners(case.loop), case.load))
        found.append(
            (f"recommendation, {name}, 30,000 scans of load", spent, "one rfft of 86,400", transform)
        )
    return found


def main() -> None:
    """Time everything and write the page."""
    shown = ((what, f"{s:.3f}", floor, f"{f:.4f}", f"{s / f:.1f}") for what, s, floor, f in rows())
    about = f"{command(__file__)}, processor time, least of three runs."
    publish(__file__, "How long a person waits", about, table("what | s | floor | s | ratio", shown))


if __name__ == "__main__":
    main()
