"""Constants of an experiment against processes simulated in plain Python, and records without a response."""

from __future__ import annotations

import numpy as np
import pytest

from identification.errors import NotAssessedError
from identification.experiments.columns import Kind
from identification.experiments.find import Course, Experiment, in_automatic, in_manual
from identification.experiments.intervals import ninety
from identification.experiments.model import modelled, pooled, weighted_mean
from identification.record import LoopRecord
from proofs.step_test_plant import behind_backlash


def step_response(op, lags, dead, gain, dt=1.0, fine=20):
    """The response of a process by Euler steps of a twentieth of a sample."""
    u = np.repeat(op - op[0], fine)
    late = round(dead / dt * fine)
    x = np.concatenate((np.zeros(late), u))[: u.size]
    for lag in lags:
        y, at, a = np.empty(x.size), 0.0, dt / fine / lag
        for k, v in enumerate(x):
            y[k] = at
            at += a * (v - at)
        x = y
    return gain * x[::fine]


def record(pv, op, dt=1.0, sp=None):
    """A record without a controller, or with its SP."""
    n = pv.size
    return LoopRecord(
        "L", 0.0, dt, np.zeros(n) if sp is None else sp, pv, op, np.zeros(n, bool), sp_estimated=sp is None
    )


def moves(*levels, each=400):
    """OP at a sequence of levels."""
    return np.repeat(np.array(levels, float), each)


def whole(r, course=Course.STEPS):
    """All of a record as one experiment."""
    return Experiment(course, 0, len(r), 3, float(np.ptp(r.op)))


def test_a_move_between_two_samples_does_not_change_dead_time():
    """An OP move half a sample before the next sample changes the dead time by at most 1 s of 60 s."""
    fine = moves(40, 45, 38, 44, each=4000)
    op = np.concatenate((np.full(5, 40.0), fine))[: fine.size]  # a move 5 s before the next sample
    pv = (
        step_response(op, (100.0,), 60.0, 1.5, fine=2)
        + 50.0
        + 0.01 * np.random.default_rng(5).normal(size=op.size)
    )
    r = record(pv[::10], op[::10], dt=10.0)
    e = modelled(r, whole(r)).estimates["dead_time_s"]
    assert e.value == pytest.approx(60.0, abs=1.0)
    assert e.low < 56.0 < 64.0 < e.high  # the interval includes the unknown part of a sample


def test_ninety_per_cent_of_a_mixture():
    """One density gives the normal interval. For two separate densities, the median is in the heavier one and
    not between them."""
    one = ninety(np.ones(1), np.array([50.0]), np.array([4.0]))
    assert (one.low, one.value, one.high) == pytest.approx((50 - 6.58, 50.0, 50 + 6.58), abs=0.05)
    two = ninety(np.array([0.3, 0.7]), np.array([10.0, 100.0]), np.array([1.0, 1.0]))
    assert two.value == pytest.approx(100.0, abs=1.5)
    assert two.low < 12.0 < two.high


NOISE = np.random.default_rng(7).normal(size=8000)


def test_no_model_is_reported_where_pv_does_not_respond():
    """Noise alone, white or a random walk, gives no model although OP moves."""
    op = moves(40, 45, 38, 44)
    for noise in (NOISE[: op.size], np.cumsum(NOISE[: op.size])):
        with pytest.raises(NotAssessedError):
            modelled(record(50 + noise, op), whole(record(50 + noise, op)))


def test_an_on_off_controller_makes_no_experiment():
    """OP that switches when PV crosses two levels is the work of a controller, not a manual experiment."""
    pv, op, y, on = [], [], 50.0, 1.0
    for k in range(4000):
        on = 1.0 if y < 48 else 0.0 if y > 52 else on
        y += (20 + 60 * on - y) / 300.0
        pv.append(y + 0.01 * NOISE[k])
        op.append(100 * on)
    r = record(np.array(pv), np.array(op))
    assert in_manual(r, np.ones(len(r), bool)) == ()


def test_a_set_point_that_always_moves_is_no_experiment():
    """The set point of a slave loop moves with every sample and gives no experiment."""
    sp = 50 + np.cumsum(0.1 * NOISE[:2000])
    assert in_automatic(record(sp + 0.1 * NOISE[2000:4000], sp + 1, sp=sp)) == ()


@pytest.mark.parametrize("gain", [1.8, -0.6])
def test_a_lag_with_dead_time_is_recovered_within_its_intervals(gain):
    """For a lag of 60 s and 15 s dead time, gain is recovered within 3 %, lag within 10 % and dead time within
    2 s. The noise is a tenth of the response. The interval of the gain contains the true gain."""
    op = moves(40, 45, 38, 44)
    pv = 50 + step_response(op, [60.0], 15.0, gain) + 0.5 * abs(gain) * NOISE[: op.size]
    m = modelled(record(pv, op), whole(record(pv, op)))
    e = m.estimates
    assert e["gain"].value == pytest.approx(gain, rel=0.03)
    assert e["lags_s"].value == pytest.approx(60.0, rel=0.1)
    assert e["dead_time_s"].value == pytest.approx(15.0, abs=2.0)
    assert e["gain"].low <= gain <= e["gain"].high
    assert m.process.gain * gain > 0


def test_two_lags_are_distinguished_from_one():
    """Lags of 80 and 30 s with little noise are reported as two lags, with their sum within 5 %."""
    op = moves(40, 45, 38, each=800)
    pv = 50 + step_response(op, [80.0, 30.0], 10.0, 1.5) + 0.05 * NOISE[: op.size]
    m = modelled(record(pv, op), whole(record(pv, op)))
    assert m.kind is Kind.TWO_LAGS
    assert m.estimates["lags_s"].value == pytest.approx(110.0, rel=0.05)


def test_drift_is_distinguished_from_gain():
    """A drift of 2 % of PV per hour does not change the gain by more than 3 %, and is recovered within 5 %."""
    op = moves(40, 45, 38, 44, each=900)
    drift = 2.0 * np.arange(op.size) / 3600.0
    pv = 50 + step_response(op, [60.0], 15.0, 1.0) + drift + 0.1 * NOISE[: op.size]
    e = modelled(record(pv, op), whole(record(pv, op))).estimates
    assert e["gain"].value == pytest.approx(1.0, rel=0.03)
    assert e["drift_pct_per_h"].value == pytest.approx(2.0, rel=0.05)


def test_backlash_is_recovered_where_op_reverses_twice():
    """Backlash of 1.5 % under the moves 40, 45, 50, 44, 39, 45 is recovered within 25 %, and the gain within 5
    %."""
    op = moves(40, 45, 50, 44, 39, 45)
    stem = behind_backlash(op, 1.5, 0.5)
    pv = 50 + step_response(stem, [40.0], 8.0, 1.2) + 0.1 * NOISE[: op.size]
    e = modelled(record(pv, op), whole(record(pv, op))).estimates
    assert e["backlash_pct"].value == pytest.approx(1.5, rel=0.25)
    assert e["gain"].value == pytest.approx(1.2, rel=0.05)


def test_a_neighbour_moves_pv_by_its_own_op():
    """If PV also responds to a neighbour's OP, the loop's gain is recovered within 5 % and the neighbour's gain
    within 15 %."""
    op, other = moves(40, 45, 38, 44), np.repeat([50.0, 56, 49, 57, 50, 56, 50, 57], 200)
    pv = (
        50
        + step_response(op, [50.0], 10.0, 1.0)
        + step_response(other, [70.0], 0.0, 0.5)
        + 0.1 * NOISE[: op.size]
    )
    e = modelled(record(pv, op), whole(record(pv, op)), (other,)).estimates
    assert e["gain"].value == pytest.approx(1.0, rel=0.05)
    assert e["neighbour_0_gain"].value == pytest.approx(0.5, rel=0.15)


def test_a_single_outlier_is_left_out():
    """One PV outlier of 100 % and one OP outlier of 30 % are reported and change the gain by less than 1 %."""
    op = moves(40, 45, 38, 44)
    pv = 50 + step_response(op, [60.0], 15.0, 1.0) + 0.1 * NOISE[: op.size]
    clean = modelled(record(pv, op), whole(record(pv, op))).estimates
    with_outlier, spike = pv.copy(), op.copy()
    with_outlier[700] += 100.0
    spike[1000] += 30.0
    m = modelled(record(with_outlier, spike), whole(record(pv, op)))
    assert m.lone_pv == (700.0,)
    assert m.lone_op == (1000.0,)
    assert m.estimates["gain"].value == pytest.approx(clean["gain"].value, rel=0.01)


def warmed(kp=2.0, ti=400.0, gain=4.0, dt=1.0):
    """A cold heater of two lags under PI control, simulated by Euler steps of a tenth of a sample."""
    x1 = x2 = total = 0.0
    pv, op = [], []
    for k in range(2400):
        y = 30 + x2 + 0.02 * NOISE[k]
        e = 60.0 - y
        u = kp * (e + total / ti)
        held = min(max(u, 0.0), 100.0)
        total += e * dt if held == u else 0.0
        pv.append(y)
        op.append(held)
        for _ in range(10):
            x1 += 0.1 * dt * (gain * held - x1) / 200.0
            x2 += 0.1 * dt * (x1 - x2) / 20.0
    return np.array(pv), np.array(op), np.full(2400, 60.0)


def test_a_heater_that_warms_up_under_control_has_a_positive_gain():
    """From a warm-up under PI control, a positive gain and the sum of lags are recovered within 15 %, although
    OP falls while PV rises."""
    pv, op, sp = warmed()
    r = record(pv, op, sp=sp)
    (x,) = in_automatic(r)
    assert x.course is Course.WARM_UP
    e = modelled(r, x).estimates
    assert e["gain"].value == pytest.approx(4.0, rel=0.15)
    assert e["lags_s"].value == pytest.approx(220.0, rel=0.15)


def test_experiments_are_weighted_by_their_deviations():
    """Two numbers with deviations 1 and 3 are pooled with weights 9 to 1 if they agree. If they differ by more
    than that, the weights are nearly equal (DerSimonian, Laird 1986)."""
    mean, deviation, weights = weighted_mean([(10.0, 1.0), (10.5, 3.0)])
    assert weights == pytest.approx([0.9, 0.1])
    assert mean == pytest.approx(10.05)
    assert deviation == pytest.approx(np.sqrt(0.9))
    assert weighted_mean([(10.0, 1.0), (30.0, 1.2)])[2] == pytest.approx([0.5, 0.5], abs=0.01)


def test_several_experiments_make_one_model():
    """Two experiments with one process are pooled to a gain within 3 %, with weights that add up to one."""
    found = []
    for scale in (0.2, 1.0):
        op = moves(40, 45, 38, 44)
        pv = 50 + step_response(op, [60.0], 15.0, 1.0) + scale * NOISE[: op.size]
        found.append(modelled(record(pv, op), whole(record(pv, op))))
    p = pooled(found)
    assert sum(p.weights) == pytest.approx(1.0)
    assert p.weights[0] > p.weights[1]
    assert p.estimates["gain"].value == pytest.approx(1.0, rel=0.03)
