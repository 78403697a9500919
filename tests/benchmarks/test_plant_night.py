"""The benchmark of a plant's night in small; what it measures of 1,500 loops stands in plant_night.md."""

from __future__ import annotations

import pytest

from benchmarks.plant_night import line, make, night, tenth


@pytest.mark.slow
def test_a_plants_night_is_run_and_measured_end_to_end(tmp_path):
    """Exports of areas are written and run by the command; floor, time and memory are told, and who was flagged."""
    plant = make(tmp_path, 12, 2.0, 1, tenth, area_of=8)
    assert [path.name for path in plant.exports] == ["area000.parquet", "area001.parquet"]
    found = night(plant, 2)
    assert found.loops == 12
    assert found.flagged > 0
    assert found.ratio > 1
    assert 50 < found.memory_mb < 2000
    assert line("tenth", found).count("|") == 10
