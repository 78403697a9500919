"""One loop of the sealed generator. Its set point moves about every 150 s under a load and noise."""

from __future__ import annotations

import numpy as np

from identification.mismatch.recording import Recording
from proofs.concealed.plant import Drive, Pi, Plant, close_loop, idle

N, SCAN = 4500, 1.0
PLANT = Plant(K=1.1, T=25.0, L=4.0, v0=48.0, y0=52.0)
PI = Pi(kp=1.2, ti=30.0)


def recording(plant: Plant, seed: int, **acting: np.ndarray) -> Recording:
    """The loop's recording. `acting` replaces signals of an undisturbed loop (Drive), each of shape (N,)."""
    rng = np.random.default_rng(seed)
    moves = np.repeat(rng.uniform(-6.0, 6.0, N // 150 + 1), 150)[:N]
    load = np.empty(N)
    load[0] = 0.0
    for k, shock in enumerate(rng.normal(0.0, 0.05, N - 1)):
        load[k + 1] = 0.995 * load[k] + shock
    still = idle(N, plant)
    kept = {f: getattr(still, f) for f in ("pre", "late", "force", "op_hi", "helper", "act", "supply")}
    drive = Drive(**{**kept, **acting}, sp=plant.y0 + moves, load=load, post=rng.normal(0.0, 0.03, N))
    pv, op = close_loop(plant, PI, drive, SCAN)
    return Recording(drive.sp, pv, op, np.ones(N, dtype=bool), SCAN, SCAN * np.arange(N))
