"""Data of a controller in loops.csv in addition to gain and times, and the typing error that explains wrong
settings.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from analyzer.loop.record.quality import beyond_gap
from analyzer.loops.spec import LoopSpec, read_loops
from analyzer.loops.tags import as_stated, controller
from analyzer.loops.typing_errors import typing_error
from analyzer.words.units import corrected_columns
from identification.errors import InputError
from identification.models import ErrorForm, Form, Pid


def row(tmp_path, header: str, cells: str) -> LoopSpec:
    """The one loop of a file with this header and row."""
    (tmp_path / "loops.csv").write_text(f"loop,{header}\nL,{cells}\n")
    return read_loops(tmp_path / "loops.csv")[0]


def test_extras_are_taken_in_percent_of_spans(tmp_path):
    """A gap in the unit of PV and limits in the unit of OP become percent: 2 of 200 is 1 %, 12 mA is 50 %."""
    extras = "gap,gap_gain,error_form,pv_filter_s,op_rate,op_hi_limit,sp_weight,td_filter"
    spec = row(
        tmp_path,
        f"pv_lo,pv_hi,op_lo,op_hi,kp,ti,{extras}",
        "100,300,4,20,2,60,2,0.3,squared,5,0.16,12,0.4,10",
    )
    pid = controller(spec, 200.0)
    assert pid is not None
    assert (pid.gap, pid.gap_gain, pid.error_form) == (1.0, 0.3, ErrorForm.SQUARED)
    assert (pid.pv_filter_s, pid.sp_weight, pid.td_filter) == (5.0, 0.4, 10.0)
    assert (pid.op_rate, pid.op_lo, pid.op_hi) == pytest.approx((1.0, 0.0, 50.0))


@pytest.mark.parametrize("cell", ["0", "inf", "P", "off"])
def test_no_integral_is_written_in_the_usual_ways(tmp_path, cell):
    """An integral time of 0, inf, P or off means no integral action."""
    pid = controller(row(tmp_path, "kp,ti", f"2,{cell}"), None)
    assert pid == Pid(2.0, math.inf)


def test_integral_alone_is_stated_by_a_gain_of_zero(tmp_path):
    """kp 0 with ti means integral action alone with gain 1/Ti and is stated back as it was; kp 0 alone states no
    controller.
    """
    spec = row(tmp_path, "kp,ti,ti_unit", "0,2,min")
    pid = controller(spec, None)
    assert pid is not None
    assert pid.ki == pytest.approx(1 / 120.0)
    assert as_stated(pid, spec, None) == pytest.approx((0.0, 2.0))
    assert controller(row(tmp_path, "kp,ti", "0,0"), None) is None


def test_a_negative_integral_time_needs_a_gain_of_zero(tmp_path):
    """A negative integral time is refused with a gain, whose sign is that of the controller, and allowed with a gain
    of zero.
    """
    with pytest.raises(InputError, match="not below 0"):
        row(tmp_path, "kp,ti", "2,-60")
    pid = controller(row(tmp_path, "kp,ti", "0,-60"), None)
    assert pid is not None
    assert pid.ki < 0


@pytest.mark.parametrize(
    ("column", "meant"),
    [
        ("ti_s", "ti' with ti_unit 's"),
        ("ti_min", "ti' with ti_unit 'min"),
        ("op_rat", "op_rate"),
        ("beta", "sp_weight"),
    ],
)
def test_other_names_are_refused_with_the_name_that_is_meant(tmp_path, column, meant):
    """A column with another or a misspelt name is refused with the name that is meant."""
    with pytest.raises(InputError, match=meant):
        row(tmp_path, f"kp,{column}", "2,60")


SPEC = LoopSpec("L", kp=2.0, ti=1.5, pv_lo=0.0, pv_hi=250.0)


@pytest.mark.parametrize(
    ("spec", "found", "changed"),
    [
        (SPEC, Pid(2.1, 88.0), {"ti_unit": "min"}),
        (replace(SPEC, ti=30.0), Pid(2.0, 2.0), {"ti_unit": "repeats/min"}),
        (replace(SPEC, kp=40.0, ti=90.0), Pid(2.4, 92.0), {"gain_unit": "band"}),
        (replace(SPEC, ti=90.0), Pid(5.2, 90.0), {"gain_unit": "engineering"}),
        (replace(SPEC, ti=90.0, td=45.0), Pid(3.0, 135.0, 30.0), {"form": "series"}),
        (replace(SPEC, ti=90.0), Pid(2.0, 90.0), {}),
        (SPEC, Pid(7.0, 400.0), {}),
    ],
)
def test_the_typing_error_that_explains_the_settings_is_named(spec, found, changed):
    """The found figures show whether minutes, repeats, band, engineering units or form was meant; otherwise nothing
    is named.
    """
    if changed or found.kp == 7.0:
        assert typing_error(spec, found, 250.0) == changed
    else:
        assert "form" not in typing_error(replace(spec, form=Form.IDEAL), found, 250.0)


def test_found_terms_are_written_in_the_units_of_loops_csv(tmp_path):
    """Of spans of 200 and 4 to 20 mA, 1 % of gap, 1 %/s of rate and 50 % of limit are written as 2, 0.16 and 12."""
    spec = row(tmp_path, "pv_lo,pv_hi,op_lo,op_hi,kp,ti", "100,300,4,20,2,60")
    stated = controller(spec, 200.0)
    assert stated is not None
    seen = replace(stated, gap=1.0, op_rate=1.0, op_hi=50.0, error_form=ErrorForm.SQUARED)
    written = corrected_columns(stated, seen, spec, 200.0)
    assert written == "error_form squared, gap 2, op_rate 0.16, op_hi_limit 12"
    columns, cells = zip(*(part.split(" ") for part in written.split(", ")), strict=True)
    head, filled = "pv_lo,pv_hi,op_lo,op_hi,kp,ti", "100,300,4,20,2,60"
    again = row(tmp_path, f"{head},{','.join(columns)}", f"{filled},{','.join(cells)}")
    assert controller(again, 200.0) == seen


def test_a_constant_op_within_a_stated_gap_is_not_in_manual():
    """Of two spans with constant OP, only the span in which the error leaves the gap is manual."""
    manual, error = np.zeros(40, dtype=bool), np.zeros(40)
    manual[5:15] = manual[20:30] = True
    error[5:15], error[20:30] = 0.4, np.linspace(0.0, 0.9, 10)
    assert np.flatnonzero(beyond_gap(manual, error, 0.5)).tolist() == list(range(20, 30))
