"""Plants drawn by seed, with their truths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np

from proofs.coupled import faults, loops, response, trends
from proofs.coupled.faults import Bench
from proofs.coupled.kernel import simulate
from proofs.coupled.measure import period, spread
from proofs.coupled.spread import Tree, Web
from proofs.coupled.truth import showing, truths

STEPS = (2.0, 5.0, 10.0)
"""Scans [s]."""
LOOPS = (30, 300)
"""Loops of a plant."""
HOURS = (6.0, 24.0)
"""Length of a record [h]."""
SOURCES = 5
"""Most sources of a plant; also at most one for each eight loops."""
VALUES = 6_000_000
"""Most values (loops times scans) where the length is drawn, to fit in memory."""
WARM = 5400.0
"""Simulated time before the record [s]."""
ATTEMPTS = 8
"""Number of plants drawn until one has a source and a follower."""
NEAR = 0.8
"""Share of plants with independent oscillations of nearly a source's period."""
WITHIN = (0.01, 0.1)
"""Relative difference of those periods; the smaller one with this share:"""
NEARER = 0.4
STRANGERS = 0.04
"""Most independent oscillations of other periods, relative to the number of loops."""
GRIDS = (0.01, 0.02, 0.05)
"""Resolutions of the historian [%]."""
LEVEL_WORN = 0.75
"""Share of faults with backlash that are at levels."""
MASTERS = 0.35
"""Share of tight tunings that are at masters."""
START = datetime(2026, 3, 2)


@dataclass(frozen=True)
class Recorded:
    """A loop as recorded: SP, PV and OP [%] at stamp_s [s] from the plant's start, dt [s] apart.

    The controller is op = kp (e + integral(e) / ti), e = SP - PV, ti in seconds; master: its name or ""; all ranges 0
    to 100.
    """

    name: str
    kind: str
    area: str
    master: str
    stamp_s: np.ndarray
    dt: float
    sp: np.ndarray
    pv: np.ndarray
    op: np.ndarray
    kp: float
    ti: float


@dataclass(frozen=True)
class Drawn:
    """A plant: its scan [s], start, loops, and the truth by loop name."""

    step_s: float
    start: datetime
    loops: tuple[Recorded, ...]
    truth: dict[str, dict[str, Any]]


def _bench(rng: np.random.Generator, n: int, step: float, scans: int) -> tuple[Bench, list[loops.Tag]]:
    """A plant without faults, on which faults are tested."""
    plant, tags = loops.drawn(rng, n, step)
    natural = np.array([response.natural(plant, i) for i in range(n)])
    warm = round(WARM / step)
    drive = trends.drawn(rng, plant, natural, scans + warm)
    ran = simulate(plant, drive)
    calm = spread((ran.sp - ran.pv)[warm:])
    return Bench(plant, plant, drive, natural, calm, warm, {}), tags


def _place(rng: np.random.Generator, bench: Bench, tags: list[loops.Tag], cause: str) -> int:
    """A loop for a fault; -1 where none is suitable."""
    may = [i for i in range(bench.without_fault.size) if faults.fitting(bench, i, cause)]
    may = [
        i
        for i in may
        if not {int(bench.without_fault.master[i]), int(bench.without_fault.slave[i])} & set(bench.faults)
    ]
    if cause == "backlash" and rng.random() < LEVEL_WORN:
        may = [i for i in may if tags[i].kind == "level"] or may
    if cause == "tuning" and rng.random() < MASTERS:
        may = [i for i in may if bench.without_fault.slave[i] >= 0] or may
    return int(rng.choice(may)) if may else -1


def _fault(rng: np.random.Generator, bench: Bench, tags: list[loops.Tag]) -> int:
    """Add a visible fault to some loop; returns its place, -1 where no fault was possible."""
    for _ in range(4):
        cause = str(rng.choice(faults.CAUSES, p=faults.SHARES))
        i = _place(rng, bench, tags, cause)
        if i >= 0 and faults.add(rng, bench, i, cause):
            return i
    return -1


def _lone(bench: Bench, i: int, fed: set[int]) -> bool:
    return i not in fed and bench.without_fault.master[i] < 0 and bench.without_fault.slave[i] < 0


def _unrelated(
    rng: np.random.Generator, bench: Bench, periods: dict[int, float], fed: set[int]
) -> dict[int, int]:
    """Loops with independent oscillations, with the source whose period they nearly have, or -1.

    periods: of the sources [s]; fed: loops that are coupled already.
    """
    out, n = {}, bench.without_fault.size
    for _ in range(int(rng.integers(1, min(6, n // 8) + 1)) if rng.random() < NEAR else 0):
        source = int(rng.choice(list(periods)))
        cycle = periods[source]
        within = WITHIN[0] if rng.random() < NEARER else WITHIN[1]
        for _ in range(5):
            cause = str(rng.choice(["stiction", "tuning", "load"], p=(0.6, 0.28, 0.12)))
            may = [i for i in range(n) if faults.fitting(bench, i, cause) and _lone(bench, i, fed)]
            if not may:
                break
            far = np.abs(np.log(bench.natural[may, 0] / cycle))
            i = int(rng.choice(np.array(may)[np.argsort(far)[: max(n // 4, 5)]]))
            if faults.add_matched(rng, bench, i, cause, cycle, within):
                out[i] = source
                break
    for _ in range(int(rng.integers(0, round(n * STRANGERS) + 1))):
        cause = str(rng.choice(faults.CAUSES, p=faults.SHARES))
        may = [i for i in range(n) if faults.fitting(bench, i, cause) and _lone(bench, i, fed)]
        i = int(rng.choice(may)) if may else -1
        if i >= 0 and faults.add(rng, bench, i, cause):
            out[i] = -1
    return out


def _web(rng: np.random.Generator, bench: Bench, tags: list[loops.Tag], sources: list[int]) -> Web:
    """Couple the sources to their followers."""
    web = Web(rng, bench, [t.area for t in tags])
    for i in sources:
        depth = {i: 0}
        depth |= {int(x[i]): 1 for x in (bench.without_fault.master, bench.without_fault.slave) if x[i] >= 0}
        web.trees.append(Tree(i, bench.faults[i][1].period_s, depth))
    for tree in web.trees:
        web.grow(tree)
        web.recycle(tree)
    return web


def _recorded(rng: np.random.Generator, bench: Bench, tags: list[loops.Tag]) -> list[Recorded]:
    """The values that the historian records."""
    p, out = bench.faulty, []
    ran = simulate(p, bench.trends)
    stamp = np.arange(ran.pv.shape[0] - bench.warm) * p.step
    for i, tag in enumerate(tags):
        grids = (0.01, *rng.choice(GRIDS, 2))
        kept = (
            np.round(x[bench.warm :, i] / g) * g for x, g in zip((ran.sp, ran.pv, ran.op), grids, strict=True)
        )
        master = tags[int(p.master[i])].name if p.master[i] >= 0 else ""
        known = (float(p.kp[i]), float(p.ti[i]))
        out.append(Recorded(tag.name, tag.kind, tag.area, master, stamp, p.step, *kept, *known))
    return out


def _attempt(
    rng: np.random.Generator, n: int, sources: int, hours: float | None, step: float
) -> Drawn | None:
    """A plant; None where no source remained or none has a follower."""
    most = max(min(HOURS[1], VALUES * step / 3600 / n), HOURS[0])
    scans = round((hours or rng.uniform(HOURS[0], most)) * 3600 / step)
    bench, tags = _bench(rng, n, step, scans)
    begun = [i for i in (_fault(rng, bench, tags) for _ in range(sources)) if i >= 0]
    if not begun:
        return None
    web = _web(rng, bench, tags, begun)
    pv = showing(bench, begun)[0]
    if not begun:
        return None
    periods = {i: period(pv[:, i]) * step for i in begun}
    own = _unrelated(rng, bench, periods, web.fed())
    web.quiet(set(own))
    known = truths(bench, [t.name for t in tags], begun, own)
    roles = [x["role"] for x in known.values()]
    if "source" not in roles or "follower" not in roles:
        return None
    out = sorted(_recorded(rng, bench, tags), key=lambda x: x.name)
    return Drawn(step, START, tuple(out), {x.name: known[x.name] for x in out})


def draw(
    seed: int,
    loops: int | None = None,
    sources: int | None = None,
    hours: float | None = None,
    step_s: float | None = None,
) -> Drawn:
    """One plant; values that are not given are drawn."""
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([2007, seed, attempt])
        n = loops or round(trends.log_uniform(rng, *LOOPS))
        many = sources or int(rng.integers(1, max(min(SOURCES, n // 8), 1) + 1))
        drawn = _attempt(rng, n, many, hours, step_s or float(rng.choice(STEPS)))
        if drawn is not None:
            return drawn
    raise RuntimeError(f"seed {seed}: no plant in {ATTEMPTS} attempts had a source and a follower")


def clock_off(drawn: Drawn, seconds: float, names: set[str]) -> Drawn:
    """The plant with the stamps of some loops late by `seconds`."""
    some = (replace(x, stamp_s=x.stamp_s + seconds) if x.name in names else x for x in drawn.loops)
    return replace(drawn, loops=tuple(some))


def thinned(drawn: Drawn, factor: int, names: set[str]) -> Drawn:
    """The plant with every `factor`-th sample of some loops."""
    out = []
    for x in drawn.loops:
        kept = {k: getattr(x, k)[::factor] for k in ("stamp_s", "sp", "pv", "op")}
        out.append(replace(x, dt=x.dt * factor, **kept) if x.name in names else x)
    return replace(drawn, loops=tuple(out))


def stamps(drawn: Drawn, recorded: Recorded) -> np.ndarray:
    """Times of a loop's samples."""
    begin = np.datetime64(drawn.start, "ms")
    return begin + np.round(1000 * recorded.stamp_s).astype("timedelta64[ms]")
