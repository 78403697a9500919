"""Settings in words: in the units of the controller, and without an integral time if there is none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analyzer.columns import row_of
from analyzer.config import Config
from analyzer.loop.advice.settings_side_by_side import compared
from analyzer.loop.conclusion import stated
from analyzer.loops.spec import LoopSpec
from analyzer.pages.compared import settings_page
from analyzer.pages.rank import brief
from analyzer.words.units import arrow, changed_settings, gain_unit, number, settings
from identification.controller.pid_regression import fit_pi
from identification.models import Backlash, Fopdt, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from reports.pages import Panels


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


def test_new_settings_without_present_ones_have_no_arrow() -> None:
    """If loops.csv states no Kp and Ti, an order and a list give the new ones alone, without "none"."""
    row = row_of({"loop": "A", **stated(LoopSpec("A")), "kp_new": 0.17, "ti_new": 24.7})
    assert changed_settings(row) == "Kp 0.17 %/%, Ti 24.7 s"


def test_errors_of_a_settings_page_are_in_the_unit_of_pv() -> None:
    """Without a stated range, an error of 1 % of a recorded span of 7 units is 0.07 in the own unit of PV."""
    loop = Loop(Fopdt(1.0, 30.0, 3.0), Pid(2.0, 20.0), Backlash(2.0))
    load = 0.5 * np.sin(np.arange(9000) / 300.0)
    found = compared(loop, load, Pid(1.0, 40.0), 120.0, 7.0, Config().tuning)
    assert found is not None
    page = settings_page("A", "2026-03-02", found, LoopSpec("A"))
    now = next(p for s in page.sections for b in s.blocks if isinstance(b, Panels) for p in b.plots)
    assert now.y_label == "SP \u2212 PV [own unit]"
    assert np.abs(now.lines[0].y).max() == pytest.approx(0.07 * np.abs(found.shown["now"].error).max())
