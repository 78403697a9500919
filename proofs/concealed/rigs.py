#!/usr/bin/env python3
"""What `explain` reports for recordings of real laboratory rigs, from the exports alone.

rigs.py FOLDER [--out docs/evidence/PROOF.md]

FOLDER holds TANK-*.parquet, DUCT-*.parquet, PHX-*.parquet, PILOT-*.parquet and DRYER.parquet, without set points and
without loops.csv (except for the duct's PI loop). The duct's models, baseline and improved, are fitted to its
open-loop step and tested on its PI loop.
"""

import argparse
import os
import pathlib
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))

import numpy as np

from analyzer.api import read
from analyzer.config import Config
from analyzer.explain.case import Case, case
from analyzer.explain.explained import Explained, explained
from analyzer.explain.models import simulated
from analyzer.loops.spec import spec_of
from identification.mismatch.model_file import to_data
from identification.mismatch.selection import silent
from proofs.concealed.proof import place_section, table

STEP, LOOP = "DUCT-03_air_step_1_5_90", "DUCT-09_pi_siso_full"


def loaded(path: pathlib.Path) -> Case:
    """The only loop of an export."""
    plant = read(path)
    source, specs = plant.export, plant.specs
    spec = spec_of(specs, path.stem.split("-")[0])
    return case(spec, specs, source.read(list(spec.tags)), Config())


def line(name: str, e: Explained) -> list[str]:
    """One rig: verdict, effects, misfit of the baseline and the improved loop."""
    shown = [
        f"{100 * (1 - part['fit_pct'] / 100):.0f} → {100 * (1 - e.said.fit['explained'][key]['fit_pct'] / 100):.0f}"
        for key, part in e.said.fit["baseline"].items()
    ]
    return [name, e.said.verdict, ", ".join(x.name for x in e.said.effects) or "–", *shown]


def misfit(c: Case, model: dict) -> float:
    """Rms misfit of a model on another recording, in PV's own unit, with a free constant bias."""
    r, s = c.prepared.record, c.prepared.scale
    pv, _ = simulated(c, model, r.start_s + r.time_s, False)
    return float(np.std(s.low + r.pv * s.span / 100.0 - pv))


def carried_over(step: Explained, loop: Case) -> str:
    """The duct's baseline and improved model, fitted to the step, on the PI loop."""
    best = step.model()
    baseline = best | to_data("DUCT", step.found.p.inputs, step.found.plain.model.c, (), 0.0, best["scale"])
    return f"{misfit(loop, baseline):.3f} → {misfit(loop, best):.3f}"


def section(folder: pathlib.Path) -> str:
    """The section of PROOF.md."""
    lines, step = [], None
    for path in sorted(folder.glob("*.parquet")):
        found = explained(loaded(path), silent)
        step = found if path.stem == STEP else step
        lines.append(line(path.stem, found))
    head = ["recording", "verdict", "effects", "misfit, fitted (% of PV's spread)", "held out"]
    parts = [
        "## Rigs",
        "`python proofs/concealed/rigs.py FOLDER --out docs/evidence/PROOF.md`",
        table(head, lines),
    ]
    if step is not None and (folder / f"{LOOP}.parquet").exists():
        misfits = carried_over(step, loaded(folder / f"{LOOP}.parquet"))
        parts.append(
            f"The duct's models of the step on its PI loop, rms in PV's unit, plain → improved: {misfits}."
        )
    return "\n\n".join(parts) + "\n"


def main() -> None:
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("folder", type=pathlib.Path)
    ap.add_argument("--out", type=pathlib.Path, help="file that takes the section, e.g. PROOF.md")
    a = ap.parse_args()
    text = section(a.folder)
    if a.out is not None:
        place_section(a.out, "rigs", text)
    print(text)


if __name__ == "__main__":
    main()
