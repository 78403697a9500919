"""The check whether OP follows the stated settings, for controllers of each usual kind."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.assess import aliasing_requirement
from analyzer.loop.identification.measure import time_scale
from analyzer.loop.oscillation.detection import detect
from analyzer.loop.record.judged_stretch import controller_of, differing, shown
from analyzer.loop.record.quality import prepare
from analyzer.loops.tags import match, read_loops
from identification.models import Pid
from identification.record import LoopRecord

TEP = Path(__file__).parents[3].parent / "shared" / "recordings" / "tep"
N = 4000
PI = Pid(2.0, 80.0)
P = Pid(2.0, math.inf)
PID = Pid(2.0, 80.0, 10.0)


def recorded(pid: Pid, scans: int = 1, top: float = 100.0, seed: int = 3) -> LoopRecord:
    """A lag of 60 s with a dead time of 8 s under random-walk loads, scanned `scans` times a sample of 1 s."""
    rng, dt = np.random.default_rng(seed), 1.0 / scans
    load = np.cumsum(rng.standard_normal(N * scans)) * 0.3 * math.sqrt(dt)
    load -= np.linspace(0.0, load[-1], load.size)
    pv, ops, waiting = np.zeros(N * scans), np.zeros(N * scans), [50.0] * (8 * scans)
    y, integral, last, op = 0.0, 0.0, 0.0, 50.0
    for k in range(N * scans):
        waiting.append(op)
        y += (0.8 * (waiting.pop(0) - 50.0 + load[k]) - y) * dt / 60.0
        pv[k] = y + 0.01 * rng.standard_normal()
        due = integral - pid.kp * pv[k] * dt / pid.ti_s
        wanted = 50.0 - pid.kp * (pv[k] + pid.td_s * (pv[k] - last) / dt) + due
        integral, last = (due if wanted < top else integral), pv[k]
        op = ops[k] = round(min(wanted, top), 2)
    at = slice(0, None, scans)
    out = np.zeros(N, dtype=bool)
    return LoopRecord("L", 0.0, 1.0, np.full(N, 50.0), 50.0 + pv[at], ops[at], out)


def found_other(record: LoopRecord, stated: Pid) -> Pid | None:
    """The result of the check, with the settling time of the true loop."""
    return differing(record, stated, 320.0, Config().settings)


@pytest.mark.parametrize("pid", [P, PI, PID], ids=["P", "PI", "PID"])
@pytest.mark.parametrize("top", [100.0, 56.0], ids=["free", "clamped"])
def test_true_settings_are_accepted(pid, top):
    """True settings are not reported as different, also with a limit of OP that is not stated."""
    assert found_other(recorded(pid, top=top), pid) is None


@pytest.mark.parametrize("pid", [P, PI, PID], ids=["P", "PI", "PID"])
@pytest.mark.parametrize("top", [100.0, 56.0], ids=["free", "clamped"])
def test_wrong_settings_are_reported_with_the_true_ones(pid, top):
    """A wrong gain and integral time are reported, with those that OP follows."""
    found = found_other(recorded(pid, top=top), replace(pid, kp=2.5 * pid.kp, ti_s=3.0 * pid.ti_s))
    assert found is not None
    assert found.kp == pytest.approx(pid.kp, rel=0.25)
    assert found.ti_s == pytest.approx(pid.ti_s, rel=0.25)


def test_a_scan_faster_than_the_log_does_not_change_the_check():
    """A PI controller that is scanned ten times a sample is checked in the same way."""
    record = recorded(PI, scans=10)
    assert found_other(record, replace(PI, scan_s=0.1)) is None
    found = found_other(record, replace(PI, kp=5.0, ti_s=240.0, scan_s=0.1))
    assert found is not None
    assert found.kp == pytest.approx(2.0, rel=0.1)
    assert found.ti_s == pytest.approx(80.0, rel=0.1)


def test_missing_integral_action_of_a_controller_is_reported():
    """A controller of gain alone that is stated with an integral time is reported without integral action."""
    found = found_other(recorded(P), replace(P, ti_s=80.0))
    assert found is not None
    assert math.isinf(found.ti_s)


def test_a_constant_error_of_pv_is_no_other_integral_time():
    """A small constant error of PV all night, as from rounding, does not change the result for true settings."""
    record = recorded(PI)
    assert found_other(replace(record, pv=record.pv + 0.05), PI) is None


def test_a_series_law_stated_as_ideal_is_reported_if_each_scan_is_recorded():
    """The series law of Kp 2, Ti 80 s, Td 4 s is the ideal law of 2.1, 84 and 3.81.

    If it is stated as the ideal law of 2, 80 and 4, it is reported although its gain is only 5 % off. If it is stated
    correctly, it is not reported.
    """
    as_it_is, as_read = Pid(2.1, 84.0, 80.0 * 4.0 / 84.0), Pid(2.0, 80.0, 4.0)
    record = recorded(as_it_is)
    assert found_other(record, as_it_is) is None
    found = found_other(record, as_read)
    assert found is not None
    assert (found.kp, found.ti_s, found.td_s) == pytest.approx((2.1, 84.0, as_it_is.td_s), rel=1e-6)


def test_terms_that_loops_csv_does_not_state_are_found():
    """A limit of OP at 53 % is reported with true settings; without stated settings the recorded ones are found
    within 10 %.
    """
    limits = Config().settings
    terms = shown(recorded(PI, top=53.0), PI, 320.0, limits).detected
    assert terms is not None
    assert terms == replace(PI, op_hi=terms.op_hi)
    assert terms.op_hi == pytest.approx(53.0)
    alone = shown(recorded(PI), None, 320.0, limits).detected
    assert alone is not None
    assert (alone.kp, alone.ti_s) == pytest.approx((2.0, 80.0), rel=0.1)


def thinned(record: LoopRecord, every: int) -> LoopRecord:
    """One of each `every` samples."""
    of = slice(0, None, every)
    return LoopRecord("L", 0.0, every * 1.0, record.sp[of], record.pv[of], record.op[of], record.bad[of])


@pytest.mark.parametrize(("true_s", "stated_s", "lacks"), [(80.0, 80.0 / 60.0, False), (4.0, 4.0, True)])
def test_a_short_integral_time_hides_a_cycle_only_where_the_record_agrees(true_s, stated_s, lacks):
    """At a sample every 10 s, a loop with Ti 80 s that is stated in minutes can be judged for oscillation.

    A loop with Ti 4 s cannot.
    """
    config = Config()
    record = thinned(recorded(replace(PI, ti_s=true_s, kp=PI.kp if true_s > 10.0 else 0.1)), 10)
    needs = aliasing_requirement(
        record, detect(record, config.oscillation), replace(PI, ti_s=stated_s), config
    )
    assert (needs is not None) == lacks


@pytest.mark.skipif(not TEP.exists(), reason="the recordings lie outside the repository")
@pytest.mark.parametrize("loop", ["FIC3", "FIC6"])
def test_a_flow_that_responds_to_op_is_not_taken_for_the_control_law(loop):
    """In a cascade of the Tennessee Eastman plant, OP is stamped a sample after SP and PV, and PV follows OP at once.

    The stated gain is not reported as different, and no gain of the other sign is reported.
    """
    export = open_export([TEP / "idv14.parquet"])
    specs, *_ = match(read_loops(TEP / "loops.csv"), export.tags)
    spec = next(s for s in specs if s.loop == loop)
    prepared = prepare(spec, export.read(spec.tags), Config().quality)
    stated = controller_of(spec, prepared)
    assert stated is not None
    scale = time_scale(prepared.record, None, stated)
    assert differing(prepared.record, stated, scale, Config().settings) is None
