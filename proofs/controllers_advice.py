"""Does advice hold for typical controllers? python -m proofs.controllers_advice [--seed 1 2] [--days 1]

The loops are from proofs/controllers_plant.py. Some have a gap, limits of OP and of its rate, a filter of PV or a
slow scan, and state only gain and integral time. Others have a gain schedule, which is stated too. Each is worn,
tuned too tight, or unstable. The advised settings are set in the same controller on the same plant under the same
load. Writes controllers_advice.md here.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.record.quality import prepare
from analyzer.loops.tags import match, read_loops
from analyzer.night.chunk import assess_loop
from proofs.common import command, command_line, publish, table
from proofs.controllers_plant import Controlled, controlled

STATED = ("gain schedule", "P only", "integral only")
"""Controllers that are stated completely."""
TESTED = ("gap", "limit of OP", "limit of OP's rate", "PV filter", "slow scan", *STATED)
CASES = {"worn": ("worn", 1.5), "too tight": ("healthy", 3.0), "unstable": ("healthy", 5.0)}
"""Scene, and factor on the usual gain."""


def advised(c: Controlled, every: int) -> tuple[float, float] | None:
    """Advised gain and integral time; None where there is no advice."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "trends").mkdir()
        c.trends("L", every).to_parquet(folder / "trends" / "trends.parquet")
        row = {"loop": "L", **c.row, **(c.extras if c.form in STATED else {})}
        pd.DataFrame([row]).to_csv(folder / "loops.csv", index=False)
        export, config = open_export([folder / "trends"]), Config()
        (spec,), *_ = match(read_loops(folder / "loops.csv"), export.tags)
        _, advice = assess_loop(spec, prepare(spec, export.read(spec.tags), config.quality), config)
    return None if advice.kp_new is None or advice.ti_new is None else (advice.kp_new, advice.ti_new)


def error(c: Controlled) -> float:
    """Average absolute error [% PV]."""
    return float(np.mean(np.abs(c.sp - c.pv)))


def main() -> None:
    """Set the advised settings, and tabulate the change of the error."""
    options = command_line(__doc__, seed=[1], days=1.0)
    rows = []
    for form in TESTED:
        for case, (scene, tight) in CASES.items():
            ratios = []
            for seed in options.seed:
                before = controlled(form, scene, seed, options.days, tight)
                for every in (1, 10):
                    typed = advised(before, every)
                    if typed is not None:
                        after = controlled(form, scene, seed, options.days, tight, typed)
                        ratios.append(error(after) / error(before))
            change = (
                [f"{100 * (x - 1):+.0f}" for x in (np.median(ratios), max(ratios))] if ratios else ["", ""]
            )
            rows.append(
                (form, case, 2 * len(options.seed), len(ratios), *change, sum(x > 1.1 for x in ratios))
            )
            print(*rows[-1], flush=True)
    publish(
        __file__,
        "Does advice hold for typical controllers?",
        command(__file__, seed=options.seed, days=options.days),
        "Of these loops only gain and integral time are stated; a gain schedule is stated too. They are recorded "
        "every 1 and 10 s. New settings are set in the same controller on the same plant under the same load.",
        table(
            "controller | case | recordings | new settings | error, median % | error, worst % | over 10 %",
            rows,
            True,
        ),
    )


if __name__ == "__main__":
    main()
