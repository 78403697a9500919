"""Compile all kernels once, so that the first night is as fast as the second: python -m analyzer.night.warm_up

Kernels are stored next to the code,
or in numba's cache directory if that is not writable; an installation for many
users runs this as its last step.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from analyzer.night.chunk import assess_loop
from identification.models import Backlash, Fopdt, Loop, Pid, Stiction
from identification.simulation.closed_loop import closed_loop
from identification.simulation.lag import first_order

LOOPS = (
    Loop(Fopdt(1.5, 20.0, 4.0), Pid(1.2, 18.0)),
    Loop(Fopdt(40.0, 1200.0, 8.0), Pid(0.8, 100.0), Backlash(0.8)),
    Loop(Fopdt(1.2, 8.0, 3.0), Pid(0.4, 20.0), Stiction(4.0, 3.0)),
)
"""A flow under an oscillating load, a level behind backlash, a flow behind a sticking valve."""


def simulated_series(loop: Loop, seed: int) -> dict[str, Series]:
    """Three hours of a loop at 1 s, as in an export."""
    rng, n = np.random.default_rng(seed), 10_800
    swing = 2.0 * np.sin(2 * np.pi * np.arange(n) / 600.0) if loop.valve is None else np.zeros(n)
    wander = 30.0 * first_order(rng.normal(0.0, 1.0, n), 1000.0)
    made = closed_loop(loop, np.zeros(n), swing + wander + rng.normal(0.0, 0.05, n))
    trends = {"SP": np.full(n, 50.0), "PV": 50.0 + made.pv, "OP": made.op}
    stamp, good = np.arange(n, dtype=np.float64) + 1.7e9, np.zeros(n, dtype=bool)
    return {f"L.{role}": Series(stamp, x, good) for role, x in trends.items()}


def compile_all() -> None:
    """Assess a loop of each kind, with advice."""
    begun, config = time.monotonic(), Config()
    for seed, loop in enumerate(LOOPS):
        kp, ti = loop.controller.kp, loop.controller.ti_s
        stated = LoopSpec("L", sp="L.SP", pv="L.PV", op="L.OP", pv_lo=0.0, pv_hi=100.0, kp=kp, ti=ti)
        prepared = prepare(stated, simulated_series(loop, seed), config.quality)
        assess_loop(stated, prepared, config)
    print(f"kernels are ready after {time.monotonic() - begun:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    compile_all()
