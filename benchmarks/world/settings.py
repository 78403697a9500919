"""Advice applied: new settings are set in the true plant under the same load: python -m benchmarks.world.settings
--seed 1. With --grid the loops that some settings would improve are counted too. With --nights 2 the loop is recorded
with its new settings on another day, and the next advice is applied too."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from benchmarks.world.__main__ import night_rows
from benchmarks.world.draw import Drawn, drawn, run
from benchmarks.world.recorder import recorded
from benchmarks.world.simulate import Controller, sensitivity
from proofs.common import command_line, table


def outcome(d: Drawn, new: Controller, day: int = 0) -> tuple[float, float, float, float]:
    """Error and stem travel relative to those before, on a day with the same kind of load, and maximum sensitivity
    before and after, all [-]."""
    old, ours = (run(d, day, settings=c, alike=True) for c in (d.controller, new))
    error = [float(np.mean(np.abs(t.pv - t.sp))) for t in (old, ours)]
    travel = [float(np.abs(np.diff(t.stem)).sum()) for t in (old, ours)]
    return error[1] / error[0], travel[1] / max(travel[0], 1e-9), d.ms, sensitivity(d.process, new)[0]


GAINS, TIMES, MOST_MS = np.geomspace(0.15, 12.0, 14), np.geomspace(0.3, 12.0, 12), 2.0
"""Settings of the grid relative to the present ones, and its largest permitted sensitivity [-]."""


def reachable(d: Drawn) -> bool:
    """Whether robust settings of a grid improve the loop on its true plant."""
    for k, t in product(GAINS, TIMES):
        new = replace(d.controller, kp=d.controller.kp * float(k), ti_s=d.controller.ti_s * float(t))
        if sensitivity(d.process, new)[0] > MOST_MS:
            continue
        if verdict(*outcome(d, new)[:2], d.kind) == "improved":
            return True
    return False


def verdict(error: float, travel: float, kind: str = "") -> str:
    """Improved, better, none or harm. Improved: travel or error falls by 30 % and neither rises by 15 %. For a
    sluggish loop, whose valve has to move more, only the error counts."""
    travel = error if kind == "sluggish" else travel
    if max(error, travel) > 1.15:
        return "harm"
    return "improved" if min(error, travel) <= 0.7 else "better" if min(error, travel) <= 0.95 else "none"


def line(d: Drawn, row: dict[str, Any], found: tuple[float, ...] | None) -> str:
    """The advice and its effect."""
    c, p = d.controller, d.process
    process = f"K {p.gain:.3g} T {p.lag_s:.0f}+{p.second_s:.0f} L {p.dead_s:.0f}"
    what = f"{d.name} {process} Kp {c.kp:.3g} Ti {c.ti_s:.0f} Ms {d.ms:.1f}"
    if found is None:
        return f"{what}: {row['cause']} {row['action']} {row['reason']} | {row['advice']}"
    error, travel, _, ms = found
    new = f"new {row['kp_new']:.3g} {row['ti_new']:.0f}"
    return f"{what}: {new} error {error:.2f} travel {travel:.2f} Ms {ms:.2f} {verdict(error, travel, d.kind)}"


def advised(
    loops: list[Drawn], way: str, nights: int, jobs: int
) -> list[tuple[Drawn, dict[str, Any], Controller]]:
    """Each loop, its last row with settings or its first one, and its controller after `nights` nights of advice."""
    last_rows, typed = {}, {d.name: d.controller for d in loops}
    for night in range(nights):
        now = [replace(d, controller=typed[d.name]) for d in loops]
        rows = night_rows(now, {d.name: recorded(run(d, night, alike=True), way, d.seed) for d in now}, jobs)
        for d in now:
            row = rows[d.name]
            if row["kp_new"] is not None:
                typed[d.name] = replace(d.controller, kp=row["kp_new"], ti_s=row["ti_new"])
            if night == 0 or row["kp_new"] is not None:
                last_rows[d.name] = row
    return [(d, last_rows[d.name], typed[d.name]) for d in loops]


def main() -> None:
    """Draw, record, assess, set the new settings, count."""
    options = command_line(
        __doc__, seed=[1], each=8, way="plain", jobs=2, kinds=["tight"], show=False, grid=False, nights=1
    )
    rows, n = [], options.each * len(options.seed)
    for kind in options.kinds:
        found: list[tuple[float, ...]] = []
        possible = 0
        for seed in options.seed:
            loops = drawn(seed, options.each, (kind,))
            possible += sum(reachable(d) for d in loops) if options.grid else 0
            for d, row, new in advised(loops, options.way, options.nights, options.jobs):
                came = None if new == d.controller else outcome(d, new)
                found += [] if came is None else [came]
                if options.show:
                    print(line(d, row, came), file=sys.stderr)
        verdicts = [verdict(e, t, kind) for e, t, *_ in found]
        a = np.array(found).reshape(-1, 4)
        middle = [f"{100 * (np.median(a[:, k]) - 1):+.0f}" if found else "" for k in (0, 1)]
        worst = f"{100 * (a[:, 0].max() - 1):+.0f}" if found else ""
        ms = f"{a[:, 3].max():.2f}" if found else ""
        counts = (verdicts.count("improved"), possible if options.grid else "", verdicts.count("harm"))
        rows.append((kind, n, len(found), *counts, *middle, worst, ms))
    heads = (
        "kind|loops|new settings|improved|a grid improves|harm|error, median %|stem travel, median %|"
        "worst error %|largest Ms"
    )
    print(table(heads, rows, True))


if __name__ == "__main__":
    main()
