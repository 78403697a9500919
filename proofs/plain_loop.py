"""Is the misfit of the baseline loop that `explain` shows the smallest possible? python -m proofs.plain_loop [FOLDER
...]

The loops are simulated (a closed PI loop with large set point steps, an OP at its limit, a slow drift, or steps in
manual; 200 of each), and every recording of the folders is added. A lag with dead time, a constant and an initial
value of PV is fitted to PV by least squares in free run. This code is independent of the package's fit and uses
twelve starting points over all time scales. The table gives the misfit of the baseline loop over that of the best of
these; the ratio should never exceed 1.05. A time constant longer than a quarter of a record is not a settling
process. Writes proofs/plain_loop.md.
"""

from __future__ import annotations

from functools import partial
from multiprocessing import Pool
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter

from analyzer import api
from analyzer.explain.case import case, tags_of
from analyzer.explain.explained import explained
from identification.errors import NotAssessedError
from identification.mismatch.baseline import inputs_of, prepared
from identification.mismatch.proof import HeldOut, held_out
from identification.mismatch.recording import Recording
from identification.record import Floats
from proofs.common import command_line, publish, table

KINDS = ("set-point steps", "OP at its limit", "slow drift", "steps in manual")
N = 2000


def simulated(kind: str, seed: int) -> Recording:
    """A lag with dead time of random constants under a PI controller or in manual, computed sample by sample."""
    rng = np.random.default_rng(seed)
    gain, lag, dead = rng.uniform(0.3, 3.0), 10.0 ** rng.uniform(0.5, 2.3), int(rng.integers(1, 30))
    kp, ti = 0.4 * lag / (gain * (dead + 0.3 * lag)), max(lag, 4.0)
    sp = 50.0 + np.repeat(rng.uniform(-20, 20, N // 400 + 1), 400)[:N]
    drift = np.cumsum(rng.normal(0, 0.05, N)) if kind == "slow drift" else np.zeros(N)
    noise = rng.normal(0, 0.2, N)
    hand = np.repeat(rng.uniform(30, 70, N // 250 + 1), 250)[:N]
    top = 65.0 if kind == "OP at its limit" else 100.0
    pv, total, pipe = 50.0, 50.0, [50.0] * dead
    seen, op = np.empty(N), np.empty(N)
    for k in range(N):
        seen[k] = pv + drift[k] + noise[k]
        e = sp[k] - seen[k]
        total = min(max(total + kp * e / ti, 0.0), top)
        op[k] = hand[k] if kind == "steps in manual" else min(max(total + kp * e, 0.0), top)
        pipe.append(op[k])
        pv += (50.0 + gain * (pipe.pop(0) - 50.0) - pv) / lag
    stamp = np.arange(N, dtype=np.float64)
    return Recording(None, seen, op, np.ones(N, dtype=bool), 1.0, stamp)


def rested(x: Floats, window: int) -> Floats:
    """x minus its mean, or minus a straight line in each window, as on the page."""
    if window <= 0 or window >= x.size:
        return x - x.mean()
    parts = np.array_split(np.arange(x.size), x.size // window)
    return np.concatenate([x[i] - np.polyval(np.polyfit(i - i[0], x[i], 1), i - i[0]) for i in parts])


def response(op: Floats, lag: float, dead: float) -> Floats:
    """PV behind a lag of unit gain [samples], at rest before."""
    k = np.arange(op.size)
    pole = np.exp(-1.0 / lag)
    return lfilter([0.0, 1.0 - pole], [1.0, -pole], np.interp(k - dead, k, op) - op[0])


def least_squares(pv: Floats, op: Floats, window: int) -> float:
    """Smallest rms residual in free run of a lag with dead time, gain, constant and initial value [% PV]."""
    aim = rested(pv, window)

    def residual(z: Floats) -> float:
        lag, dead = float(np.exp(np.clip(z[0], -1.0, np.log(pv.size / 4)))), min(abs(z[1]), 0.2 * pv.size)
        faded = np.exp(-np.arange(op.size) / lag)
        x = np.stack([rested(response(op, lag, dead), window), rested(faded, window)])
        return float(np.std(aim - np.linalg.lstsq(x.T, aim, rcond=None)[0] @ x))

    starts = [(t, d) for t in np.geomspace(2.0, pv.size / 6, 6) for d in (0.0, min(0.5 * t, 0.05 * pv.size))]
    tops = [[[np.log(t), d], [np.log(t) + 0.5, d], [np.log(t), d + max(0.2 * t, 1.0)]] for t, d in starts]
    found = [minimize(residual, s[0], method="Nelder-Mead", options={"initial_simplex": s}).fun for s in tops]
    return float(min(found))


def ratio(proof: HeldOut, pv: Floats, op: Floats) -> float:
    """Misfit of the baseline loop shown over that of the best fit here."""
    return float(proof.overall[0].rmse / least_squares(pv, op, proof.window))


def of_simulated(kind: str, seed: int) -> float:
    """The ratio for one simulated loop."""
    s = simulated(kind, seed)
    inputs = inputs_of(s)
    p, fit = prepared(inputs, s.pv - inputs.level, s.usable)
    return ratio(held_out(p, fit, fit), s.pv, s.op)


def of_recording(path: Path) -> tuple[str, float | None]:
    """The ratio for one recording; None where it cannot be explained."""
    loops = path.parent / "loops.csv"
    plant = api.read(path, loops=loops if loops.exists() else None)
    spec = next((s for s in plant.specs if s.loop == path.stem), plant.specs[0])
    try:
        c = case(spec, plant.specs, plant.export.read(tags_of(spec, plant.specs)), plant.config)
        e = explained(c, lambda _: None)
    except NotAssessedError:
        return path.stem, None
    return path.stem, ratio(e.found.proven, c.recording.pv, c.recording.op)


def summary(name: str, ratios: list[float]) -> list[str]:
    """One row of the table."""
    over = sum(r > 1.05 for r in ratios)
    return [name, str(len(ratios)), f"{np.median(ratios):.3f}", f"{max(ratios):.3f}", str(over)]


def main() -> None:
    """Compute all ratios, write the table."""
    a = command_line(__doc__, folders="*", loops=200, seed=5000, jobs=2)
    rows = []
    with Pool(a.jobs) as pool:
        for kind in KINDS:
            seeds = range(a.seed, a.seed + a.loops)
            rows.append(summary(kind, pool.map(partial(of_simulated, kind), seeds)))
        each = []
        for folder in a.folders:
            found = pool.map(of_recording, sorted(folder.glob("*.parquet")), chunksize=1)
            each += [(name, r) for name, r in found if r is not None]
            rows.append(summary(folder.name, [r for _, r in found if r is not None]))
    text = table("loops | how many | median ratio | largest | over 1.05", rows)
    wide = "\n".join(f"- {name}: {r:.3f}" for name, r in each if r > 1.05)
    title = "The baseline loop shown and a least-squares lag with dead time"
    publish(__file__, title, f"Seed {a.seed}.", text, *([wide] if wide else []))


if __name__ == "__main__":
    main()
