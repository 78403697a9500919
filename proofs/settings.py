"""Are stated settings told from the controller's where they differ? python -m proofs.settings [--seed 71 72]

Loops of the retuning proof's plants, whose physics and controllers share no code with the package, are recorded with
the settings stated as they are, and with the gain or the integral time stated wrong. Writes settings.md here.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.measure import time_scale
from analyzer.loop.oscillation import counting, detect
from analyzer.loop.quality import prepare
from analyzer.loop.settings_check import differing
from analyzer.loops.tags import controller, match, read_loops
from proofs.common import command, command_line, publish, table
from proofs.retuning import COUNTS, write_export, write_loops
from proofs.retuning_plant import drawn

STATED = ((1.0, 1.0), (2.0, 1.0), (0.5, 1.0), (1.3, 1.0), (1.0, 3.0), (1.0, 1 / 3))
"""What gain and integral time are stated as, over the true ones [-]."""


def told(seed: int) -> list[list[bool]]:
    """For each loop of a seed, whether settings stated so are told as others."""
    config, rigs = Config(), list(drawn(seed, COUNTS))
    out = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "trends").mkdir()
        for rig in rigs:
            write_export(rig, folder / "trends")
        write_loops(rigs, folder / "loops.csv")
        export = open_export([folder / "trends"])
        for spec in match(read_loops(folder / "loops.csv"), export.tags)[0]:
            p = prepare(spec, export.read(spec.tags), config.quality)
            true = controller(spec, p.scale.span)
            assert true is not None
            first = counting(detect(p.record, config.oscillation))
            wrong = [replace(true, kp=true.kp * k, ti_s=true.ti_s * t) for k, t in STATED]
            scales = [time_scale(p.record, first, c) for c in wrong]
            found = [differing(p.record, c, s, config.settings) for c, s in zip(wrong, scales, strict=True)]
            out.append([f is not None for f in found])
    return out


def main() -> None:
    """Count over all loops of some seeds and write the table."""
    seeds = command_line(__doc__, seed=[71, 72]).seed
    rows = [row for seed in seeds for row in told(seed)]
    counts = (
        (f"{k:.3g}", f"{t:.3g}", f"{sum(row[i] for row in rows)} of {len(rows)}")
        for i, (k, t) in enumerate(STATED)
    )
    text = table("Kp stated over true | Ti stated over true | told as others", counts)
    publish(__file__, "Are stated settings those of the controller?", command(__file__, seed=seeds), text)


if __name__ == "__main__":
    main()
