"""Pictures of the effects against closed forms, with bands that contain them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from identification.controller.check import Finding
from identification.mismatch.catalogue import CANDIDATES, EFFECTS
from identification.mismatch.catalogue.controller_gap import gap_profile
from identification.mismatch.catalogue.quantization import grid
from identification.mismatch.pictures import (
    Drawing,
    Picture,
    around_run,
    banded,
    biggest_move,
    most_active,
    rebuilt,
)
from identification.mismatch.recording import Recording
from identification.models import Estimate
from identification.simulation.open_loop import ModelInputs
from identification.simulation.parameters import Param, Slot, Variant, neutral
from identification.simulation.valve import backlash_stem

N = 2000


def inputs() -> ModelInputs:
    """OP between 20 and 80 % for 2,000 s, PV between 30 and 70 %."""
    op = 50 + 30 * np.sin(np.arange(N) / 50.0)
    return ModelInputs(op, 1.0, 50.0, 50.0, (30.0, 70.0), (500,))


def row(name: str) -> Variant:
    """The catalogue's first variant of this name."""
    return next(r for r in CANDIDATES if r.name == name)


def shape(name: str, spread: float = 0.1, **constants: float) -> Picture:
    """The picture of an effect with the given constants, each with a relative uncertainty."""
    plain = neutral()
    plain[Slot.K], plain[Slot.T], plain[Slot.L] = 1.2, 20.0, 5.0
    best = plain.copy()
    for key, value in constants.items():
        best[Slot[key]] = value
    known = {}
    for p in row(name).params:
        value = float(best[p.slot])
        known[p.name] = Estimate(value, *sorted((value * (1 - spread), value * (1 + spread))), p.unit)
    curve = EFFECTS[name].curve
    assert curve is not None
    return curve(Drawing(inputs(), row(name), known, best, plain))


def test_backlash_is_drawn_as_a_loop_of_its_width() -> None:
    """The loop of backlash equals that of the backlash operator on the same sweep, half its width on each side
    of OP."""
    found = shape("backlash", STICKBAND=4.0)
    loop = found.curves[0]
    assert np.abs(loop.y - loop.x).max() == pytest.approx(2.0, abs=1e-9)
    twice = backlash_stem(np.concatenate((loop.x, loop.x)), 4.0)[loop.x.size :]
    np.testing.assert_allclose(loop.y, twice, atol=1e-9)


def test_stiction_loops_are_those_of_the_interval() -> None:
    """The widest and the narrowest loop of a sticking valve are those of the interval's ends."""
    found = shape("stiction", STICKBAND=4.0, JUMP=2.0)
    width = {c.name: float(np.abs(c.y - c.x).max()) for c in found.curves}
    assert width["least"] < width["found"] < width["most"]
    assert width["most"] == pytest.approx(0.5 * 1.1 * (4.0 + 2.0), rel=0.03)


def test_saturation_is_flat_beyond_its_limit() -> None:
    """The flow follows OP up to the limit and stays there, within a band from the limit's interval."""
    curve = shape("saturation", STOP_HI=60.0).curves[0]
    np.testing.assert_allclose(curve.y, np.minimum(curve.x, 60.0))
    assert curve.high is not None
    assert curve.high[-1] == pytest.approx(66.0)


def test_slew_time_is_size_over_rate() -> None:
    """A step of a rate-limited valve is complete after its size divided by the rate."""
    curve = shape("rate-limit", RATE=0.5).curves[0]
    size = curve.y[-1]
    arrived = curve.x[np.argmax(curve.y > 0.999 * size)]
    assert arrived == pytest.approx(size / 0.5, rel=0.03)


def test_second_lag_response_is_the_closed_form() -> None:
    """The step response of two lags and a dead time is that of the textbook."""
    found = shape("second-lag", T2=8.0)
    t, y = found.curves[0].x, found.curves[0].y
    late = np.maximum(t - 5.0, 0.0)
    theory = 12.0 * (1 - (20 * np.exp(-late / 20) - 8 * np.exp(-late / 8)) / 12)
    np.testing.assert_allclose(y, theory, atol=0.01)


def test_falling_is_slower_by_the_asymmetry() -> None:
    """With a ratio of four, PV falls four times as slowly as it rises."""
    curve = shape("direction-asymmetry", ASYMMETRY=math.log(4.0)).curves[0]
    top, half = curve.y.max(), curve.x[-1] / 2
    rise = curve.x[np.argmax(curve.y > 0.632 * top)] - 5.0
    fall = curve.x[(curve.x > half) & (curve.y < 0.368 * top)][0] - curve.x[np.argmax(curve.y)] - 5.0
    assert fall / rise == pytest.approx(4.0, rel=0.3)


def test_gain_over_pv_and_time_are_straight_lines() -> None:
    """Gain over PV and gain over time are the lines of their constants, about the baseline gain."""
    level = shape("nonlinear-gain", SLOPE=0.5).curves[0]
    np.testing.assert_allclose(level.y, 1.2 * (1 + 0.5 * (level.x - 50) / 50))
    drift = shape("gain-drift", DRIFT=-0.4).curves[0]
    np.testing.assert_allclose(drift.y, 1.2 * (1 - 0.4 * (drift.x / N - 0.5)))


def test_dead_time_falls_with_flow() -> None:
    """With a share of one, the dead time is that of a pipe: inversely proportional to flow."""
    curve = shape("flow-dependent-delay", PIPE=1.0).curves[0]
    np.testing.assert_allclose(curve.y, 5.0 * 50.0 / curve.x, rtol=1e-9)


def test_load_step_is_drawn_at_its_time() -> None:
    """A load step is drawn at its time and size, with a mark."""
    found = shape("load-step", STEP=3.0)
    curve = found.curves[0]
    assert found.places == (500.0,)
    assert curve.y[curve.x < 499].max() == 0.0
    assert curve.y[-1] == 3.0


def test_every_row_of_the_catalogue_has_a_picture() -> None:
    """Every effect of the catalogue has a picture, and every curve is finite and above its lower band."""
    alone = {
        "SERVO": 2.0,
        "DAMPING": 0.5,
        "DEADBAND": 1.0,
        "SHARE": 0.3,
        "MODE_T": 60.0,
        "CAP": 60.0,
        "OMEGA": 0.02,
    }
    alone |= {"SINE": 1.0, "SPLIT": 50.0, "STICKBAND": 2.0, "RATE": 1.0, "ROOT": 0.5, "HEAD": 0.1}
    for r in CANDIDATES:
        slots = {Slot(p.slot).name for p in r.params if p.slot in set(Slot)}
        found = shape(r.name, **{k: v for k, v in alone.items() if k in slots})
        for curve in found.curves:
            assert np.isfinite(curve.y).all(), r.name
            assert curve.low is None or (curve.low <= curve.y + 1e-9).all(), r.name


def test_band_adds_deviations_as_squares() -> None:
    """Two constants that change a value by 3 and 4 give a band of 5."""
    c = neutral()
    params = (Param(Slot.T, "lag", "s", 0.0, 9.0), Param(Slot.L, "delay", "s", 0.0, 9.0))
    known = {"lag": Estimate(c[0], c[0] - 3, c[0] + 3), "delay": Estimate(0.0, -4.0, 4.0)}
    d = Drawing(inputs(), Variant(params, ()), known, c, c)
    y, low, high = banded(lambda k: np.array([k[Slot.T] + k[Slot.L]]), d)
    assert (y[0] - low[0], high[0] - y[0]) == pytest.approx((5.0, 5.0))


def test_stretches_contain_their_events() -> None:
    """The busiest stretch contains the burst, and the stretches about a run or a move contain these; all are
    inside the record."""
    x = np.zeros(1000)
    x[700:740] = np.random.default_rng(0).normal(0, 1, 40)
    part = most_active(x, 100)
    assert part.start <= 700
    assert part.stop >= 740
    where = np.zeros(1000, dtype=bool)
    where[10:30] = True
    part = around_run(where, 100)
    assert part.start == 0
    assert part.stop >= 30
    step = np.where(np.arange(1000) >= 990, 5.0, 0.0)
    assert biggest_move(step, 60, np.ones(1000, dtype=bool)) == slice(940, 1000)


def test_rebuilt_output_is_that_of_the_controller() -> None:
    """OP of a PI controller is reproduced by the same settings within rounding, and not by others."""
    e = np.random.default_rng(1).normal(0, 1, 500)
    op = 50 + 1.5 * (e + np.cumsum(e) / 30.0)
    np.testing.assert_allclose(rebuilt(e, op, 1.5, 30.0), op, atol=1e-9)
    assert np.abs(rebuilt(e, op, 1.0, 30.0) - op).max() > 0.3


def test_grid_and_gap_show_in_their_pictures() -> None:
    """The peaks of the grid have the distance of one step. OP is constant only below the gap."""
    rng = np.random.default_rng(2)
    n, every = 5000, np.ones(5000, dtype=bool)
    coarse = Recording(
        None, np.round(rng.normal(50, 3, n) / 0.5) * 0.5, np.zeros(n), every, 1.0, np.arange(n)
    )
    teeth = grid(Finding({"step_pct": 0.5}, every), coarse, coarse.pv).curves[0]
    np.testing.assert_allclose(np.diff(np.unique(teeth.x)), 0.5)
    e = rng.normal(0, 1, n)
    op = np.cumsum(np.where(np.abs(e) > 0.6, e, 0.0))
    still = Recording(e, np.zeros(n), op, every, 1.0, np.arange(n))
    found = gap_profile(Finding({"gap_pct": 0.6}, every), still, still.pv)
    assert found is not None
    curve = found.curves[0]
    assert curve.y[curve.x < 0.58].min() > 99
    assert curve.y[curve.x > 0.62].max() < 1
