"""The controller against closed forms and an implementation in absolute form."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from identification.models import ErrorForm, Fopdt, Integrator, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from identification.simulation.pi import next_op, per_scan
from tuning.frequency_response import controller_response, is_stable, maximum_sensitivity

WIDE = {"op_lo": -1e9, "op_hi": 1e9}


def outputs(c: Pid, sp: np.ndarray, pv: np.ndarray) -> np.ndarray:
    """OP of a controller in open loop, starting at 0."""
    law, seen = per_scan(c, c.scan_s), (0.0, sp[0], pv[0], 0.0)
    out = np.empty(sp.size)
    for k in range(sp.size):
        seen = next_op(seen, law, sp[k], pv[k])
        out[k] = seen[0]
    return out


def test_filtered_derivative_responds_to_a_ramp_as_in_theory():
    """On a ramp r of PV the derivative part is -kp Td r (1 - exp(-t N/Td)), the response of Td s/(1 + Td s/N)."""
    c = Pid(2.0, math.inf, 40.0, scan_s=0.01, td_filter=5.0, **WIDE)
    t = np.arange(2000) * 0.01
    pv = 0.3 * t
    op = outputs(c, np.zeros(t.size), pv) + 2.0 * pv
    assert op == pytest.approx(-2.0 * 40.0 * 0.3 * (1 - np.exp(-t * 5.0 / 40.0)), abs=0.05)


@pytest.mark.parametrize("td_filter", [3.0, 8.0, 0.0, math.inf])
@pytest.mark.parametrize("pv_filter_s", [0.0, 12.0])
def test_response_is_the_gain_of_a_simulated_sine(td_filter, pv_filter_s):
    """The response of the simulated controller to a sine of PV has the gain and phase of its frequency
    response, also with filters."""
    c = Pid(1.5, 80.0, 20.0, scan_s=1.0, td_filter=td_filter, pv_filter_s=pv_filter_s, **WIDE)
    omega = 2 * math.pi / 50
    k = np.arange(8000)
    op = outputs(c, np.zeros(k.size), np.sin(omega * k))[-4000:]
    fundamental = 2j * np.mean((op - op.mean()) * np.exp(-1j * omega * k[-4000:]))
    assert complex(-controller_response(c, np.array([omega]))[0]) == pytest.approx(fundamental, rel=2e-3)


def test_a_filter_of_pv_acts_as_a_lag():
    """At a small scan, the controller with a filter of PV agrees with scipy's PI after a lag within 0.02."""
    c = Pid(2.0, 30.0, scan_s=0.02, pv_filter_s=10.0, **WIDE)
    t = np.arange(5000) * 0.02
    pv = np.sin(0.2 * t)
    _, lagged, _ = lsim(([1.0], [10.0, 1.0]), pv, t)
    expected = -2.0 * (lagged + np.cumsum(lagged) * 0.02 / 30.0)
    assert outputs(c, np.zeros(t.size), pv) == pytest.approx(expected, abs=0.02)


def gapped(e: float, gap: float, gain: float) -> float:
    """The error after the gap, in plain Python."""
    if abs(e) <= gap:
        return gain * e
    return e - math.copysign((1 - gain) * gap, e)


@pytest.mark.parametrize(
    ("extra", "acting"),
    [
        ({"gap": 0.8}, lambda e: gapped(e, 0.8, 0.0)),
        ({"gap": 0.8, "gap_gain": 0.3}, lambda e: gapped(e, 0.8, 0.3)),
        ({"error_form": ErrorForm.SQUARED}, lambda e: e * abs(e) / 100),
        ({"sp_weight": 0.4}, lambda e: e),
    ],
)
def test_gap_square_and_weight_are_those_of_the_absolute_form(extra, acting):
    """The incremental controller equals kp s(e) + ki sum s(e), minus the part of the set-point weight, within
    rounding."""
    rng = np.random.default_rng(4)
    sp = np.repeat(rng.normal(size=40), 25)
    pv = np.cumsum(rng.normal(size=1000)) * 0.1
    c = replace(Pid(3.0, 60.0, scan_s=2.0, **WIDE), **extra)
    s = np.array([acting(e) for e in sp - pv])
    weighted = (1 - c.sp_weight) * (sp - sp[0])
    expected = 3.0 * (s - s[0] - weighted) + 3.0 * 2.0 / 60.0 * np.cumsum(s)
    assert outputs(c, sp, pv) == pytest.approx(expected, abs=1e-9)


def test_integral_alone_and_a_limit_of_rate():
    """Without gain, OP is 1/Ti times the sum of the error. A rate limit gives a ramp of this slope."""
    sp, pv = np.full(100, 5.0), np.zeros(100)
    assert outputs(Pid(0.0, 50.0, **WIDE), sp, pv)[-1] == pytest.approx(100 * 5.0 / 50.0)
    ramp = outputs(Pid(10.0, 50.0, scan_s=2.0, op_rate=0.05, **WIDE), sp, pv)
    assert np.diff(ramp) == pytest.approx(0.1)


def test_stability_with_filters_agrees_with_simulation():
    """The winding number and a simulated pulse agree on stability, with filters of PV and of the derivative."""
    rng = np.random.default_rng(8)
    compared = 0
    for _ in range(120):
        process = rng.choice([Fopdt(1.0, 30.0, rng.uniform(1, 12)), Integrator(1 / 30.0, rng.uniform(1, 12))])
        c = Pid(rng.uniform(0.5, 9.0), rng.uniform(20, 200), rng.uniform(0, 15), td_filter=rng.uniform(2, 10))
        loop = Loop(process, replace(c, pv_filter_s=rng.choice([0.0, 3.0, 10.0]), **WIDE))
        load = np.append(0.0, np.ones(2999))
        pv = closed_loop(loop, np.zeros(3000), load, op_start=0.0).pv
        grown = np.ptp(pv[-750:]) / (np.ptp(pv[750:1500]) + 1e-12)
        if not 0.2 < grown < 5:
            compared += 1
            assert is_stable(loop) == (grown < 1)
            assert math.isfinite(maximum_sensitivity(loop)) == (grown < 1)
    assert compared > 60
