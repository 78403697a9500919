"""The benchmark of a plant's night runs on a small plant. Its results for 1,500 loops are in plant_night.md."""

from __future__ import annotations

import subprocess
import sys

import pytest

from benchmarks.plant_night import line, make, night, tenth

COUNT = """
import os, subprocess, sys
from benchmarks import adopt, spent
adopt()
before = spent()
busy = "import time; end = time.process_time() + 0.5\\nwhile time.process_time() < end: pass"
between = f"import os, subprocess, sys; subprocess.Popen([sys.executable, '-c', {busy!r}]); os._exit(0)"
subprocess.run([sys.executable, "-c", between], check=True)
now = spent()
print(now.ru_utime + now.ru_stime - before.ru_utime - before.ru_stime)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="processes are adopted on Linux alone")
def test_time_of_processes_that_outlive_their_parent_counts():
    """Half a second of CPU time that a grandchild uses after the end of its parent is part of the measured
    time."""
    done = subprocess.run([sys.executable, "-c", COUNT], capture_output=True, text=True, check=True)
    assert 0.5 < float(done.stdout) < 5.0


@pytest.mark.slow
def test_a_plants_night_is_run_and_measured_end_to_end(tmp_path):
    """Exports of areas are written and run by the command. The results have the floor, the time, the memory and
    the number of flagged loops."""
    plant = make(tmp_path, 12, 2.0, 1, tenth, area_of=8)
    assert [path.name for path in plant.exports] == ["area000.parquet", "area001.parquet"]
    found = night(plant, 2)
    assert found.loops == 12
    assert found.flagged > 0
    assert found.ratio > 1
    assert 50 < found.memory_mb < 2000
    assert line("tenth", found).count("|") == 10
