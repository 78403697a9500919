"""A simulation with the present settings agrees with its record in reversals, error and travel, and not in its exact
cycle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.identification.agreement import Agreement, reversals
from identification.simulation.valve import backlash_stem

SAME = Agreement(1.0, 1.0, 1.0, 1.0, (60, 60))


@pytest.mark.parametrize(("width", "expected"), [(0.5, 39), (1.9, 39), (2.1, 0)])
def test_a_stem_behind_backlash_reverses_twice_a_cycle_that_crosses_it(width, expected):
    """Twenty cycles of a sine of 2 % peak to peak have 39 reversals after a narrower backlash, and none after a wider
    one.
    """
    op = np.sin(2 * np.pi * np.arange(20 * 200) / 200)
    assert reversals(backlash_stem(op, width)) == pytest.approx(expected, abs=1)


def test_noise_within_the_backlash_causes_no_reversal():
    """Noise of OP that stays within the backlash does not move the stem."""
    op = np.sin(2 * np.pi * np.arange(4000) / 200) + 0.05 * np.random.default_rng(1).standard_normal(4000)
    assert reversals(backlash_stem(op, 1.0)) == pytest.approx(39, abs=1)
    assert reversals(op) > 400


@pytest.mark.parametrize(("counted", "agrees"), [((20, 32), True), ((200, 320), False)])
def test_few_reversals_are_allowed_to_differ_more(counted, agrees):
    """A ratio of 1.6 is within the scatter of 20 reversals, and not within the scatter of 200."""
    found = replace(SAME, reversals=1.6, counted=counted).worst(Config().advice)
    assert (found is None) is agrees


@pytest.mark.parametrize("name", ["error", "op_travel", "stem_travel", "reversals"])
def test_a_simulation_without_a_figure_disagrees(name):
    """A simulation without error, travel or reversals does not agree with the record."""
    assert SAME.worst(Config().advice) is None
    assert replace(SAME, **{name: 0.0}).worst(Config().advice) is not None
