"""The generator of untidy loops agrees with its description."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from proofs.untidy.draw import draw
from proofs.untidy.loop import Plant, Stem, critical_gain, run
from proofs.untidy.recorder import swinging_door
from proofs.untidy.valve import step_lugre

STILL = np.zeros(6000)


def stem_behind(op: np.ndarray, coulomb: float, static: float) -> np.ndarray:
    """Stem position for an OP [%], of the same shape."""
    state = np.array([op[0], op[0], 0.0, 1.0, 0.0])
    friction = np.array([coulomb, static, 0.01 * static, 0.2, -1e6, 1.0])
    return np.array([step_lugre(state, u, friction, 0.0, 0.3, 0.0, 0.0) for u in op])


def test_a_stem_with_friction_slips_where_the_force_passes_the_static_level():
    """On a slow ramp the first slip occurs within 10 % of the static friction, and it is larger than the creep
    before."""
    op = 50 + 0.01 * np.arange(600)
    stem = stem_behind(op, 0.5, 3.0)
    slip = int(np.argmax(np.diff(stem[:450])))
    assert op[slip] - 50 == pytest.approx(3.0, rel=0.1)
    assert np.diff(stem)[slip] > 1.5
    assert stem[slip - 20] - 50 < 0.4


def test_with_equal_friction_levels_the_stem_lags_by_the_coulomb_level():
    """If static and Coulomb friction are equal, the stem follows a slow triangle at this distance without
    jumps."""
    op = 50 + 10 * np.abs((np.arange(8000) / 2000) % 2 - 1)
    stem = stem_behind(op, 1.0, 1.0)
    assert np.median(np.abs(op - stem)[2000:]) == pytest.approx(1.0, rel=0.1)
    assert np.abs(np.diff(stem)).max() < 0.1


def test_the_critical_gain_separates_decay_from_growth():
    """The response to a set-point step decays at 93 % of the critical gain and grows at 107 %."""
    plant = Plant(1.5, 30.0, 0.0, 6.0, False, 1.0, 25.0, 1.0)
    sp = np.where(np.arange(6000) > 10, 50.1, 50.0)
    for factor, grows in ((0.93, False), (1.07, True)):
        swung = replace(plant, kp=factor * critical_gain(plant))
        pv = run(swung, Stem(lag=1.0), sp, STILL, STILL, np.random.default_rng(1))[0]
        assert (np.ptp(pv[2000:2500]) > 0.1) == grows


def test_the_swinging_door_keeps_within_two_deviations():
    """No decompressed sample differs from the signal by more than two deviations, and most samples are left
    out."""
    x = np.cumsum(np.random.default_rng(2).standard_normal(3000))
    back = swinging_door(x, 2.0, 500)
    assert np.abs(x - back).max() <= 4.0
    assert (np.abs(np.diff(back, 2)) > 1e-9).mean() < 0.4


def test_loops_without_a_cause_are_not_amplified():
    """Without a cause the amplification of the error is 1 within 0.3, for every seed."""
    for seed in range(6):
        drawn = draw(seed, "healthy")
        assert drawn.truth["swell"] == pytest.approx(1.0, abs=0.3)
        assert np.isfinite(drawn.pv).all()


def test_a_cause_amplifies_the_error():
    """For each cause some loops have an error amplitude at least 50 % larger than without it. The same seed
    gives the same loop."""
    for cause in ("stiction", "backlash", "tuning", "load"):
        assert max(draw(seed, cause).truth["swell"] for seed in range(8)) > 1.5
    one, again = draw(3, "stiction"), draw(3, "stiction")
    assert np.array_equal(one.pv, again.pv)
    assert math.isfinite(one.truth["period"])
