"""A backlash that is too small to drive a cycle by its describing function is reported if each OP reversal shows it.

The loops are simulated here with an integrating process, a backlash and a PI law, without code of the estimators.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analyzer import api
from analyzer.loop.assess import Assessment
from analyzer.loop.record.quality import prepare
from analyzer.night.chunk import assess_loop
from proofs.plant import CONFIG, START_S, series, spec

HOURS = 5


def tank(rate: float, kp: float, ti: float, half: float, load: np.ndarray, seed: int) -> Assessment:
    """A tank of that rate [% PV a second per % OP] with a backlash of twice `half`, assessed with known settings."""
    n = HOURS * 3600
    rng = np.random.default_rng(seed)
    noise = 0.05 * rng.normal(size=n)
    pv, op = np.empty(n), np.empty(n)
    y, stem, total, late = 52.0, 50.0, 50.0, np.full(6, 50.0)
    for k in range(n):
        pv[k] = y + noise[k]
        e = 50.0 - pv[k]
        total += kp * e / ti
        op[k] = kp * e + total
        stem = min(max(stem, op[k] - half), op[k] + half)
        late[k % 6] = stem
        y += rate * (late[(k + 1) % 6] - 50.0 + load[k])
    stamp = START_S + np.arange(n, dtype=float)
    values = {"L.SP": np.full(n, 50.0), "L.PV": pv.round(3), "L.OP": op.round(3)}
    stated, trends = spec(kp=kp, ti=ti), {k: series(stamp, v) for k, v in values.items()}
    found, _ = assess_loop(stated, prepare(stated, trends, CONFIG.quality), CONFIG, advising=False)
    return found


def wandering(seed: int) -> np.ndarray:
    """A load that drifts over five minutes [% OP]."""
    x = np.random.default_rng(100 + seed).normal(size=HOURS * 3600 + 299)
    return 0.3 * np.convolve(x, np.ones(300) / 40.0, "valid")


@pytest.mark.parametrize(
    ("rate", "kp", "ti", "half"), [(0.01, 0.8, 25.0, 2.0), (0.005, 1.0, 40.0, 2.0), (0.02, 0.3, 40.0, 3.0)]
)
def test_little_damping_gives_a_cycle_with_a_small_backlash(
    rate: float, kp: float, ti: float, half: float
) -> None:
    """Under PI with Kp k Ti of 0.2, a backlash of a quarter of the range of OP drives the cycle and is the cause."""
    found = tank(rate, kp, ti, half, wandering(0), 0)
    assert found.verdict.measured is not None
    assert found.verdict.measured.size < CONFIG.cause.size
    assert (found.verdict.cause, found.verdict.fault) == ("valve", "backlash")


@pytest.mark.parametrize("seed", range(4))
def test_a_load_on_a_worn_valve_does_not_give_the_valve_as_cause(seed: int) -> None:
    """An external sine in a loop whose valve has backlash does not give the valve as the cause."""
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.5, 1.5)
    period = rng.uniform(200, 600)
    sine = half * rng.uniform(2, 5) * np.sin(2 * np.pi * np.arange(HOURS * 3600) / period)
    found = tank(0.012, 0.6, 400.0, half, wandering(seed) + sine, seed)
    assert found.oscillations.first is not None
    assert found.verdict.cause != "valve"


LEVEL = Path(__file__).parents[3].parent / "shared" / "inputs" / "p-only-level-repair-valve"


@pytest.mark.skipif(not LEVEL.is_dir(), reason="needs the recorded inputs beside the repository")
def test_a_backlash_wider_than_op_of_a_steady_loop_is_not_reported() -> None:
    """A P-only level without fault whose set point kicks OP gets no backlash wider than the usual range of OP."""
    record = api.read(LEVEL / "export.parquet", loops=LEVEL / "loops.csv").loop("TIC25")
    found = api.assess(record).verdict
    assert found.require_measured.size > 1.0
    assert (found.cause, found.fault) == ("none", "none")
