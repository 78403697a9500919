"""Proof: where nothing was changed, at most 5 % of the figures are called better or worse.

200 plants of one loop each run for two weeks with constant controller settings. The valves have no fault, backlash,
or stick-slip. Disturbances are white noise, slow loads, drifts of the load and of its strength over hours to weeks,
days and nights, sinusoids, and set point moves. Nothing changes in the middle, but the two weeks are compared.

    python -m proofs.honesty --plants 200 --jobs 2
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter
from scipy.stats import ttest_ind

from analyzer.comparison.before_after import LoopComparison, compare
from analyzer.comparison.measures import MEASURES, ChangeVerdict, gridded, spans_around
from analyzer.config import Config
from analyzer.loop.oscillation.detection import detect
from analyzer.loop.oscillation.figures import hourly
from identification.models import Backlash, Fopdt, Loop, Pid, Stiction
from identification.record import LoopRecord
from identification.simulation.closed_loop import closed_loop
from proofs.common import parser_of

SCAN_S = 5.0
DAYS = 14
DAY = int(86400 / SCAN_S)
N = DAYS * DAY
START_S = 1772409600.0
MOST_SHARE = 0.05


def wander(rng: np.random.Generator, hours: float, n: int = N, step_s: float = SCAN_S) -> np.ndarray:
    """First-order autoregressive noise of unit variance and a correlation time in hours, shape (n,)."""
    pole = np.exp(-step_s / (3600 * hours))
    first = rng.normal()
    pushes = rng.normal(size=n) * np.sqrt(1 - pole * pole)
    return lfilter([1.0], [1.0, -pole], pushes, zi=[pole * first])[0]


def loads(rng: np.random.Generator) -> np.ndarray:
    """Load plus noise as it adds to PV [%]; its level and strength drift over hours to weeks."""
    strength = np.exp(rng.uniform(0, 0.4) * wander(rng, np.exp(rng.uniform(np.log(2), np.log(200)))))
    fast = rng.uniform(0.1, 0.6) * wander(rng, np.exp(rng.uniform(np.log(0.02), np.log(0.3))))
    slow = rng.uniform(0.0, 4.0) * wander(rng, np.exp(rng.uniform(np.log(3), np.log(200))))
    daily = rng.uniform(0, 1.5) * np.sin(2 * np.pi * (np.arange(N) / DAY + rng.uniform()))
    daily_strength = 1 + rng.uniform(0, 0.5) * np.sin(2 * np.pi * (np.arange(N) / DAY + rng.uniform()))
    sine = rng.uniform(0.3, 1) * np.sin(2 * np.pi * np.arange(N) * SCAN_S / rng.uniform(300, 1500))
    noise = rng.uniform(0.02, 0.2) * rng.normal(size=N)
    return strength * daily_strength * fast + slow + daily + (rng.uniform() < 0.2) * sine + noise


def set_points(rng: np.random.Generator) -> np.ndarray:
    """A constant set point, or one that an operator moves several times a day [%]."""
    moves = (rng.uniform(size=N) < rng.uniform(0, 4) / DAY) * rng.normal(size=N)
    return 50.0 + np.clip(np.cumsum(moves) * (rng.uniform() < 0.5), -4, 4)


def simulated(seed: int) -> LoopRecord:
    """Two weeks of one loop in which nothing is changed."""
    rng = np.random.default_rng(seed)
    dead, ratio = rng.uniform(5, 30), np.exp(rng.uniform(np.log(2), np.log(100)))
    gain = rng.uniform(0.8, 2.5) * max(ratio / 10, 1.0)
    kp = rng.uniform(0.5, 1.3) * ratio / (gain * 2.5)
    ti = rng.uniform(0.5, 2.0) * min(ratio * dead, 10 * dead)
    valve = rng.choice(4)
    width = rng.uniform(0.3, 4.0)
    fault = (
        None if valve < 2 else Backlash(width) if valve == 2 else Stiction(width, rng.uniform(0.3, 1) * width)
    )
    loop = Loop(Fopdt(gain, ratio * dead, dead), Pid(kp, ti, scan_s=SCAN_S), fault)
    return replace(closed_loop(loop, set_points(rng), loads(rng), start_s=START_S), position=None)


def hours_of(record: LoopRecord) -> dict[str, np.ndarray]:
    """The rows that a store would hold, by night."""
    rows: list[dict[str, float | None]] = []
    for day in range(DAYS):
        night = record.span(day * DAY, (day + 1) * DAY)
        for h in hourly(night, detect(night, Config().oscillation), Config().figures):
            found = {
                "oscillation_significance": h.oscillation_significance,
                "oscillating_pct": h.oscillating_pct,
            }
            rows.append({"hour_s": h.start_s, **found, **h.figures.as_row()})
    return {k: np.array([r[k] for r in rows], dtype=float) for k in rows[0]}


def examine(seed: int) -> tuple[LoopComparison, list[bool]]:
    """The comparison of the two weeks of a plant, and the result of a t-test over hours as a contrast."""
    hours = hours_of(simulated(seed))
    before, after = spans_around(START_S + DAYS / 2 * 86400.0, DAYS / 2)
    naive = []
    for m in (m for m in MEASURES if m.primary):
        a, b = (gridded(hours, s, m.name).value for s in (before, after))
        naive.append(
            bool(ttest_ind(a, b, equal_var=False).pvalue < 0.05) if np.ptp(a) + np.ptp(b) > 0 else False
        )
    return compare(str(seed), hours, before, after), naive


def called(found: LoopComparison, name: str) -> bool | None:
    """Whether a figure was called better or worse; None where it was not compared."""
    changes = [
        c for c in found.changes if c.measure.name == name and c.verdict is not ChangeVerdict.INCOMPARABLE
    ]
    return changes[0].verdict is not ChangeVerdict.UNCLEAR if changes else None


def counted(all_found: list[LoopComparison], naive: list[list[bool]]) -> tuple[list[str], float, float]:
    """Lines of the result, and the shares of changes and of loops that were called."""
    lines, calls = [], []
    for i, m in enumerate(MEASURES):
        answers = [a for a in (called(f, m.name) for f in all_found) if a is not None]
        naive_share = f"{100 * np.mean([n[i] for n in naive]):5.1f} %" if m.primary else ""
        lines.append(
            f"{m.name:28} {sum(answers):4d} of {len(answers):4d}  {100 * np.mean(answers):5.1f} %  {naive_share}"
        )
        calls += answers if m.primary else []
    compared = [f for f in all_found if not f.reasons]
    loops = [any(called(f, m.name) for m in MEASURES if m.primary) for f in compared]
    lines.append(
        f"{'any of the four, by loop':28} {sum(loops):4d} of {len(loops):4d}  {100 * np.mean(loops):5.1f} %"
    )
    reasons = sorted({r.split(":")[0] for f in all_found for r in f.reasons})
    lines.append(f"not compared: {len(all_found) - len(compared)} ({', '.join(reasons) or 'none'})")
    return lines, float(np.mean(calls)), float(np.mean(loops))


def examined(plants: int, jobs: int, first: int = 0) -> Iterator[tuple[LoopComparison, list[bool]]]:
    """All plants, examined in `jobs` processes."""
    seeds = range(first, first + plants)
    if jobs == 1:
        yield from map(examine, seeds)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(examine, seeds, chunksize=4)


def main() -> None:
    """Print how many figures are called better or worse; exit with 1 where the share is above 5 %."""
    parser = parser_of(__doc__, plants=200, jobs=2)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    options = parser.parse_args()
    pairs = list(examined(options.plants, options.jobs, options.first))
    lines, share, loops = counted([p[0] for p in pairs], [p[1] for p in pairs])
    print(f"{options.plants} plants, seeds from {options.first}, nothing changed; called better or worse:")
    print(f"{'':28} {'here':>20}  t-test over hours")
    print("\n".join(lines))
    good = max(share, loops) <= MOST_SHARE
    print(f"{100 * share:.1f} % of the four assessments, {100 * loops:.1f} % of loops; at most 5 %: {good}")
    raise SystemExit(0 if good else 1)


if __name__ == "__main__":
    main()
