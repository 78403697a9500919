"""Backlash beside a periodic load: on loops of benchmarks/world, whose simulator shares no code with the packages."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.world.draw import wander
from benchmarks.world.simulate import BACKLASH, Controller, Process, Valve, simulate
from identification.estimation.beside_line import BesideLine, beside_line, with_further
from identification.estimation.smooth_load import _line, _whitened, fit_line, fit_smooth
from identification.estimation.window import Window, block_means
from identification.record import Floats
from identification.simulation.lag import unit_lag

PROCESS, LAW, PERIOD_S, BLOCK, HOURS = Process(1.0, 100.0, 0.0, 12.0), Controller(3.0, 100.0), 240.0, 8, 8
STARTS = [(72.0, 12.0), (480.0, 12.0)]
WIDTH = 2.0


class Case(NamedTuple):
    """Windows of one loop, the latest first, and what is found in the first."""

    windows: list[Window]
    found: BesideLine


def _trends(valve: Valve, top: float, seed: int) -> tuple[Floats, Floats]:
    """PV and OP of a loop under a sine, cut off at `top` of its amplitude, and a load that wanders."""
    rng, n = np.random.default_rng(seed), 2 * HOURS * 3600
    wave = np.clip(np.sin(2 * math.pi * np.arange(n) / PERIOD_S), -top, top) / top
    load = 1.2 * wave + 0.3 * wander(rng, n, 600.0, 1.0)
    noise = 0.03 * rng.standard_normal(n)
    t = simulate(PROCESS, LAW, valve, np.full(n, 50.0), load, np.zeros(n), noise)
    return t.pv, t.op


def _case(valve: Valve, top: float = 1.0, seed: int = 3) -> Case:
    pv, op = _trends(valve, top, seed)
    half = HOURS * 3600
    windows = []
    for part in (slice(half, None), slice(0, half)):
        y = block_means(pv[part], BLOCK)
        good = np.ones(y.size, dtype=bool)
        windows.append(Window(y, np.ascontiguousarray(op[part]), good, 1.0 * BLOCK, BLOCK, turn=480))
    smooth = fit_smooth(windows[0], PERIOD_S, [(s, None) for s in STARTS])
    lined = fit_line(windows[0], PERIOD_S, [smooth], STARTS)
    return Case(windows, beside_line(windows[0], lined, STARTS, 0.0, PERIOD_S))


def test_backlash_under_a_sine_is_found_with_its_width():
    """Behind a valve with backlash under a sine, the joint model finds width and process gain within 10 %."""
    found = _case(Valve(BACKLASH, WIDTH)).found
    assert found.evidence > 75.0
    assert found.play.valve.stickband == pytest.approx(WIDTH, rel=0.1)
    assert found.play.gain / found.play.time_constant_s == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("top", [1.0, 0.5])
@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_sound_valve_has_no_evidence(top, seed):
    """A sound valve under a sine, or one that is cut off and so has harmonics as a worn valve does, is not worn."""
    found = _case(Valve(), top, seed).found
    assert found.evidence < 25.0


def test_further_windows_agree():
    """A second window of a worn valve adds about as much evidence as the first; one of a sound valve adds none."""
    windows, found = _case(Valve(BACKLASH, WIDTH))
    both = with_further(found, windows[1:], PERIOD_S)
    assert both.evidence == pytest.approx(2 * found.evidence, rel=0.35)
    assert both.gained.size == pytest.approx(2 * found.gained.size, abs=2)
    windows, found = _case(Valve())
    assert with_further(found, windows[1:], PERIOD_S).evidence < 25.0


def test_whitening_inverts_a_load_with_lines():
    """White noise through the load model by scipy, with a line and two harmonics, is white again after the kernel."""
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
