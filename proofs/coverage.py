"""Do the 90 % intervals contain the truth? python -m proofs.coverage [--loops 240] [--seed 1] [--jobs 2]

Loops of four types from proofs/concealed go through the nightly assessment. Their physics shares no code with
identification: fine steps, a third lag, dry friction with stem mass, imperfect controllers, historians that round. A
third has backlash and cycles, a third has stick-slip and cycles, a third has no fault and follows set point moves
under load. The table counts how often the reported interval contains the true value. Writes coverage.md here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from analyzer.config import AdviceLimits, QualityLimits
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.identification.intervals import intervals
from analyzer.loop.record.quality import prepare
from identification.errors import NotAssessedError
from identification.models import Estimate, Pid
from identification.record import Floats
from proofs.common import command, command_line, publish
from proofs.concealed.plant import Drive, Pi, Plant, close_loop
from proofs.concealed.scene import KINDS, Rng, draw_plant, load_path, noise_path, setpoints
from proofs.plant import CONFIG, START_S, series, spec

FAMILIES = ("play", "stick-slip", "set point moves")
SAMPLES = 9000
ATTEMPTS = 40


@dataclass(frozen=True)
class Made:
    """A loop, its recording, and its true constants by the names of the estimates."""

    family: str
    kind: str
    scan_s: float
    pi: Pi
    trends: Floats
    truth: dict[str, float]


@dataclass(frozen=True)
class Held:
    """One interval: whether it contains the truth, and the relative error of its midpoint."""

    family: str
    name: str
    inside: bool
    error: float


def controller(rng: Rng, p: Plant, family: str, scan: float) -> Pi:
    """A PI by internal model control; valve loops have a shorter integral time, with which they cycle."""
    wish = rng.uniform(1.0, 2.5) * (p.L + scan)
    kp = p.T / (p.K * (wish + p.L))
    if p.leak == 0.0:
        return Pi(min(kp, 8.0), rng.uniform(4.0, 7.0) * (wish + p.L), res=0.01)
    ti = min(p.T, 4.0 * (wish + p.L))
    return Pi(min(kp, 8.0), ti * (1.0 if family == FAMILIES[2] else rng.uniform(0.35, 0.7)), res=0.01)


def loop(rng: Rng, family: str) -> tuple[str, Plant]:
    """A plant of a random type; a level is integrating where its valve has a fault."""
    kind = str(rng.choice(list(KINDS)))
    plant = draw_plant(rng, kind)
    if family == FAMILIES[2]:
        return kind, plant
    width = rng.uniform(1.0, 4.0)
    jump = width * rng.uniform(0.3, 0.9)
    fault = {"gap": width}
    if family == FAMILIES[1]:
        fault = {"static": 0.5 * (width + jump), "sliding": 0.5 * (width - jump)}
    return kind, plant._replace(leak=0.0 if kind == "level" else 1.0, **fault)


def drive(rng: Rng, n: int, p: Plant, scan: float, family: str, settle: float) -> Drive:
    """Load, noise and, for loops without a fault, set point moves."""
    zero = np.zeros(n)
    moves = family == FAMILIES[2]
    sp = setpoints(rng, n, p.y0, settle, 7.0, 0.0) if moves else zero + p.y0
    load = load_path(rng, n, p, scan, rng.uniform(0.1, 0.3) if moves else rng.uniform(0.02, 0.1))
    post = noise_path(rng, n, rng.uniform(0.03, 0.1), rng.uniform(0.0, 0.3))
    return Drive(sp, load, zero + 1, zero, post, zero, zero + np.nan, zero + 100.0, zero, zero)


def made(family: str, seed: int) -> Made:
    """One loop of a family. A loop with a valve fault is drawn again until it cycles within the range of OP."""
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([seed, attempt, FAMILIES.index(family)])
        kind, plant = loop(rng, family)
        scan = KINDS[kind][0]
        pi = controller(rng, plant, family, scan)
        settle = 6 * (plant.T / (plant.K * pi.kp) + 2 * plant.L) / scan + 0.5 * pi.ti / scan
        d = drive(rng, SAMPLES, plant, scan, family, settle)
        pv, op = close_loop(plant, pi, d, scan)
        steps = float(rng.choice([0.01, 0.02])), float(rng.choice([0.01, 0.05]))
        trends = np.array([d.sp, np.round(pv / steps[0]) * steps[0], np.round(op / steps[1]) * steps[1]])
        if family == FAMILIES[2] or cycles(trends, plant):
            return Made(family, kind, scan, pi, trends, truth_of(plant, family))
    raise RuntimeError(f"{family} {seed}: none of {ATTEMPTS} loops cycles; widen the draw")


def cycles(trends: Floats, p: Plant) -> bool:
    """Whether PV keeps moving off the set point and OP stays within its range."""
    late = trends[:, SAMPLES // 2 :]
    width = p.gap + p.static + p.sliding
    return bool(
        np.isfinite(trends).all() and 1.1 * width < np.ptp(late[2]) < 50.0 and late[2].std() > 0.4 * width
    )


def truth_of(p: Plant, family: str) -> dict[str, float]:
    """True constants; the small third lag counts as dead time."""
    out = {"slope_pct_per_s": p.K / p.T, "dead_time_s": p.L + p.T3}
    if p.leak != 0.0:
        out |= {"gain": p.K, "time_constant_s": p.T}
    if family == FAMILIES[0]:
        out["backlash_pct"] = p.gap
    if family == FAMILIES[1]:
        out |= {"stickband_pct": p.static + p.sliding, "slip_jump_pct": p.static - p.sliding}
    return out


def assessed(m: Made) -> Assessment:
    """The loop as the nightly batch assesses it."""
    stamp = START_S + m.scan_s * np.arange(SAMPLES)
    found = {f"L.{role}": series(stamp, x) for role, x in zip(("SP", "PV", "OP"), m.trends, strict=True)}
    pid = Pid(m.pi.kp, m.pi.ti, scan_s=m.scan_s)
    return assess(prepare(spec("L", m.kind), found, QualityLimits()), pid, CONFIG, m.kind)


def held(case: tuple[str, int]) -> list[Held] | str:
    """Every interval reported for one loop, or the verdict under which this family has no intervals."""
    family, seed = case
    m = made(family, seed)
    try:
        verdict = assessed(m).verdict
    except NotAssessedError:
        return "not assessed"
    reported = f"{verdict.cause}, {verdict.fault}"
    wanted = {FAMILIES[0]: "valve, backlash", FAMILIES[1]: "valve, stiction", FAMILIES[2]: "none, none"}[
        family
    ]
    if reported != wanted or verdict.measured is None:
        return reported
    found = intervals(verdict.fit, family != FAMILIES[2], AdviceLimits(), verdict.measured.controller)
    return [compared(family, name, found[name], true) for name, true in m.truth.items() if name in found]


def compared(family: str, name: str, e: Estimate, true: float) -> Held:
    """One interval compared with the truth."""
    return Held(family, name, bool(e.low <= true <= e.high), abs(e.value / true - 1.0))


def table(results: Sequence[list[Held] | str], cases: Sequence[tuple[str, int]]) -> str:
    """Coverage and errors by family and constant, and the other verdicts."""
    every = [h for r in results if not isinstance(r, str) for h in r]
    lines = ["| loops | constant | intervals | contain the truth | median error |", "|---|---|---|---|---|"]
    for family in FAMILIES:
        for name in dict.fromkeys(h.name for h in every if h.family == family):
            mine = [h for h in every if (h.family, h.name) == (family, name)]
            lines.append(row(family, name, mine))
    lines.append(row("all", "all", every))
    lines += ["", "| loops | made | judged right | else |", "|---|---|---|---|"]
    for family in FAMILIES:
        mine = [r for r, (f, _) in zip(results, cases, strict=True) if f == family]
        other = [r for r in mine if isinstance(r, str)]
        shown = ", ".join(f"{other.count(o)} {o}" for o in dict.fromkeys(other))
        lines.append(f"| {family} | {len(mine)} | {len(mine) - len(other)} | {shown or '–'} |")
    return "\n".join(lines)


def row(family: str, name: str, mine: Sequence[Held]) -> str:
    """One line of the table."""
    share = 100 * np.mean([h.inside for h in mine])
    error = 100 * np.median([h.error for h in mine])
    return f"| {family} | {name} | {len(mine)} | {share:.0f} % | {error:.1f} % |"


def main() -> None:
    """Simulate and assess all loops, write the table next to this file."""
    options = command_line(__doc__, loops=240, seed=1, jobs=2)
    each = math.ceil(options.loops / len(FAMILIES))
    cases = [(family, options.seed * 100_000 + k) for family in FAMILIES for k in range(each)]
    with get_context("spawn").Pool(options.jobs) as pool:
        results = pool.map(held, cases, chunksize=4)
    shown = f"{command(__file__, loops=options.loops, seed=options.seed)}; intervals are of 90 %."
    publish(__file__, "Do intervals contain the truth?", shown, table(results, cases))


if __name__ == "__main__":
    main()
