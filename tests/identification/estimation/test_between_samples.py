"""OP between two rows of a record: width of a backlash recorded slowly, on plants of another simulator."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.identification.measure import Measured, measure
from analyzer.loop.oscillation.detection import counting, detect
from benchmarks.world.draw import Drawn, run
from benchmarks.world.recorder import recorded
from benchmarks.world.simulate import BACKLASH, Controller, Process, Valve
from identification.estimation.between_samples import (
    LoopAtScan,
    Rows,
    Scans,
    _stepped,
    op_at_scans,
    scans_per_row,
    without_noise,
)
from identification.estimation.model import start_at
from identification.estimation.problem import in_blocks
from identification.models import Pid
from identification.record import LoopRecord
from identification.simulation.lag import unit_lag
from identification.simulation.pi import per_scan
from identification.simulation.valve import IDEAL, sticking


def with_backlash(process: Process, controller: Controller, width: float, seed: int) -> Drawn:
    """A loop whose valve has backlash."""
    return Drawn("T", "backlash", process, controller, Valve(BACKLASH, width), seed, 0.0, 0.0, 1.0, 0.0)


BACKLASH_LOOPS = (
    with_backlash(Process(1.2, 150.0, 0.0, 15.0), Controller(3.5, 40.0), 3.0, 24),
    with_backlash(Process(2.0, 90.0, 0.0, 8.0), Controller(2.2, 40.0), 2.0, 31),
    with_backlash(Process(0.8, 300.0, 0.0, 20.0), Controller(6.0, 90.0), 4.0, 32),
)


def measured(d: Drawn, every: int, scan_s: float) -> Measured:
    """The measurements from sixteen hours of a loop. The record keeps one row in `every`, and the scan is
    stated."""
    r = recorded(run(d, hours=16), f"every {every} s", 1)
    bad = np.zeros(r["pv"].size, dtype=bool)
    record = LoopRecord("T", 0.0, d.controller.scan_s * every, r["sp"], r["pv"], r["op"], bad)
    found = counting(detect(record, Config().oscillation))
    pid = Pid(d.controller.kp, d.controller.ti_s, scan_s=scan_s)
    return measure(record, found, pid, Config().cause)


@pytest.mark.parametrize("drawn", BACKLASH_LOOPS, ids=lambda d: f"{d.valve.band} %")
def test_a_width_recorded_every_ten_seconds_is_that_of_the_valve(drawn: Drawn) -> None:
    """With one row in ten of a controller that scans every second, the backlash is recovered within 15 %."""
    m = measured(drawn, 10, 1.0)
    assert m.problem.blocks.steps == 10
    assert m.backlash.valve.stickband == pytest.approx(drawn.valve.band, rel=0.15)


def test_a_controller_no_faster_than_its_record_holds_op_between_rows() -> None:
    """If a controller scans every ten seconds but a scan of one second is stated, the fit that holds OP between
    rows is likelier. Its width is that of the valve within 15 %."""
    d = replace(BACKLASH_LOOPS[0], controller=replace(BACKLASH_LOOPS[0].controller, scan_s=10.0))
    m = measured(d, 1, 1.0)
    assert m.problem.blocks.steps == 1
    assert m.backlash.valve.stickband == pytest.approx(d.valve.band, rel=0.15)


def rows_of(n: int = 400) -> Rows:
    """A slowly varying PV with noise, and OP of its controller."""
    rng = np.random.default_rng(3)
    pv = 50.0 + np.cumsum(0.1 * rng.standard_normal(n)) + 0.2 * rng.standard_normal(n)
    op = 50.0 - 2.0 * (pv - pv.mean()) + np.cumsum(0.05 * (50.0 - pv))
    return Rows(pv, np.full(n, 50.0), op)


def test_op_is_the_recorded_one_at_each_row() -> None:
    """Every path of OP passes through the recorded values, and between rows the paths differ by opposite noise."""
    rows = rows_of()
    problem = in_blocks(rows.pv, rows.op, np.ones(rows.pv.size, dtype=bool), 10.0)
    fit = start_at(problem, 1.0, (80.0, 12.0), sticking(1.0, 0.0), np.zeros(8))
    paths = op_at_scans(fit, Scans(rows, Pid(2.0, 60.0), 10))
    assert np.array_equal(paths[:, ::10], np.broadcast_to(rows.op, (len(paths), rows.op.size)))
    assert np.ptp(paths[:, 5::10], axis=0).min() > 0.0


def test_no_row_is_used_before_its_time() -> None:
    """A change of one row does not change any OP before this row."""
    rows = rows_of()
    loop = LoopAtScan(per_scan(Pid(2.0, 60.0), 1.0), IDEAL, unit_lag(80.0, 12.0, 1.0), 1.0)
    noise = np.random.default_rng(1).standard_normal((rows.pv.size, 10))
    other = Rows(rows.pv + 5.0 * (np.arange(rows.pv.size) == 200), rows.sp, rows.op)
    before, after = (_stepped(r, loop, (0.3, 0.0), noise)[0] for r in (rows, other))
    assert np.array_equal(before[:200], after[:200])
    assert not np.array_equal(before[200:], after[200:])


def test_noise_is_removed_from_a_random_walk() -> None:
    """The smoother removes more than 80 % of the variance of white noise that is five times as large as the
    steps of a random walk. The mean of the two filters of the optimal smoother is better than each of them
    (Kalman; theory gives a gain of 0.18)."""
    rng = np.random.default_rng(5)
    walk = np.cumsum(0.2 * rng.standard_normal(4000))
    seen = walk + rng.standard_normal(walk.size)
    assert np.mean((without_noise(seen) - walk)[50:-50] ** 2) < 0.2


def test_scans_are_counted_where_the_controller_is_faster() -> None:
    """A row of 10 s has ten scans of 1 s, and one scan for a scan of 10 s, an unknown controller and a
    continuous one."""
    counts = [
        scans_per_row(x, 10.0) for x in (Pid(1.0, 9.0), Pid(1.0, 9.0, scan_s=10.0), None, Pid(1, 9, scan_s=0))
    ]
    assert counts == [10, 1, 1, 1]
    assert math.isfinite(sum(counts))
