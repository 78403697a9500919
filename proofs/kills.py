"""A night that is killed at random points and resumed: python -m proofs.kills [--kills 50]

A run of 24 loops over two nights, as in a plant (loops.csv, changes.csv, two worker processes), is killed with signal
9, parent and workers. The kill comes after a random share of the time of an undisturbed run. Then the run is started
again with --resume until it ends. Its store must equal that of the undisturbed run, table by table and cell by cell.
Every process has its own hash seed, as in a plant. Writes kills.md here.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import pyarrow.parquet as pq

from proofs.common import command as shown
from proofs.common import command_line, publish, table
from proofs.plant import START_S, Sketch, simulate, write_export

LOOPS, HOURS = 24, 40.0
CHANGED_H = 30.0
"""Time at which settings of some loops change, within the second night [h after the start]."""


def tables(store: Path) -> dict[str, list[dict[str, object]]]:
    """All rows of a store's tables, in the order of loops and time."""
    paths = sorted(p for p in store.rglob("*.parquet") if "parts" not in p.parts)
    rows = {p.relative_to(store).as_posix(): pq.read_table(p).to_pylist() for p in paths}
    order = ("loop", "time_s", "hour_s", "group")
    return {
        name: sorted(
            found, key=lambda r: [str(r.get(k)) if k in ("loop", "group") else r.get(k) or 0 for k in order]
        )
        for name, found in rows.items()
    }


def state(folder: Path, loops: Sequence[str]) -> None:
    """loops.csv and changes.csv of a plant: settings and ranges of each loop, every fourth one changed."""
    head = "loop,area,sp,pv,op,pv_lo,pv_hi,op_lo,op_hi,kp,ti,form,gain_unit,ti_unit,scan_s,importance,op_unit"
    rows = [f"{n},Mill,{n}.SP,{n}.PV,{n}.OP,0,100,0,100,1,60,ideal,percent,s,1,2,%" for n in loops]
    (folder / "loops.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    at = datetime.fromtimestamp(START_S + CHANGED_H * 3600.0, UTC).isoformat()
    changes = [f"{n},{at},2,60,1,60,AB" for n in loops[::4]]
    text = "\n".join(["loop,time,kp_old,ti_old,kp_new,ti_new,who", *changes]) + "\n"
    (folder / "changes.csv").write_text(text, encoding="utf-8")


def command(export: Path, store: Path, *more: str) -> list[str]:
    """The batch as its own process, as in a plant."""
    result = [sys.executable, "-m", "analyzer.cli", "run", str(export), "--store", str(store), "--jobs", "2"]
    stated = ("--loops", str(export.parent / "loops.csv"), "--changes", str(export.parent / "changes.csv"))
    return [*result, *stated, *more]


def seeded(seed: int) -> dict[str, str]:
    """The environment of a process with its own order of sets."""
    return {**os.environ, "PYTHONHASHSEED": str(seed)}


def stage(store: Path) -> str:
    """The stage that a killed run had reached."""
    if not (store / "parts" / "run.json").exists():
        return "before the first piece" if not list(store.glob("nights/*.parquet")) else "after the end"
    done = list(store.glob("parts/*/nights-*.parquet"))
    if not done:
        return "in the first loops"
    return "putting the nights together" if list(store.glob("nights/*.parquet")) else "among the loops"


def killed(export: Path, store: Path, after_s: float) -> str:
    """Run, kill after a time, and resume until the run ends; the stage of the kill, or 'not killed'."""
    silent = subprocess.DEVNULL
    run = subprocess.Popen(command(export, store), stderr=silent, stdout=silent, env=seeded(1))
    try:
        run.wait(after_s)
        return "not killed"
    except subprocess.TimeoutExpired:
        run.send_signal(signal.SIGKILL)
        run.wait()
    where = stage(store)
    asked = command(export, store, "--resume")
    again = subprocess.run(asked, capture_output=True, text=True, check=False, env=seeded(2))
    if again.returncode != 0 or "Traceback" in again.stderr:
        raise SystemExit(f"killed {where}: {again.stderr}")
    return where


def main() -> None:
    """Kill, compare, print and write the table next to this file."""
    wanted = command_line(__doc__, kills=50).kills
    draw, at, same = random.Random(1), Counter[str](), 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sketch = Sketch("none", (1.0, 60.0, 10.0), 1.0, 60.0)
        loops = {f"L{k:02d}": simulate(sketch, HOURS, k) for k in range(LOOPS)}
        export = write_export(folder / "x.parquet", loops)
        state(folder, list(loops))
        begun = time.monotonic()
        subprocess.run(command(export, folder / "whole"), check=True, capture_output=True)
        takes_s = time.monotonic() - begun
        whole = tables(folder / "whole")
        while sum(at.values()) < wanted:
            store = folder / f"store{sum(at.values())}"
            where = killed(export, store, draw.uniform(0.0, takes_s))
            if where == "not killed":
                continue
            at[where] += 1
            same += tables(store) == whole
    result = f"{same} of {wanted} stores equal the store of the undisturbed run."
    about = (
        f"{LOOPS} loops of {HOURS:g} h at 1 s with loops.csv and changes.csv, two workers. The parent gets signal 9;"
        "\nits workers end with it. Each process has its own hash seed."
    )
    counts = table("killed | times", sorted(at.items()), numbers=True)
    publish(__file__, "A night killed at random points", shown(__file__, kills=wanted), about, counts, result)


if __name__ == "__main__":
    main()
