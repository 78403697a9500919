"""Beliefs over nine nights compared with each night alone: python -m proofs.many_nights [--seed 971 972] [--jobs 2]

Each plant has 26 loops and nine nights of twelve hours, with new load and noise each night. The faults are half as
large as needed for a clear cycle. The physics is that of the sample mill, which shares no code with the estimators.
The table counts named causes and actions that change from one night to the next. It shows the integral time advised
from the third night on, and causes that are right on the first and on the last night. It also counts valves that are
blamed without a fault. Writes many_nights.md here, with the reported answers and the answers of each night alone.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.decisions import Action, Cause, Fault
from analyzer.loops.spec import LoopSpec
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.store.store import Store
from identification.record import Floats
from proofs.common import command, command_line, publish, table
from proofs.plant import SAMPLE_DATA, START_S, Trends, spec, write_export

if str(SAMPLE_DATA) not in sys.path:
    sys.path.append(str(SAMPLE_DATA))

from physics import run, swing, wander

OUT = Path(__file__).with_suffix(".md")
LOOPS, NIGHTS, HOURS, EVERY_S = 26, 9, 12, 2
WARM_S = 3600
"""Time before each night that is not recorded, so that the oscillation is fully developed [s]."""
KINDS, KIND_SHARES = ("flow", "pressure", "temperature", "level"), (0.3, 0.2, 0.25, 0.25)
CAUSES, CAUSE_SHARES = ("backlash", "stiction", "tuning", "load", "healthy"), (0.3, 0.15, 0.12, 0.13, 0.3)
RIGHT = {"backlash": Cause.VALVE, "stiction": Cause.VALVE, "tuning": Cause.TUNING, "load": Cause.LOAD}
NAMED = (Cause.VALVE, Cause.TUNING, Cause.LOAD)
WORN = (Fault.BACKLASH, Fault.STICTION)
COLUMNS = ("loop", "cause", "valve_fault", "action", "ti_new", "status")
SETTLED = 2
"""Night, counted from 0, from which on advice should not change."""


@dataclass(frozen=True)
class Drawn:
    """A loop of a plant and its fault; seconds, percent of spans."""

    tag: str
    kind: str
    cause: str
    process: tuple[float, float, float]
    kp: float
    ti: float
    noise: float
    load: float
    moves: float
    backlash: float = 0.0
    stickband: float = 0.0
    slip_jump: float = 0.0
    sine: float = 0.0
    sine_s: float = 300.0

    @property
    def is_worn(self) -> bool:
        """Whether its valve is worn."""
        return self.cause in WORN


def draw(rng: np.random.Generator, number: int) -> Drawn:
    """One loop of a plant."""
    kind = str(rng.choice(KINDS, p=KIND_SHARES))
    cause = str(rng.choice(CAUSES, p=CAUSE_SHARES))
    process, noise = _process(rng, kind)
    kp, ti = _settings(rng, kind, cause, process)
    more: dict[str, float] = {}
    if cause == "backlash":
        more["backlash"] = rng.uniform(0.5, 1.5)
    elif cause == "stiction":
        more["stickband"] = rng.uniform(0.8, 1.6)
        more["slip_jump"] = more["stickband"] * rng.uniform(0.3, 0.9)
    elif cause == "load":
        _, t, dead = process
        period = rng.uniform(400, 1500) if kind == "level" else rng.uniform(6, 15) * (t + dead)
        more |= {"sine": rng.uniform(0.5, 1.2), "sine_s": float(np.clip(period, 60, 2000))}
    load, moves = rng.uniform(0.3, 1.2), float(rng.choice([0, 0, 1.0, 2.0]))
    return Drawn(
        f"{kind[0].upper()}IC{1000 + number}", kind, cause, process, kp, ti, noise, load, moves, **more
    )


def _process(rng: np.random.Generator, kind: str) -> tuple[tuple[float, float, float], float]:
    """Gain, time constant and dead time [s] of a type of loop, and its noise [% PV]."""
    ranges = {
        "flow": ((0.7, 1.5), (4, 20), (1, 5), (0.1, 0.3)),
        "pressure": ((0.8, 1.8), (20, 120), (2, 15), (0.06, 0.2)),
        "temperature": ((0.8, 2.2), (150, 700), (10, 50), (0.02, 0.06)),
        "level": ((25, 70), (900, 2000), (4, 12), (0.05, 0.15)),
    }
    gain, t, dead, noise = (float(rng.uniform(*ends)) for ends in ranges[kind])
    return (gain, t, dead), noise


def _settings(
    rng: np.random.Generator, kind: str, cause: str, process: tuple[float, float, float]
) -> tuple[float, float]:
    """Settings of a loop: by SIMC for most; the others have settings with which a faulty valve or a tight tuning
    cycles."""
    gain, t, dead = process
    slow = rng.uniform(1.0, 3.0) * dead
    kp, ti = t / (gain * (slow + dead)), min(t, 4 * (slow + dead))
    if kind == "level":
        kp, ti = rng.uniform(0.4, 1.2), rng.uniform(150, 900)
    if cause == "backlash":
        level = rng.uniform(0.5, 1.0), rng.uniform(40, 120)
        return level if kind == "level" else (1.3 * kp, rng.uniform(0.25, 0.5) * ti)
    if cause == "stiction" and kind == "flow":
        return rng.uniform(0.2, 0.5) / gain, rng.uniform(1, 4) * t
    if cause == "tuning":
        ti = max(0.6 * ti, 2 * dead)
        return rng.uniform(0.93, 1.02) * _ultimate(process, ti), ti
    return kp, ti


def _ultimate(process: tuple[float, float, float], ti: float) -> float:
    """Gain at the stability limit of a PI loop."""
    gain, t, dead = process
    s = 1j * np.logspace(-4, 1, 4000)
    response = gain / (1 + s * t) * np.exp(-s * dead) * (1 + 1 / (s * ti))
    at = int(np.argmin(np.abs(np.unwrap(np.angle(response)) + np.pi)))
    return float(1 / abs(response[at]))


def simulated(loop: Drawn, seed: Sequence[int]) -> Trends:
    """One night of a loop, one value every EVERY_S seconds."""
    n, rng = HOURS * 3600 + WARM_S, np.random.default_rng(list(seed))
    sp = np.full(n, 50.0)
    for at in rng.integers(0, n, 3):
        sp[at:] += loop.moves * rng.choice([-1, 1])
    load = wander(rng, n, loop.load, rng.uniform(0.5, 4) * 3600) + wander(rng, n, 0.3 * loop.load, 300.0)
    if loop.sine:
        load += swing(rng, n, loop.sine, loop.sine_s)
    friction = 0.5 * (loop.stickband + loop.slip_jump), 0.5 * (loop.stickband - loop.slip_jump)
    noise = loop.noise * rng.standard_normal(n)
    fixed = np.full(n, loop.kp), np.full(n, loop.ti), np.zeros(n), np.zeros(n, dtype=bool)
    pv, op, stem = run(sp, load, noise, *fixed, 50.0, (loop.backlash, *friction), loop.process)
    return Trends(*(_recorded(x) for x in (sp, pv, op, stem)))


def _recorded(x: Floats) -> Floats:
    return np.asarray(np.round(x[WARM_S::EVERY_S], 3))


def nights_of(seed: int, jobs: int) -> tuple[list[Drawn], Store, tempfile.TemporaryDirectory[str]]:
    """A plant whose nights are run one after another into one store."""
    rng = np.random.default_rng(seed)
    plant = [draw(rng, k) for k in range(LOOPS)]
    folder = tempfile.TemporaryDirectory()
    store = Store(Path(folder.name) / "store")
    stated: list[LoopSpec] = [spec(d.tag, d.kind, kp=d.kp, ti=d.ti, scan_s=1.0) for d in plant]
    for night in range(NIGHTS):
        trends = {d.tag: simulated(d, (seed, night, k)) for k, d in enumerate(plant)}
        first = START_S + night * 86400.0
        path = write_export(Path(folder.name) / "night.parquet", trends, first, float(EVERY_S))
        batch.run(Plant(open_export([path]), stated, Config()), store, jobs)
    return plant, store, folder


@dataclass
class Counts:
    """Counts over plants: loops, pairs of nights, changes of the cause, changes of a named cause, changes of the
    action, causes right on the first and on the last night, nights in which a valve without a fault is blamed, nights
    with advice for a loop without a fault, and largest over smallest integral time of each loop."""

    loops: int = 0
    pairs: int = 0
    cause: int = 0
    named: int = 0
    action: int = 0
    first: int = 0
    last: int = 0
    blamed: int = 0
    advised: int = 0
    ratios: tuple[float, ...] = ()

    def add(self, loop: Drawn, rows: Sequence[Mapping[str, Any]]) -> None:
        """Count the nights of one loop, oldest first."""
        causes, actions = [r["cause"] for r in rows], [r["action"] for r in rows]
        right = RIGHT.get(loop.cause, Cause.NONE)
        self.loops += 1
        self.pairs += len(rows) - 1
        self.cause += sum(a != b for a, b in pairwise(causes))
        self.named += sum(a != b for a, b in pairwise(causes) if a in NAMED)
        self.action += sum(a != b for a, b in pairwise(actions))
        self.first += causes[0] == right
        self.last += causes[-1] == right
        if not loop.is_worn:
            self.blamed += sum(r["valve_fault"] in WORN or r["action"] == Action.REPAIR_VALVE for r in rows)
        if loop.cause == "healthy":
            self.advised += sum(a in (Action.RETUNE, Action.REPAIR_VALVE) for a in actions)
        times = [abs(r["ti_new"]) for r in rows[SETTLED:] if r["ti_new"]]
        if len(times) > 1:
            self.ratios = (*self.ratios, max(times) / min(times))

    def cells(self, name: str) -> tuple[str, ...]:
        """A row of the table."""
        ratios = np.array(self.ratios or (1.0,))
        shares = (f"{100 * x / self.pairs:.1f}" for x in (self.cause, self.named, self.action))
        counted = (self.first, self.last, self.blamed, self.advised)
        return (name, *shares, f"{np.median(ratios):.2f}", f"{ratios.max():.2f}", *map(str, counted))


@dataclass
class Sides:
    """Counts over plants of the reported answers and of the answers of each night alone; and the loops for which not
    all of them are right."""

    reported: Counts = field(default_factory=Counts)
    alone: Counts = field(default_factory=Counts)
    loops: list[tuple[str, ...]] = field(default_factory=list)

    def add(self, seed: int, plant: Sequence[Drawn], store: Store) -> None:
        """Count one plant."""
        over_nights, alone = (
            [_by_loop(read("nights", n, COLUMNS)) for n in store.nights()] for read in _readers(store)
        )
        for loop in plant:
            self.reported.add(loop, [n[loop.tag] for n in over_nights])
            self.alone.add(loop, [n[loop.tag] for n in alone])
            answers = [" ".join(str(n[loop.tag]["cause"]) for n in side) for side in (alone, over_nights)]
            if set(" ".join(answers).split()) != {RIGHT.get(loop.cause, Cause.NONE)}:
                self.loops.append((str(seed), loop.tag, loop.cause, *answers))


def _readers(store: Store) -> tuple[Callable[..., list[dict[str, Any]]], ...]:
    return store.rows, store.own_rows


def _by_loop(rows: Sequence[Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    return {r["loop"]: r for r in rows}


def main() -> None:
    """Run the plants and write the page."""
    given = command_line(__doc__, seed=[971, 972], jobs=2)
    found = Sides()
    for seed in given.seed:
        plant, store, folder = nights_of(seed, given.jobs)
        with folder:
            found.add(seed, plant, store)
        print(f"plant {seed} done", file=sys.stderr)
    about = (__doc__ or "").split("\n\n")[1].replace("\n", " ").split(" Writes many_nights.md")[0]
    heads = (
        "| cause changes % | of named ones % | action changes % | Ti ratio | worst | right first | right last "
        "| blamed | advised"
    )
    publish(
        __file__,
        "Beliefs over nine nights compared with each night alone",
        command(__file__, seed=given.seed),
        about,
        f"{found.reported.loops} loops. Changes are in percent of the pairs of nights, for any cause and for a named "
        "one (valve, tuning or load). Ti ratio is largest over smallest from the third night on, in the median and "
        "in the worst loop. Right are loops with the right cause on the first and on the last night. Blamed and "
        "advised are nights in which a valve without a fault is blamed, and in which a loop without a fault has "
        "advice.",
        table(heads, [found.reported.cells("reported"), found.alone.cells("each night alone")]),
        "Loops for which not every answer is right, of each night alone and over the nights:",
        table("plant | loop | truth | each night alone | reported", found.loops),
    )


if __name__ == "__main__":
    main()
