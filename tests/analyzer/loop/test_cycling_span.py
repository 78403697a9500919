"""A cycle of some hours is found and assessed in these hours, independently of the rest of the day."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.assess import assess
from analyzer.loop.oscillation.cycling_span import detect_where_it_cycles
from analyzer.loop.record.quality import Prepared, Scale
from identification.models import Pid
from identification.record import LoopRecord

LIMITS = Config().oscillation
DT_S = 30.0
PER_H = int(3600 / DT_S)
CONTROLLER = Pid(0.6, 40.0, scan_s=DT_S)


def day(hours: int, backlash: float, seed: int = 5, begins: int = 0) -> LoopRecord:
    """A day of a lag of 200 s under PI, whose valve has backlash [% of OP] for some hours.

    These hours begin with a step of PV; noise and a slow load act all day.
    """
    rng, n = np.random.default_rng(seed), 24 * PER_H
    noise, load = rng.normal(0.0, 0.05, n), np.cumsum(rng.normal(0.0, 0.01, n))
    pv, op = np.zeros(n), np.zeros(n)
    y, stem, total = 0.0, 0.0, 0.0
    for k in range(n):
        worn = begins * PER_H <= k < (begins + hours) * PER_H
        half = 0.5 * backlash if worn else 0.0
        y += 2.0 * (backlash > 0.0 and k == begins * PER_H)
        if k > 0:
            stem = min(max(stem, op[k - 1] - half), op[k - 1] + half)
            y += (2.0 * stem + load[k] - y) * (1.0 - np.exp(-DT_S / 200.0))
        pv[k] = y + noise[k]
        total += CONTROLLER.kp * DT_S / CONTROLLER.ti_s * -pv[k]
        op[k] = -CONTROLLER.kp * pv[k] + total
    return LoopRecord("L", 0.0, DT_S, np.full(n, 50.0), 50.0 + pv, 50.0 + op, np.zeros(n, bool))


@pytest.mark.parametrize("begins", [0, 6, 14])
def test_the_share_of_a_cycle_is_that_of_its_hours(begins: int) -> None:
    """A valve with backlash for nine hours of a day makes its loop oscillate for 37.5 % of the time, at any start
    hour.
    """
    found, span = detect_where_it_cycles(day(9, 4.0, begins=begins), LIMITS)
    assert found.first is not None
    assert found.first.oscillating_pct == pytest.approx(37.5, abs=9.0)
    first, last = span
    assert (last - first) / PER_H == pytest.approx(9.0, abs=2.5)
    assert first / PER_H == pytest.approx(begins, abs=2.5)


def test_quiet_hours_leave_the_cause_as_it_is() -> None:
    """The valve fault is named from nine hours of its cycle within a day as from these hours alone."""
    whole = day(9, 4.0)
    for record in (whole, whole.span(0, 9 * PER_H)):
        found = assess(Prepared(record, Scale(0, 100, 0, 100, False), 0, 0, ()), CONTROLLER, Config())
        assert (found.verdict.cause, found.verdict.fault) == ("valve", "backlash")


@pytest.mark.parametrize("seed", range(12))
def test_a_day_of_noise_and_drift_has_no_cycling_hours(seed: int) -> None:
    """A day of a valve without fault under a slow load and noise has no hours that are taken for a cycle."""
    found, span = detect_where_it_cycles(day(0, 0.0, seed), LIMITS)
    assert found.first is None
    assert span == (0, 24 * PER_H)


def test_a_loud_hour_of_noise_is_no_cycle() -> None:
    """Hours in which the noise is ten times as large are no cycle: a cycle must also be regular."""
    for seed in range(6):
        rng, n = np.random.default_rng(seed), 24 * PER_H
        x = rng.normal(0.0, 0.05, n)
        x[6 * PER_H : 14 * PER_H] *= 10.0
        pv = np.convolve(x, np.ones(8) / 8, mode="same")
        record = LoopRecord("L", 0.0, DT_S, np.zeros(n), pv, np.cumsum(-0.1 * pv), np.zeros(n, bool))
        assert detect_where_it_cycles(record, LIMITS)[0].first is None
