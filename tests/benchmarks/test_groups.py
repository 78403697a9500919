"""The benchmark of the plant-wide pass runs on a small plant. Its results for large plants are in groups.md."""

from __future__ import annotations

from benchmarks.groups import row


def test_the_benchmark_measures_a_plant(tmp_path):
    """A plant of 200 loops is traced in a separate process, and its row has the time relative to the floor and
    the memory."""
    cells = row(200, tmp_path)
    assert cells[0] == "200"
    assert int(cells[2]) > 0
    assert all(float(c) > 0 for c in cells[3:])
