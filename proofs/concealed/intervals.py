#!/usr/bin/env python3
"""Do the intervals of an effect's parameters contain the truth? Only the right effect is fitted to each sealed case.

intervals.py OUT.md --each 12 --seed 71 [--keep FILE]: that many cases of every effect with comparable parameters, at
plain, masked and concealed strength in turn. The sealed generator makes the cases.
"""

import argparse
import os
import pathlib
import pickle
import sys
import tempfile

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))

import numpy as np
import pandas as pd

from analyzer.api import read
from analyzer.config import Config
from analyzer.explain.case import case
from analyzer.loops.spec import spec_of
from identification.estimation.prediction_error import FULL_STEPS, descended
from identification.mismatch.answer import parameters_of
from identification.mismatch.baseline import inputs_of, prepared, without_spikes
from identification.mismatch.catalogue import CANDIDATES
from identification.mismatch.selection import integrating_or_first_order, ranked_candidates
from identification.mismatch.starts import round_of
from proofs.concealed.effects import NAMES
from proofs.concealed.make import read_residuals, seal
from proofs.concealed.plan import Case
from proofs.concealed.proof import share, table
from proofs.concealed.score import INDISTINGUISHABLE, SHARED, indistinguishable, parameters

LEVELS = ("plain", "masked", "concealed")


def compared_names() -> list[str]:
    """Effects that are fitted and whose parameters occur in truth and answer."""
    fitted = {v.name for v in CANDIDATES if v.params}
    return [e.name for e in NAMES if any(indistinguishable(e.name, f, INDISTINGUISHABLE) for f in fitted)]


def fitted(cases: pathlib.Path, tag: str, effect: str):
    """Model inputs and fit of the right effect on one sealed case."""
    plant = read(cases / f"{tag}-fit.parquet", cases / "loops.csv")
    source, specs = plant.export, plant.specs
    spec = spec_of(specs, tag)
    s = case(
        spec, specs, source.read(list(spec.tags) + [t for o in specs for t in o.tags]), Config()
    ).recording
    inputs = inputs_of(s)
    begun = prepared(inputs, s.pv - inputs.level, without_spikes(s.pv, s.usable))
    p, plain = integrating_or_first_order(*begun, s)
    x = round_of(p, plain, s)
    rows = tuple(v for v in CANDIDATES if indistinguishable(v.name, effect, INDISTINGUISHABLE))
    best = ranked_candidates(x, rows)[0]
    return x.p, descended(x.p, best.fit.model, FULL_STEPS)


def answer_of(p, fit) -> dict:
    """The answer's parameters as the scorer reads them."""
    row = fit.model.added[-1]
    found = parameters_of(p, fit, row)
    shown = {k: {"value": e.value, "low": e.low, "high": e.high} for k, e in found.items()}
    return {"effects": [{"name": row.name, "parameters": shown}]}


def sealed_fits(each: int, seed: int) -> list:
    """(truth, model inputs, fit) of every case that could be sealed and fitted."""
    out, rng = [], np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        place = pathlib.Path(folder)
        library = read_residuals(None)
        for name in compared_names():
            for i in range(each):
                todo = Case("L0", ((name, LEVELS[i % len(LEVELS)]),), "", int(rng.integers(2**31)))
                try:
                    rows, tag, truth = seal(place, library, todo)
                    pd.DataFrame(rows).to_csv(place / "loops.csv", index=False)
                    if not set(truth["hidden"]) & set(SHARED) and "T_up" not in truth["hidden"]:
                        break
                    out.append((truth, *fitted(place, tag, name)))
                except (RuntimeError, ValueError, IndexError) as error:
                    print(f"{name}: {error}", file=sys.stderr)
            print(f"\r{name}: {len(out)} cases", end="", file=sys.stderr, flush=True)
    return out


def report(cases: list) -> str:
    """The table: how many intervals contain the truth, by parameter."""
    rows = pd.DataFrame([r for truth, p, fit in cases for r in parameters(truth, answer_of(p, fit))])
    lines = [
        [effect, name, len(g), f"{100 * g.error.abs().median():.0f} %", share(g.inside.astype(bool))]
        for (effect, name), g in rows.groupby(["effect", "parameter"])
    ]
    lines.append(
        ["all", "", len(rows), f"{100 * rows.error.abs().median():.0f} %", share(rows.inside.astype(bool))]
    )
    return table(["effect", "parameter", "cases", "median error", "truth within interval"], lines)


def main() -> None:
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("out", type=pathlib.Path)
    ap.add_argument("--each", type=int, default=12)
    ap.add_argument("--seed", type=int, default=71)
    ap.add_argument(
        "--keep", type=pathlib.Path, help="save the fits in this file, to test other intervals on them"
    )
    a = ap.parse_args()
    cases = sealed_fits(a.each, a.seed)
    if a.keep:
        a.keep.write_bytes(pickle.dumps(cases))
    head = (
        "# Do the intervals of effects contain the truth?\n\n"
        f"`python proofs/concealed/intervals.py OUT.md --each {a.each} --seed {a.seed}`; intervals are of 90 %.\n\n"
    )
    a.out.write_text(head + report(cases) + "\n")
    print("\n" + report(cases))


if __name__ == "__main__":
    main()
