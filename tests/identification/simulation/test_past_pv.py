"""Effects that depend on recorded PV: a switch with its band, and the mean of the past."""

from __future__ import annotations

import numpy as np

from identification.simulation.open_loop import RAMP, gain_change_by_history, returned, switched


def test_load_is_switched_as_a_schmitt_trigger_does() -> None:
    """Outside the ramps of its band a switched load equals a Schmitt trigger of PV in plain Python."""
    rng = np.random.default_rng(3)
    pv = np.cumsum(rng.normal(0.0, 0.6, 4000))
    pv -= pv.mean()
    on, slow = 0.0, []
    for x in pv:
        if x > 0.4 + 0.5 * 2.0:
            on = 1.0
        elif x < 0.4 - 0.5 * 2.0:
            on = 0.0
        slow.append(on)
    out = switched(pv, 0.4, 2.0)
    apart = np.abs(out - np.array(slow))
    near = np.minimum(np.abs(pv - 1.4), np.abs(pv + 0.6)) <= RAMP
    assert out.min() == 0.0
    assert out.max() == 1.0
    assert float(np.mean(apart > 0.0)) < 0.25
    settled = np.flatnonzero(~near)
    assert float(np.mean(apart[settled] > 0.0)) < 0.02


def test_past_of_pv_is_a_first_order_mean_of_it() -> None:
    """A step of PV has the effect 1 - exp(-t / memory), and no effect in the sample at which it is recorded."""
    pv = np.where(np.arange(3000) >= 500, 5.0, 0.0)
    gain = gain_change_by_history(pv, 0.4, 300.0, 2.0)
    assert not gain[:501].any()
    middle_s = 2.0 * np.arange(2499) + 1.0
    assert np.allclose(gain[501:], 0.2 * (1.0 - np.exp(-middle_s / 300.0)), atol=1e-5)


def test_gain_never_changes_its_sign() -> None:
    """At any distance of PV, at least a twentieth of the gain remains."""
    assert gain_change_by_history(np.full(500, -90.0), 3.0, 10.0, 1.0).min() == -0.95


def test_returned_flow_is_delayed_pv() -> None:
    """A ramp returns after the delay, counted to the middle of each sample."""
    pv = 3.0 + 0.2 * np.arange(400)
    assert np.array_equal(returned(pv, 0.1, 2.0), pv)
    back = returned(pv, 101.0, 2.0)
    k = np.arange(400)
    assert np.allclose(back, 3.0 + 0.2 * np.maximum(k + 0.5 - 50.5, 0.0))
