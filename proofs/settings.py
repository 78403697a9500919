"""Are stated settings reported as wrong where they differ from the controller's? python -m proofs.settings [--seed 71
72]

Controllers of many kinds (proofs/settings_plant.py, which shares no code with the package) are recorded. Their
settings are stated correctly, and stated wrong. Writes settings.md here.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.identification.measure import time_scale
from analyzer.loop.oscillation.detection import counting, detect
from analyzer.loop.record.judged_stretch import controller_of, differing
from analyzer.loop.record.quality import prepare
from analyzer.loops.tags import match, read_loops
from identification.models import Pid
from proofs.common import command, command_line, publish, table
from proofs.settings_plant import recordings

STATED: dict[str, Callable[[Pid], Pid]] = {
    "as they are": lambda c: c,
    "Kp times 2.5, Ti times 3": lambda c: replace(c, kp=2.5 * c.kp, ti_s=3 * c.ti_s, td_s=c.td_s),
    "Kp times 2.5": lambda c: replace(c, kp=2.5 * c.kp),
    "Kp over 2.5": lambda c: replace(c, kp=c.kp / 2.5),
    "Kp times 1.4": lambda c: replace(c, kp=1.4 * c.kp),
    "Ti times 3": lambda c: replace(c, ti_s=3 * c.ti_s),
    "Ti over 3": lambda c: replace(c, ti_s=c.ti_s / 3),
    "without Td": lambda c: replace(c, td_s=0.0),
    "sign turned": lambda c: replace(c, kp=-c.kp),
}
"""The stated settings of the controller."""


def reported(seed: int, count: int) -> list[tuple[str, dict[str, bool]]]:
    """For each loop of a seed its kind, and whether each way to state its settings is reported as wrong."""
    config, made = Config(), recordings(seed, count)
    out = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for r in made:
            (folder / r.tag).mkdir()
            r.trends.to_parquet(folder / r.tag / "trends.parquet")
        pd.DataFrame([r.row for r in made]).to_csv(folder / "loops.csv", index=False)
        specs = {s.loop: s for s in read_loops(folder / "loops.csv")}
        for r in made:
            export = open_export([folder / r.tag])
            (spec,), *_ = match([specs[r.tag]], export.tags)
            p = prepare(spec, export.read(spec.tags), config.quality)
            true = controller_of(spec, p)
            assert true is not None
            first = counting(detect(p.record, config.oscillation))
            found = {}
            for label, change in STATED.items():
                stated = change(true)
                if stated == true and label != "as they are":
                    continue
                scale = time_scale(p.record, first, stated)
                found[label] = differing(p.record, stated, scale, config.settings) is not None
            out.append((r.kind, found))
    return out


def main() -> None:
    """Count over all loops of some seeds and write the table."""
    options = command_line(__doc__, seed=[71, 72], loops=60)
    rows = [row for seed in options.seed for row in reported(seed, options.loops)]
    kinds = sorted({kind for kind, _ in rows})

    def cells(label: str) -> list[str]:
        each = [[f[label] for kind, f in rows if kind in of and label in f] for of in ([k] for k in kinds)]
        each.append([x for some in each for x in some])
        return [label, *(f"{sum(x)} of {len(x)}" if x else "" for x in each)]

    text = table(f"stated | {' | '.join(kinds)} | all", map(cells, STATED))
    publish(
        __file__,
        "Are stated settings those of the controller?",
        command(__file__, seed=options.seed, loops=options.loops),
        "Loops whose stated settings are reported as not those of the controller; in the first row each report is a "
        "false alarm.",
        text,
    )


if __name__ == "__main__":
    main()
