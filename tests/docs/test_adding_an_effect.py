"""The code on the page about adding an effect works unchanged and finds the effect that the page describes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "adding-an-effect.md"

RUNNER = '''
import importlib.util, json, sys
import numpy as np

name = "identification.mismatch.catalogue"
spec = importlib.util.find_spec(name)
spec.submodule_search_locations.append(sys.argv[1])
sys.modules[name] = module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)

from identification.mismatch.answer import answer
from identification.mismatch.diagnosis import explain
from identification.mismatch.recording import Recording


def recording(band, seed=3, n=2600):
    """A lag of 15 s and a sensor with a dead band under random steps of OP, computed without the simulator."""
    rng = np.random.default_rng(seed)
    op = 50 + np.cumsum(np.where(np.arange(n) % 60 == 0, rng.normal(0, 4, n), 0.0))
    op = 50 + 12 * np.tanh((op - 50) / 12)
    y, shown, out = 0.0, 0.0, []
    for k in range(n):
        y += (1.5 * (op[max(k - 4, 0)] - 50) - y) / 15.0
        if y - shown > band / 2:
            shown = y - band / 2
        elif shown - y > band / 2:
            shown = y + band / 2
        out.append(50 + shown)
    pv = np.round(np.array(out) + rng.normal(0, 0.05, n), 2)
    return Recording(None, pv, op, np.ones(n, dtype=bool), 1.0, np.arange(n) * 1.0)


answers = []
for band in (1.0, 0.0):
    s = recording(band)
    found = answer(explain(s), s)
    first = found.effects[0].parameters if found.effects else {}
    answers.append([found.verdict, {k: v.value for k, v in first.items()}])
print(json.dumps(answers))
'''


def test_page_adds_an_effect(tmp_path: Path) -> None:
    """With the page's file alone, `explain` reports a sticking sensor with its band, and reports no effect if
    the sensor does not stick."""
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    assert code is not None
    (tmp_path / "sensor_sticks.py").write_text(code.group(1))
    run = subprocess.run(
        [sys.executable, "-c", RUNNER, str(tmp_path)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    (name, numbers), (other, _) = json.loads(run.stdout)
    assert name == "sensor-sticks"
    assert abs(numbers["sensor_band_pct"] - 1.0) < 0.15
    assert other == "none"
