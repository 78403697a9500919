"""The time of each stage of a loop relative to reading it: python -m benchmarks.stages [--loops 24] [--hours 24]

The stages are reading, preparing, detection, the cause, the rest of an assessment, advice, and, for a few loops, an
explanation. The floor is that of night.py. The table gives medians over the loops, on one core, of each loop's
fastest of three runs. Writes stages.md here.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa

from analyzer.config import Config
from analyzer.explain.case import case
from analyzer.explain.explained import explained
from analyzer.history.export import Export, open_export
from analyzer.loop.advice.advise import advise
from analyzer.loop.assess import assess, cause_of
from analyzer.loop.oscillation.detection import counting, detect
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import controller, find_loops
from benchmarks.night import fastest, floor, plant, stated
from proofs.common import command, command_line, publish

EXPLAINED = 6
"""Loops that are explained; each takes seconds."""
STAGES = ("read", "prepare", "detection", "cause", "figures and the rest", "advice")


@dataclass(frozen=True)
class Cost:
    """One loop: whether it oscillates, its floor and its stages [s]."""

    oscillates: bool
    floor_s: float
    stage_s: tuple[float, ...]


def cost(path: Path, export: Export, spec: LoopSpec, config: Config) -> Cost:
    """The stages of one loop, each measured separately."""
    floor_s, _ = fastest(lambda: floor(path, spec.tags))
    read_s, series = fastest(lambda: export.read(spec.tags))
    prepare_s, prepared = fastest(lambda: prepare(spec, series, config.quality))
    pid = controller(spec, prepared.scale.span)
    detect_s, seen = fastest(lambda: detect(prepared.record, config.oscillation))
    cause_s, _ = fastest(lambda: cause_of(prepared, seen, pid, config, spec.type))
    whole_s, found = fastest(lambda: assess(prepared, pid, config, spec.type))
    advice_s, _ = fastest(lambda: advise(found, spec, pid, prepared.scale.span, config))
    rest_s = max(whole_s - detect_s - cause_s, 0.0)
    oscillates = counting(seen) is not None
    return Cost(oscillates, floor_s, (read_s, prepare_s, detect_s, cause_s, rest_s, advice_s))


def explanation_s(export: Export, spec: LoopSpec, config: Config) -> float:
    """Processor time of one explanation [s]."""
    series, begun = export.read(spec.tags), time.process_time()
    explained(case(spec, (spec,), series, config), lambda name: None)
    return time.process_time() - begun


def row(name: str, of: Callable[[Cost], float], groups: tuple[list[Cost], list[Cost]]) -> str:
    """A stage: milliseconds and floors, for loops that do not oscillate and for loops that do."""
    cells = []
    for group in groups:
        cells.append(f"{1000 * np.median([of(c) for c in group]):.1f}")
        cells.append(f"{np.median([of(c) / c.floor_s for c in group]):.1f}")
    return f"| {name} | " + " | ".join(cells) + " |"


def table(costs: list[Cost]) -> str:
    """A Markdown table over the stages."""
    groups = [c for c in costs if not c.oscillates], [c for c in costs if c.oscillates]
    lines = [
        f"| stage | {len(groups[0])} without oscillation, ms | floors "
        f"| {len(groups[1])} that oscillate, ms | floors |",
        "|---|--:|--:|--:|--:|",
        row("floor", lambda c: c.floor_s, groups),
    ]
    lines += [row(name, lambda c, k=k: c.stage_s[k], groups) for k, name in enumerate(STAGES)]
    return "\n".join([*lines, row("all", lambda c: sum(c.stage_s), groups)])


def main() -> None:
    """Measure and write the table next to this file."""
    options = command_line(__doc__, loops=24, hours=24.0)
    pa.set_cpu_count(1)
    config = Config()
    with tempfile.TemporaryDirectory() as folder:
        path, sketches = plant(options.loops, options.hours, Path(folder))
        export = open_export([path])
        specs = stated(find_loops(export.tags), sketches)
        warm = (
            specs[0],
            specs[3],
        )  # a loop that does not oscillate and one that does: kernels are loaded before the measurement
        costs = [cost(path, export, spec, config) for spec in (*warm, *specs)][len(warm) :]
        ill = [s for s, c in zip(specs, costs, strict=True) if c.oscillates][: EXPLAINED + 1]
        taken = [explanation_s(export, spec, config) for spec in ill][1:]
    shown = command(__file__, loops=options.loops, hours=options.hours)
    taken_s = (
        f"An explanation takes {np.median(taken):.1f} s of processor time, median of {len(taken)} loops."
    )
    publish(__file__, "What each stage costs", shown, table(costs), taken_s)


if __name__ == "__main__":
    main()
