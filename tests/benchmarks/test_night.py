"""The benchmark of a night runs on a small plant. Its results are in night.md."""

from __future__ import annotations

from analyzer.history.export import open_export
from analyzer.loops.tags import find_loops
from benchmarks.night import measured, plant, stated, table


def test_the_benchmark_measures_every_loop(tmp_path):
    """Night and floor are measured for each loop of a plant, and the table separates oscillating loops from the
    others."""
    path, sketches = plant(4, 3.0, tmp_path)
    export = open_export([path])
    costs = measured(path, export, stated(find_loops(export.tags), sketches))
    assert [c.loop for c in costs] == list(sketches)
    assert all(c.ratio > 1 for c in costs)
    assert table(costs).count("\n") == 4
