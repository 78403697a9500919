"""The benchmark of the plant-wide pass runs on a small plant; what it measures stands in groups.md."""

from __future__ import annotations

from benchmarks.groups import row


def test_the_benchmark_measures_a_plant(tmp_path):
    """A plant of 200 loops is traced in a process of its own, and its row tells time over the floor and memory."""
    cells = row(200, tmp_path)
    assert cells[0] == "200"
    assert int(cells[2]) > 0
    assert all(float(c) > 0 for c in cells[3:])
