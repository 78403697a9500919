"""Time and answers compared with PyPI's `stictionanalyser`: python -m benchmarks.peer --peer ENVIRONMENT/bin/python

That package fits ellipses to pictures of OP against PV, cycle by cycle. It needs old versions of its dependencies, so
it runs in its own environment, made by

    python -m venv ENVIRONMENT
    ENVIRONMENT/bin/pip install "numpy<2" "matplotlib<3.8" "pandas<2.3" "opencv-python-headless<4.11" scikit-image
    ENVIRONMENT/bin/pip install scipy && ENVIRONMENT/bin/pip install --no-deps stictionanalyser

Its user interface for a commercial server is omitted; its detection is called in the same way as this interface calls
it. Records are of 6 h at 1 s, of sticking valves, of oscillating controllers, of loads and of loops at rest. The
package names no cause; it counts the cycles that show stiction. The table shows their median share. Writes peer.md
here.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analyzer.config import Config
from analyzer.loop.assess import assess
from analyzer.loop.decisions import Cause
from analyzer.loop.record.quality import prepare
from benchmarks.night import HEALTHY
from proofs.common import command, parser_of, publish
from proofs.plant import START_S, Sketch, Trends, series, simulate, spec

HOURS = 6.0
EACH = 6
"""Number of records of a kind."""
STICKS = (
    Sketch("stiction", (1.2, 8.0, 3.0), 0.4, 20.0, stickband=4.0, slip_jump=3.0, noise=0.08, kind="flow"),
    Sketch("stiction", (1.5, 40.0, 8.0), 0.8, 40.0, stickband=3.0, slip_jump=1.5),
)
HUNTS = (Sketch("tuning", (1.5, 120.0, 20.0), 4.6, 60.0, noise=0.03, load_std=0.6, load_s=300.0),)
LOADED = (Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, noise=0.08, load_std=0.3, sine=3.0, sine_s=840.0),)
KINDS = {"stiction": STICKS, "tuning": HUNTS, "load": LOADED, "at rest": HEALTHY}

PEER = """
import json, sys, time, types, warnings
from unittest.mock import MagicMock
warnings.simplefilter("ignore")
import matplotlib
matplotlib.use("Agg")
import numpy as np, pandas as pd
for name in ("seeq.spy", "seeq.sdk", "ipyvuetify", "ipywidgets", "IPython", "IPython.display"):
    sys.modules[name] = MagicMock()
import seeq
seeq.spy = seeq.sdk = MagicMock()
import importlib.util, os
home = [os.path.join(p, "addons", "stictionanalyser") for p in seeq.__path__]
home = next(p for p in home if os.path.isdir(p))
package = types.ModuleType("peer")
package.__path__ = [home]
sys.modules["peer"] = package
from peer._CreatePVOP import CreatePVOP
del sys.modules["IPython"], sys.modules["IPython.display"]
out = {}
for path in sys.argv[1:]:
    held = np.load(path)
    op, error = pd.Series(held["op"]), pd.Series(held["error"])
    begun = time.process_time()
    try:
        found, _ = CreatePVOP(error, op, 0, op, error)
        shares = [f.split("/") for f in found if isinstance(f, str) and "/" in f] if found != "none" else []
        cycles = sum(int(a) for a, _ in shares), sum(int(b) for _, b in shares)
        why = ""
    except Exception as error:
        cycles, why = (0, 0), f"{type(error).__name__}: {error}"
    out[path] = {"cycles": cycles, "why": why, "s": time.process_time() - begun}
print(json.dumps(out))
"""


@dataclass(frozen=True)
class Record:
    """One record: its kind, its sketch and its trends."""

    kind: str
    sketch: Sketch
    trends: Trends


@dataclass(frozen=True)
class Answer:
    """Whether the valve is reported as the cause (ours: no or yes; the other: share of cycles), processor time
    [s]."""

    valve: float
    spent_s: float
    lost: bool = False


def records() -> list[Record]:
    """Some records of each kind; the gains differ by up to a fifth."""
    out = []
    for kind, sketches in KINDS.items():
        for k in range(EACH):
            sketch = sketches[k % len(sketches)]
            factor = 0.9 + 0.2 * np.random.default_rng(k).random()
            sketch = replace(sketch, process=(sketch.process[0] * factor, *sketch.process[1:]))
            out.append(Record(kind, sketch, simulate(sketch, HOURS, 100 + k)))
    return out


def ours(r: Record) -> Answer:
    """The answer of the night."""
    stamp = START_S + np.arange(r.trends.pv.size, dtype=float)
    found = {f"L.{n.upper()}": series(stamp, getattr(r.trends, n)) for n in ("sp", "pv", "op")}
    begun = time.process_time()
    verdict = assess(
        prepare(spec("L", r.sketch.kind), found, Config().quality), r.sketch.controller, Config()
    ).verdict
    return Answer(float(verdict.cause is Cause.VALVE), time.process_time() - begun)


def theirs(made: Sequence[Record], python: Path) -> list[Answer]:
    """The answer of the other package, in its own environment."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{k}.npz" for k in range(len(made))]
        for path, r in zip(paths, made, strict=True):
            np.savez(path, op=r.trends.op, error=r.trends.pv - r.trends.sp)
        command = [str(python), "-c", PEER, *map(str, paths)]
        answers = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    rows = [answers[str(path)] for path in paths]
    for why in sorted({r["why"] for r in rows if r["why"]}):
        print(why)
    return [Answer(r["cycles"][0] / max(r["cycles"][1], 1), r["s"], bool(r["why"])) for r in rows]


def table(made: Sequence[Record], own: Sequence[Answer], other: Sequence[Answer]) -> str:
    """The answers for the records of each kind, and the median processor time of one record."""
    lines = [
        "| records | valve reported | ms | cycles with stiction, stictionanalyser | ms | lost | times as long |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for kind in KINDS:
        at = [k for k, r in enumerate(made) if r.kind == kind]
        ms = [1000 * float(np.median([x[k].spent_s for k in at])) for x in (own, other)]
        shares = 100 * float(np.median([other[k].valve for k in at]))
        cells = (f"{sum(own[k].valve for k in at):.0f} of {len(at)}", f"{ms[0]:.0f}", f"{shares:.0f} %")
        more = (f"{ms[1]:.0f}", str(sum(other[k].lost for k in at)), f"{ms[1] / ms[0]:.0f}")
        lines.append(f"| {kind} | " + " | ".join((*cells, *more)) + " |")
    return "\n".join(lines)


def main() -> None:
    """Run both and write the table next to this file."""
    parser = parser_of(__doc__)
    parser.add_argument("--peer", type=Path, required=True, help="the Python of its environment")
    options = parser.parse_args()
    made = records()
    ours(made[0])
    text = table(made, [ours(r) for r in made], theirs(made, options.peer))
    about = "Medians of processor time of a record of 6 h at 1 s; see the docstring for what is compared."
    publish(__file__, "Comparison with stictionanalyser", command(__file__, peer="PYTHON"), about, text)


if __name__ == "__main__":
    main()
