"""Backlash in addition to a periodic load, on loops of benchmarks/world. Their simulator shares no code with
the packages."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.world.draw import wander
from benchmarks.world.simulate import BACKLASH, Controller, Process, Valve, simulate
from identification.estimation.backlash_under_line import BacklashUnderLine, fit_backlash_under_line
from identification.estimation.problem import block_means, in_blocks
from identification.estimation.smooth_load import _line, _whitened
from identification.record import Floats
from identification.simulation.lag import unit_lag

PROCESS, LAW, PERIOD_S, BLOCK, HOURS = Process(1.0, 100.0, 0.0, 12.0), Controller(3.0, 100.0), 240.0, 8, 12
STARTS = [(72.0, 12.0), (480.0, 12.0)]
WIDTH = 2.0


def _trends(
    valve: Valve, seed: int, top: float = 1.0, size: float = 1.2, slow: float = 0.0
) -> tuple[Floats, Floats]:
    """PV and OP of a loop under a sine of a size [% OP], cut off at `top` of its amplitude, and slowly varying
    loads."""
    rng, n = np.random.default_rng(seed), HOURS * 3600
    sine = np.clip(np.sin(2 * math.pi * np.arange(n) / PERIOD_S), -top, top) / top
    load = size * sine + size / 4.0 * wander(rng, n, 600.0, 1.0) + slow * wander(rng, n, 7200.0, 1.0)
    noise = 0.03 * rng.standard_normal(n)
    t = simulate(PROCESS, LAW, valve, np.full(n, 50.0), load, np.zeros(n), noise)
    return t.pv, t.op


def _found(trends: tuple[Floats, Floats]) -> BacklashUnderLine:
    pv, op = trends
    y = block_means(pv, BLOCK)
    problem = in_blocks(y, np.ascontiguousarray(op), np.ones(y.size, dtype=bool), 1.0 * BLOCK, BLOCK)
    return fit_backlash_under_line(problem, STARTS, (), PERIOD_S)


def test_backlash_under_a_sine_is_found_with_its_width():
    """Backlash under a sine is recovered by the joint model with width and process gain within 10 %."""
    found = _found(_trends(Valve(BACKLASH, WIDTH), 3))
    assert found.evidence > 75.0
    assert found.backlash.valve.stickband == pytest.approx(WIDTH, rel=0.1)
    assert found.backlash.gain / found.backlash.time_constant_s == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("seed", [3, 4])
def test_backlash_that_the_cycle_does_not_cross_is_found_by_slower_moves(seed):
    """Backlash of twice the OP range of a period is recovered within 10 % from slower moves that cross it.
    These moves also give the process gain, which the oscillation does not show."""
    pv, op = _trends(Valve(BACKLASH, 2 * WIDTH), seed, size=0.3, slow=1.2)
    smooth = block_means(op, BLOCK)
    swings = np.ptp(smooth.reshape(-1, int(PERIOD_S) // BLOCK), axis=1)
    assert np.median(swings) < 1.1 * WIDTH
    found = _found((pv, op))
    assert found.evidence > 75.0
    assert found.backlash.valve.stickband == pytest.approx(2 * WIDTH, rel=0.1)
    assert found.backlash.gain / found.backlash.time_constant_s == pytest.approx(0.01, rel=0.25)


@pytest.mark.parametrize("top", [1.0, 0.5])
@pytest.mark.parametrize("seed", [3, 4, 5])
def test_an_ideal_valve_has_no_evidence_of_backlash(top, seed):
    """An ideal valve has no evidence of backlash under a sine, or under a clipped sine, which has harmonics as
    backlash has."""
    found = _found(_trends(Valve(), seed, top))
    assert found.evidence < 25.0


def test_whitening_inverts_a_load_with_lines():
    """A load of filtered white noise with a line and two harmonics is white again after the kernel (filters by
    scipy)."""
    white = np.random.default_rng(1).standard_normal(3000)
    white[:50] = 0.0
    p, s, z1, z2 = 0.9, 0.99, 0.3, 0.1
    y = lfilter(np.poly([z1, z2]), np.poly([p, s]), white)
    lines = np.array([_line(k * 0.2, k * k * 0.002, h) for k, h in ((1, 2.0), (3, 1.0), (5, 0.5))])
    for r1, r2, v1, v2 in lines:
        y = lfilter([1.0, v1, v2], [1.0, r1, r2], y)
    noise = -(p + s), p * s, -(z1 + z2), z1 * z2
    back, _ = _whitened(y, np.zeros(y.size), unit_lag(60.0, 10.0, 6.0), noise, lines)
    assert back == pytest.approx(white, abs=1e-8)
