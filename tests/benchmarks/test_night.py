"""The benchmark's order of magnitude, on a small plant."""

from __future__ import annotations

import numpy as np

from analyzer.history.export import open_export
from analyzer.tags import find_loops
from tests.benchmarks.night import measured, plant, stated, table


def test_a_night_costs_no_hundred_times_its_reading(tmp_path):
    """A day of a loop costs, at the median, under 60 times its reading and transforms; night.md says how much."""
    path, sketches = plant(8, 24.0, tmp_path)
    export = open_export([path])
    costs = measured(path, export, stated(find_loops(export.tags), sketches))
    assert [c.loop for c in costs] == list(sketches)
    assert np.median([c.ratio for c in costs]) < 60, table(costs)
