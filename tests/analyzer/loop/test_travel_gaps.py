"""Travel and sampling interval of incomplete trends."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.config import FigureLimits
from analyzer.loop.oscillation.figures import assess_span
from analyzer.loop.record.sample_clock import interval
from identification.record import LoopRecord


def test_moves_during_a_gap_are_no_travel():
    """OP that is constant at 20, lost, and then constant at 80 has no known travel."""
    op = np.repeat([20.0, 50.0, 80.0], 2000)
    bad = np.repeat([False, True, False], 2000)
    pv = np.full(6000, 50.0)
    night = assess_span(LoopRecord("L", 0.0, 1.0, pv, pv, op, bad), FigureLimits())
    assert night.valve_travel_pct_per_h == 0.0
    assert night.usable_h == pytest.approx(4000 / 3600)


def test_jitter_does_not_change_the_interval():
    """Stamps with a jitter of 0.2 s around each second have an interval of one second."""
    stamps = np.arange(8000) + np.random.default_rng(0).uniform(-0.2, 0.2, 8000)
    assert interval(np.sort(stamps)) == 1.0
