"""A stem with mass under dry friction, compared with a slow integration of its equation and with theory."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identification.record import Floats
from identification.simulation.valve import RESTS, SLIDES, StemLaw, walk

LAW = StemLaw(1.5, 0.5, SLIDES)


def slowly(op: Floats, law: StemLaw, time_s: float, dt_s: float) -> Floats:
    """Mean positions from a solver of differential equations, sample by sample, with a stop at each reversal of
    the speed."""
    at, speed, out = float(op[0]), 0.0, np.empty_like(op)
    for k, u in enumerate(op):
        t, total = 0.0, 0.0
        while t < dt_s - 1e-12:
            if speed == 0.0 and abs(u - at) <= law.breakaway:
                total += at * (dt_s - t)
                break
            way = math.copysign(1.0, speed if speed != 0.0 else u - at)

            def moved(_: float, z: Floats, u: float = u, way: float = way) -> list[float]:
                pull = u - z[0] - way * law.sliding
                return [z[1], pull / time_s**2 - 2.0 * z[1] / time_s, z[0]]

            def turned(_: float, z: Floats, way: float = way) -> float:
                return way * z[1] + 1e-12 if z[1] != 0.0 else 1.0

            turned.terminal, turned.direction = True, -1.0  # type: ignore[attr-defined]
            found = solve_ivp(moved, (t, dt_s), [at, speed, 0.0], events=turned, rtol=1e-9, atol=1e-12)
            at, speed, more = (float(x[-1]) for x in found.y)
            total, t = total + more, float(found.t[-1])
            if found.status == 1:
                speed = 0.0
        if abs(speed) * time_s < 0.01 * law.breakaway:
            speed = 0.0
        out[k] = total / dt_s
    return out


@pytest.mark.parametrize("time_s", [0.1, 0.3, 1.0])
def test_the_stem_follows_its_equation(time_s: float) -> None:
    """The piecewise solution agrees with a solver of m z'' + c z' + k z = u - friction within 0.05."""
    rng = np.random.default_rng(4)
    op = 50.0 + 4.0 * np.sin(np.arange(300) / 20.0) + rng.normal(0.0, 0.3, 300)
    found = walk(op, LAW, op[0], time_s, 1.0)
    assert np.abs(found - slowly(op, LAW, time_s, 1.0)).max() < 0.05
    assert np.ptp(found) > 3.0


def test_the_stem_rests_within_the_breakaway_and_then_moves_to_the_sliding_distance() -> None:
    """An OP within the breakaway does not move the stem. A larger step moves it to the balance of spring and
    friction."""
    still = 50.0 + 1.4 * np.sign(np.sin(np.arange(100) / 5.0))
    assert (walk(still, LAW, 50.0, 0.3, 1.0) == 50.0).all()
    step = np.r_[np.full(10, 50.0), np.full(40, 53.0)]
    for way in (1.0, -1.0):
        end = walk(50.0 + way * (step - 50.0), LAW, 50.0, 0.3, 1.0)[-1]
        assert end == pytest.approx(50.0 + way * 2.5, abs=0.02)


def test_a_light_stem_rests_after_each_slip() -> None:
    """With a natural period far below the sample, the stem rests after each slip under constant OP (He 2007)."""
    op = 50.0 + 5.0 * np.sin(np.arange(400) / 15.0)
    light = walk(np.repeat(op, 3), LAW, op[0], 1e-3, 1.0)[2::3]
    assert np.abs(light - walk(op, StemLaw(1.5, 0.5, RESTS), op[0])).max() < 0.02
