"""Valves that wear: reports and forecasts compared with the truth: python -m proofs.wear [--seed 61] [--nights 60]

The plant has 24 loops whose backlash grows linearly from .3 to 3 % of OP in sixty nights, and twelve loops without a
fault. Each night has twelve hours with new load and noise; the physics is that of the sample mill. The table shows
the first night with a reported worn valve, and the first night with reported wear. It shows the true day on which the
backlash reaches 5 %, and the days between which this is predicted. The prediction uses the data up to the night
before the last. Writes wear.md here.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.store.store import Store
from proofs.common import command, command_line, publish, table
from proofs.many_nights import EVERY_S, Drawn, draw, simulated
from proofs.plant import START_S, spec, write_export

WEARING, WITHOUT_FAULT = 24, 12
FROM, TO, IN_NIGHTS, PREDICTED = 0.3, 3.0, 60, 5.0
COLUMNS = (
    *("loop", "certain_since", "width_pct", "wear_since", "wear_pct_per_month", "valve_fault"),
    *("reaches_pct", "reaches_from", "reaches_by"),
)


def drawn(seed: int) -> list[Drawn]:
    """Loops with backlash, then loops without a fault, of the plants of many_nights."""
    rng, wearing, without_fault = np.random.default_rng(seed), [], []
    for number in range(10_000):
        loop = draw(rng, number)
        if loop.cause == "backlash" and len(wearing) < WEARING:
            wearing.append(loop)
        elif loop.cause == "healthy" and len(without_fault) < WITHOUT_FAULT:
            without_fault.append(loop)
    return [*wearing, *without_fault]


def width(night: float) -> float:
    """The true backlash in a night [% OP]."""
    return FROM + (TO - FROM) * night / IN_NIGHTS


def nightly(seed: int, nights: int, jobs: int) -> tuple[list[Drawn], list[dict[str, Mapping[str, Any]]]]:
    """The loops, and the rows of each night."""
    plant = drawn(seed)
    stated = [spec(d.tag, d.kind, kp=d.kp, ti=d.ti, scan_s=1.0) for d in plant]
    found = []
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder) / "store")
        for night in range(nights):
            worn = [replace(d, backlash=width(night)) if d.is_worn else d for d in plant]
            trends = {d.tag: simulated(d, (seed, night, k)) for k, d in enumerate(worn)}
            first = START_S + night * 86400.0
            path = write_export(Path(folder) / "night.parquet", trends, first, float(EVERY_S))
            batch.run(Plant(open_export([path]), stated, Config()), store, jobs)
            found.append({r["loop"]: r for r in store.rows("nights", store.nights()[-1], COLUMNS)})
            print(f"night {night + 1} of {nights}", file=sys.stderr)
    return plant, found


def day(night: float) -> str:
    """The date of a night."""
    return (date(2026, 3, 2) + timedelta(days=int(np.ceil(night)))).isoformat()


def cells(loop: Drawn, found: Sequence[dict[str, Mapping[str, Any]]]) -> tuple[tuple[str, ...], bool]:
    """The row of one loop with wear, and whether the forecast contains the true day."""
    rows = [n[loop.tag] for n in found]
    worn = next((k for k, r in enumerate(rows) if r["certain_since"]), None)
    wears = next((k for k, r in enumerate(rows) if r["wear_pct_per_month"] is not None), None)
    last = rows[-1]
    reached = day(IN_NIGHTS * (PREDICTED - FROM) / (TO - FROM))
    first, by = last["reaches_from"] or "", last["reaches_by"] or "9999"
    held = last["reaches_pct"] == PREDICTED and first <= reached <= by
    seen = ("–" if k is None else f"{k + 1} ({width(k):.2g} %)" for k in (worn, wears))
    forecast = f"{first} … {last['reaches_by'] or 'not within a year'}" if first else "none"
    pooled = "–" if last["width_pct"] is None else f"{last['width_pct']:.2f}"
    return (loop.tag, loop.kind, *seen, pooled, forecast, reached, "yes" if held else "no"), held


def main() -> None:
    """Run the nights and write the page."""
    given = command_line(__doc__, seed=61, nights=60, jobs=2)
    plant, found = nightly(given.seed, given.nights, given.jobs)
    rows = [cells(d, found) for d in plant if d.is_worn]
    blamed = sum(
        n[d.tag]["valve_fault"] in ("backlash", "stiction") for d in plant if not d.is_worn for n in found
    )
    wearing = sum(n[d.tag]["wear_pct_per_month"] is not None for d in plant if not d.is_worn for n in found)
    publish(
        __file__,
        "Valves that wear: reports and forecasts compared with the truth",
        command(__file__, seed=given.seed, nights=given.nights),
        (__doc__ or "").split("\n\n")[1].replace("\n", " ").split(" Writes wear.md")[0],
        f"The forecast contains the true day in {sum(held for _, held in rows)} of {len(rows)}. "
        f"For {WITHOUT_FAULT} valves without a fault {blamed} nights report a valve fault, and {wearing} "
        "report wear.",
        table(
            "loop | kind | worn from night (width) | wears from | width at the end | reaches 5 % | truth | contained",
            [row for row, _ in rows],
        ),
    )


if __name__ == "__main__":
    main()
