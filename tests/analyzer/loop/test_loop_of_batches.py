"""Loops of a batch with a set point that follows a programme, in manual between batches or not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from analyzer.loop.assess import assess
from analyzer.loop.record.quality import Prepared, prepare
from identification.models import Pid
from proofs.plant import CONFIG, START_S, run, series, spec, wander

PERIOD_S, EVERY_S, HOURS = 3600, 15, 20
KEPT = slice(None, None, EVERY_S)


@dataclass(frozen=True)
class Batch:
    """Process of a loop (K, T [s], L [s]), Kp, Ti [s] and backlash [% OP]; whether it is in manual between
    batches.
    """

    process: tuple[float, float, float]
    kp: float
    ti: float
    backlash: float = 0.0
    manual: bool = False


def drawn(seed: int, manual: bool) -> Batch:
    """A loop without fault: SIMC settings with a closed-loop time constant of one and a half dead times."""
    rng = np.random.default_rng(seed)
    late, lag, gain = rng.uniform(5, 40), rng.uniform(60, 400), rng.uniform(0.8, 2.5)
    return Batch((gain, lag, late), lag / (gain * 2.5 * (late + 1)), min(lag, 10 * late), manual=manual)


def prepared(loop: Batch, seed: int) -> Prepared:
    """Twenty batches of an hour: SP rises on a ramp, is constant and falls at once.

    Between batches the controller stays active, or is in manual with OP at its lower limit.
    """
    rng = np.random.default_rng(seed + 100)
    n = HOURS * 3600
    phase = (np.arange(n) + int(rng.integers(PERIOD_S))) % PERIOD_S
    batch = phase < rng.uniform(1800, 2700)
    sp = 30.0 + np.where(batch, np.minimum(phase / rng.uniform(60, 600), 1.0) * rng.uniform(15, 35), 0.0)
    manual = ~batch & loop.manual
    push = np.where(manual & ~np.concatenate(([False], manual[:-1])), -60.0, 0.0)
    load, noise = wander(rng, n, 0.3, 1800.0), 0.1 * rng.standard_normal(n)
    own = (np.full(n, loop.kp), np.full(n, loop.ti), push, manual)
    pv, op, _ = run(sp, load, noise, *own, 30.0, (loop.backlash, 0.0, 0.0), loop.process)
    stamp = START_S + np.arange(n, dtype=float)[KEPT]
    mode = np.where(manual, 0.0, 1.0)
    trends = {"SP": sp, "PV": pv, "OP": op, "MODE": mode}
    found = {f"L.{role}": series(stamp, x[KEPT]) for role, x in trends.items()}
    return prepare(replace(spec("L"), mode="L.MODE"), found, CONFIG.quality)


@pytest.mark.parametrize("manual", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_the_corners_of_a_programme_are_no_oscillation(seed, manual):
    """A loop without fault whose set point follows a programme of an hour does not oscillate and is not too tight."""
    loop = drawn(seed, manual)
    found = assess(prepared(loop, seed), Pid(loop.kp, loop.ti, scan_s=1.0), CONFIG)
    first = found.oscillations.first
    assert first is None or first.oscillating_pct < 50.0
    assert found.verdict.cause != "tuning"


@pytest.mark.parametrize("seed", range(3))
def test_a_limit_cycle_under_a_programme_is_reported(seed):
    """A valve whose backlash causes a cycle between the corners of the programme is found as the cause."""
    loop = Batch((12.0, 150.0, 6.0), 0.65, 30.0, backlash=2.5)
    found = assess(prepared(loop, seed), Pid(loop.kp, loop.ti, scan_s=1.0), CONFIG)
    assert found.oscillations.first.oscillating_pct > 50.0
    assert found.verdict.cause == "valve"


def test_a_limit_in_manual_is_no_time_at_a_limit():
    """OP at its limit in manual between batches is no time at a limit of the controller."""
    found = assess(prepared(drawn(0, True), 0), None, CONFIG)
    assert found.night.at_limits_pct < 5.0
    assert found.verdict.measured is None or found.verdict.measured.saturated < 0.05
