"""The truth of each loop, measured by simulation of the same plant without each fault."""

from __future__ import annotations

from typing import Any

import numpy as np

from proofs.coupled import faults
from proofs.coupled.faults import Bench
from proofs.coupled.kernel import Plant, simulate
from proofs.coupled.measure import period, returning, spread

FELT = 1.05
"""Least ratio of errors that is included in the truth."""
MOVED = 1.5
"""Largest change of a source's period when its loop is coupled, as a factor."""
FOLLOWS = 1.1
"""Least ratio of errors of a follower."""


def _errors(bench: Bench, plant: Plant) -> np.ndarray:
    ran = simulate(plant, bench.trends)
    return (ran.sp - ran.pv)[bench.warm :]


def showing(bench: Bench, sources: list[int]) -> tuple[np.ndarray, np.ndarray, dict[int, np.ndarray]]:
    """PVs, errors and ratios of errors by source; faults that are not visible in the coupled plant are removed from
    it."""
    while True:
        ran = simulate(bench.faulty, bench.trends)
        pv, e = ran.pv[bench.warm :], (ran.sp - ran.pv)[bench.warm :]
        own = spread(e)
        swells = {i: own / spread(_errors(bench, bench.without([i]))) for i in sources}
        dull = [i for i in sources if not _shows(bench, i, e[:, i], pv[:, i], float(swells[i][i]))]
        if not dull:
            return pv, e, swells
        bench.faulty = bench.without(dull)
        for i in dull:
            sources.remove(i)
            del bench.faults[i]


def _shows(bench: Bench, i: int, e: np.ndarray, pv: np.ndarray, swell: float) -> bool:
    cycle, (fault, shown) = period(pv), bench.faults[i]
    if swell < faults.SWELL or not faults.FINEST <= cycle <= pv.size / faults.CYCLES:
        return False
    kept = 1 / MOVED <= cycle * bench.without_fault.step / shown.period_s <= MOVED
    return kept and faults.cycling(e, cycle, float(spread(e)) / swell, fault.cause)


def truths(
    bench: Bench, names: list[str], sources: list[int], unrelated: dict[int, int]
) -> dict[str, dict[str, Any]]:
    """The truth by loop name; sources whose fault is not visible are removed from `sources`."""
    pv, e, swells = showing(bench, sources)
    own = spread(e) / spread(_errors(bench, bench.without(list(unrelated)))) if unrelated else spread(e)
    out, p = {}, bench.faulty
    for i, name in enumerate(names):
        roots = {names[s]: round(float(x[i]), 3) for s, x in swells.items() if x[i] > FELT}
        root, swell = max(roots.items(), key=lambda x: x[1], default=("", 1.0))
        role = "follower" if swell >= FOLLOWS else "healthy"
        root = root if swell >= FOLLOWS else ""
        if i in sources:
            role, root, swell = "source", name, roots[name]
        elif i in unrelated:
            role, root, swell = "unrelated", "", round(float(own[i]), 3)
        parents = {int(x) for x in p.link_from[p.link_to == i]} | {int(p.master[i]), int(p.slave[i])}
        oscillates = role in ("source", "unrelated")
        out[name] = {
            "role": role,
            "cause": bench.faults[i][0].cause if i in bench.faults else "none",
            "root": root,
            "swell": swell,
            "roots": roots,
            "period_s": round(period(pv[:, i]) * p.step, 3) if oscillates else 0.0,
            "rhythm": round(returning(e[:, i])[1], 3),
            "near": names[unrelated[i]] if unrelated.get(i, -1) >= 0 else "",
            "coupled_to": sorted(names[x] for x in parents if x >= 0),
        }
    return out
