"""Two weeks of nights, with the advice compared with the truth: python -m proofs.nights [--jobs 2]

Each night of the sample mill is a separate run; all runs go into one store. One series uses loops.csv alone, like a
plant without a list of changes. From 2026-03-09 on this file is out of date for the seven loops retuned on that day.
The other series also uses changes.csv. Every advised pair of settings is set in the true loop. The load and noise of
the night are simulated again with old and new settings. The tables list the changes reported each morning with the
truth. Writes nights.md here.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.decisions import Action, Fault
from analyzer.loops.changes import TuningChange, read_changes
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import controller, match, read_loops
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.pages.rank import ranked
from analyzer.pages.reading import read_night
from analyzer.pages.summary import news_lines
from analyzer.store.store import Store
from proofs.common import command_line

SAMPLE = Path(__file__).resolve().parents[1] / "sample_data"
if str(SAMPLE) not in sys.path:
    sys.path.append(str(SAMPLE))

from mill import DAY_S, MILL, RETUNED_S, START, Loop, simulate_loop  # noqa: E402

OUT = Path(__file__).with_suffix(".md")
SETTLE_S = 6 * 3600
"""Omitted at the start of a night, so that the effect of the previous settings has decayed [s]."""
HARM = 1.05
"""Ratio of error or travel with the advice to that without it, above which the advice is harmful [-]."""


@dataclass(frozen=True)
class Advised:
    """One loop and night: its row, and error and stem travel with new settings over those without, if there are new
    settings."""

    night: str
    loop: str
    row: dict[str, Any]
    error: float | None = None
    travel: float | None = None

    @property
    def is_harmful(self) -> bool:
        """Whether the advised settings make the true loop worse."""
        return max(self.error or 0.0, self.travel or 0.0) > HARM


def in_force(loop: Loop, night: int) -> tuple[float, float]:
    """Settings at the end of a night, counted from 0."""
    changed = loop.retuned is not None and (night + 1) * DAY_S > RETUNED_S + 60 * loop.minute
    return loop.retuned if changed and loop.retuned else loop.tuning


def figures(
    loop: Loop, settings: tuple[float, float], night: int, sources: dict[str, Any]
) -> tuple[float, float]:
    """Average absolute error and stem travel of the true loop in a night with these settings."""
    n = (night + 1) * DAY_S
    trend = simulate_loop(replace(loop, tuning=settings, retuned=None), n, sources)
    last = slice(night * DAY_S + SETTLE_S, n)
    error = float(np.mean(np.abs(trend.sp[last] - trend.pv[last])))
    return error, float(np.abs(np.diff(trend.stem[last])).sum())


def typed_in(loop: Loop, spec: LoopSpec, row: dict[str, Any], night: int) -> tuple[float, float]:
    """Ratios of error and travel: advised settings over the settings in force."""
    span = loop.unit.hi - loop.unit.lo
    new = controller(replace(spec, kp=row["kp_new"], ti=row["ti_new"]), span)
    assert new is not None
    sources = {}
    if loop.load.source:
        source = next(x for x in MILL if x.tag == loop.load.source)
        sources = {source.tag: simulate_loop(source, (night + 1) * DAY_S, {})}
    before = figures(loop, in_force(loop, night), night, sources)
    after = figures(loop, (new.kp, new.ti_s), night, sources)
    return after[0] / before[0], after[1] / max(before[1], 1e-9)


def nights(jobs: int, changes: Sequence[TuningChange], overnight: list[str]) -> Iterator[Advised]:
    """All loops of all nights, run one after another into one store, with the changes that the plant states;
    `overnight` collects the changes reported each morning."""
    with tempfile.TemporaryDirectory() as folder:
        yield from _nights(jobs, changes, Store(Path(folder) / "store"), overnight)


def _nights(
    jobs: int, changes: Sequence[TuningChange], store: Store, overnight: list[str]
) -> Iterator[Advised]:
    export = open_export([SAMPLE / "mill.parquet"])
    specs = match(read_loops(SAMPLE / "loops.csv"), export.tags)[0]
    truth = {loop.tag: loop for loop in MILL}
    for night in range(14):
        first = START + timedelta(days=night)
        span = first.timestamp(), first.timestamp() + DAY_S
        batch.run(Plant(export, specs, Config(), span, changes), store, jobs)
        rows = {r["loop"]: r for r in ranked(store, "oscillation_significance")[0]}
        reports = news_lines(read_night(store, None, 1, drawn=False)) if night else []
        overnight += [f"| {first:%m-%d} | {line} | {truth[line.split()[0]].cause} |" for line in reports]
        for spec in specs:
            row = rows[spec.loop]
            ratios = (None, None) if row["kp_new"] is None else typed_in(truth[spec.loop], spec, row, night)
            yield Advised(f"{first:%m-%d}", spec.loop, row, *ratios)


def wrong(found: list[Advised], listed: bool) -> list[str]:
    """Valves reported as worn that have no fault, and stated settings called wrong that are in force."""
    truth = {loop.tag: loop for loop in MILL}
    worn = [
        a
        for a in found
        if truth[a.loop].cause not in (Fault.BACKLASH, Fault.STICTION)
        and (
            a.row["valve_fault"] in (Fault.BACKLASH, Fault.STICTION) or a.row["action"] == Action.REPAIR_VALVE
        )
    ]
    stale = [
        a
        for a in found
        if a.row["action"] == Action.CHECK_SETTINGS
        and (listed or a.night < "03-09" or truth[a.loop].retuned is None)
    ]
    cases = [f"{a.loop} on {a.night}" for a in (*worn, *stale)]
    names = f": {', '.join(cases)}" if cases else ""
    return [
        f"{len(worn)} valves without a fault reported as worn, {len(stale)} true settings called wrong{names}.",
        "",
    ]


def section(title: str, found: list[Advised], listed: bool, overnight: list[str]) -> list[str]:
    """The answers for each loop, and every night with advised settings."""
    advised = [a for a in found if a.error is not None]
    harmful = [a for a in advised if a.is_harmful]
    worst = max((a.error for a in advised if a.error is not None), default=1.0)
    most = max((a.travel for a in advised if a.travel is not None), default=1.0)
    lines = [
        f"## {title}",
        "",
        f"{len(advised)} pairs of settings advised in {len(found)} loops and nights, {len(harmful)} of them harmful "
        f"(error or stem travel of the true loop more than 5 % larger). Largest error {100 * (worst - 1):+.0f} %, "
        f"largest travel {100 * (most - 1):+.0f} %.",
        "",
        *wrong(found, listed),
        "| loop | truth | nights before the 9th | the 9th and after |",
        "|---|---|---|---|",
    ]
    truth = {loop.tag: loop for loop in MILL}
    for tag in dict.fromkeys(a.loop for a in found):
        mine = [a for a in found if a.loop == tag]
        parts = [[a for a in mine if (a.night < "03-09") is early] for early in (True, False)]
        lines.append(f"| {tag} | {truth[tag].cause} | {_answers(parts[0])} | {_answers(parts[1])} |")
    lines += [
        "",
        "| night | loop | cause | error under new settings % | stem travel % |",
        "|---|---|---|---|---|",
    ]
    for a in advised:
        change = (
            f"{100 * (a.error - 1):+.0f} | {100 * (a.travel - 1):+.0f}" if a.error and a.travel else " | "
        )
        lines.append(f"| {a.night} | {a.loop} | {a.row['cause']} | {change} |")
    return [*lines, "", "| night | reported change | truth |", "|---|---|---|", *overnight, ""]


def _answers(found: list[Advised]) -> str:
    """The answers for a loop over some nights, the most frequent first."""
    cases = Counter(f"{a.row['cause'] or a.row['status']}: {a.row['action'] or '–'}" for a in found)
    return "; ".join(f"{text} ({n})" for text, n in cases.most_common())


def main() -> None:
    """Run all nights and write the page."""
    jobs = command_line(__doc__, jobs=2).jobs
    about = (__doc__ or "").split("\n\n")[1].replace("\n", " ").replace(" Writes nights.md here.", "")
    lines = [
        "# Two weeks of nights: advice and truth",
        "",
        "`python -m proofs.nights`",
        "",
        about,
        "",
    ]
    for title, changes in (("loops.csv alone", ()), ("changes.csv", read_changes(SAMPLE / "changes.csv"))):
        overnight: list[str] = []
        found = list(nights(jobs, changes, overnight))
        lines += section(f"With {title}", found, bool(changes), overnight)
    text = "\n".join(lines).rstrip() + "\n"
    OUT.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
