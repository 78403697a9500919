"""Settings in words: in the units of the controller, and without an integral time if there is none."""

from __future__ import annotations

import math

import numpy as np

from analyzer.columns import row_of
from analyzer.loop.conclusion import stated
from analyzer.loops.spec import LoopSpec
from analyzer.pages.rank import brief
from analyzer.words.units import arrow, gain_unit, number, settings
from identification.controller.pid_regression import fit_pi
from identification.models import Fopdt, Loop, Pid
from identification.simulation.closed_loop import closed_loop


def test_a_gain_is_in_percent_of_op_only_if_op_is_in_percent() -> None:
    """If OP is from 0 to 255 counts, a gain is in these units; if it is from 0 to 100, it is in percent."""
    counts = LoopSpec("A", op_lo=0.0, op_hi=255.0, gain_unit="engineering", pv_unit="counts")
    percent = LoopSpec("A", gain_unit="engineering", pv_unit="degC")
    assert [gain_unit(s.gain_unit, s.pv_unit, s.op_unit) for s in (counts, percent)] == [
        "OP/counts",
        "%/degC",
    ]


def test_a_controller_without_integral_action_has_no_integral_time() -> None:
    """For P action alone on a noisy loop, no integral time is found, and the list says so."""
    rng = np.random.default_rng(8)
    sp = 50 + np.repeat(rng.uniform(-5, 5, 20), 200)
    r = closed_loop(Loop(Fopdt(1.0, 30.0, 3.0), Pid(2.0, math.inf)), sp, rng.normal(0, 0.1, sp.size))
    found = fit_pi(r, 200.0)
    assert found is not None
    assert abs(found.kp / 2.0 - 1.0) < 0.05
    assert math.isinf(found.ti_s)
    row = row_of({"loop": "A", **stated(LoopSpec("A", kp=2.0, ti=0.0))})
    assert brief(row, ("ti",)) == {"ti": "none"}


def test_a_number_just_under_a_thousand_has_no_exponent() -> None:
    """999.7 is shown as 1000, in a cell and between two settings; -0 is shown as 0, and an unknown value is empty."""
    assert [number(x) for x in (999.7, 99.96, 0.01234, -0.0, None)] == ["1000", "100", "0.0123", "0", ""]
    assert arrow(999.7, None) == "1000 \u2192 none"


def test_settings_are_typed_in_without_an_exponent() -> None:
    """Settings to type in are written without an exponent: 1154 s, not 1.15e+03 s."""
    assert settings(7.8, 1153.956, "%/m", "s") == "Kp 7.8 %/m, Ti 1154 s"
    assert settings(5209.5, 0.0, "% band", "s") == "Kp 5210 % band, no integral action"
