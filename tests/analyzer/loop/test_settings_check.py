"""Whether stated settings are those that OP follows, for controllers of every usual kind."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.assess import hidden
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
    """A lag of 60 s with a dead time of 8 s under loads that walk, scanned so many times a sample of 1 s."""
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


def told(record: LoopRecord, stated: Pid) -> Pid | None:
    """What the check says, on the time scale of the true loop."""
    return differing(record, stated, 320.0, Config().settings)


@pytest.mark.parametrize("pid", [P, PI, PID], ids=["P", "PI", "PID"])
@pytest.mark.parametrize("top", [100.0, 56.0], ids=["free", "clamped"])
def test_true_settings_are_let_be(pid, top):
    """Nothing is told of settings that are those of the controller, at an end of OP that no list states either."""
    assert told(recorded(pid, top=top), pid) is None


@pytest.mark.parametrize("pid", [P, PI, PID], ids=["P", "PI", "PID"])
@pytest.mark.parametrize("top", [100.0, 56.0], ids=["free", "clamped"])
def test_wrong_settings_are_told_with_the_true_ones(pid, top):
    """Gain and integral time stated wrong are told, with those that OP follows."""
    found = told(recorded(pid, top=top), replace(pid, kp=2.5 * pid.kp, ti_s=3.0 * pid.ti_s))
    assert found is not None
    assert found.kp == pytest.approx(pid.kp, rel=0.25)
    assert found.ti_s == pytest.approx(pid.ti_s, rel=0.25)


def test_a_scan_faster_than_the_log_hides_nothing():
    """A PI controller scanned ten times a sample is judged like another."""
    record = recorded(PI, scans=10)
    assert told(record, replace(PI, scan_s=0.1)) is None
    found = told(record, replace(PI, kp=5.0, ti_s=240.0, scan_s=0.1))
    assert found is not None
    assert found.kp == pytest.approx(2.0, rel=0.1)
    assert found.ti_s == pytest.approx(80.0, rel=0.1)


def test_integral_action_that_is_not_there_is_told():
    """A controller of gain alone, stated with an integral time, is told to have none."""
    found = told(recorded(P), replace(P, ti_s=80.0))
    assert found is not None
    assert math.isinf(found.ti_s)


def test_a_constant_error_of_pv_is_no_other_integral_time():
    """PV a little off all night, as its rounding makes it, leaves the true settings alone."""
    record = recorded(PI)
    assert told(replace(record, pv=record.pv + 0.05), PI) is None


def test_a_series_law_stated_as_ideal_is_told_where_every_scan_is_recorded():
    """The series law of Kp 2, Ti 80 s, Td 4 s is the ideal one of 2.1, 84 and 3.81; read as an ideal law of 2, 80 and
    4 it is told though its gain is 5 % off, and stated as it is it is let be."""
    as_it_is, as_read = Pid(2.1, 84.0, 80.0 * 4.0 / 84.0), Pid(2.0, 80.0, 4.0)
    record = recorded(as_it_is)
    assert told(record, as_it_is) is None
    found = told(record, as_read)
    assert found is not None
    assert (found.kp, found.ti_s, found.td_s) == pytest.approx((2.1, 84.0, as_it_is.td_s), rel=1e-6)


def test_what_the_list_does_not_state_is_shown():
    """A limit of OP at 53 % is shown beside true settings; where none are stated those recorded are, within 10 %."""
    limits = Config().settings
    beside = shown(recorded(PI, top=53.0), PI, 320.0, limits).beside
    assert beside is not None
    assert beside == replace(PI, op_hi=beside.op_hi)
    assert beside.op_hi == pytest.approx(53.0)
    alone = shown(recorded(PI), None, 320.0, limits).beside
    assert alone is not None
    assert (alone.kp, alone.ti_s) == pytest.approx((2.0, 80.0), rel=0.1)


def thinned(record: LoopRecord, every: int) -> LoopRecord:
    """One sample of so many."""
    of = slice(0, None, every)
    return LoopRecord("L", 0.0, every * 1.0, record.sp[of], record.pv[of], record.op[of], record.bad[of])


@pytest.mark.parametrize(("true_s", "stated_s", "lacks"), [(80.0, 80.0 / 60.0, False), (4.0, 4.0, True)])
def test_a_short_integral_time_hides_a_cycle_only_where_the_record_agrees(true_s, stated_s, lacks):
    """At a sample every 10 s a loop of 80 s that is stated in minutes is seen to oscillate or not; one of 4 s is
    not."""
    config = Config()
    record = thinned(recorded(replace(PI, ti_s=true_s, kp=PI.kp if true_s > 10.0 else 0.1)), 10)
    needs = hidden(record, detect(record, config.oscillation), replace(PI, ti_s=stated_s), config)
    assert (needs is not None) == lacks


@pytest.mark.skipif(not TEP.exists(), reason="the recordings lie outside the repository")
@pytest.mark.parametrize("loop", ["FIC3", "FIC6"])
def test_a_flow_that_answers_op_is_not_taken_for_the_law(loop):
    """In a cascade of the Tennessee Eastman plant OP is stamped a sample after SP and PV, and PV follows OP at once:
    the gain stated is let be, and no gain of the other sign is told."""
    export = open_export([TEP / "idv14.parquet"])
    specs, *_ = match(read_loops(TEP / "loops.csv"), export.tags)
    spec = next(s for s in specs if s.loop == loop)
    prepared = prepare(spec, export.read(spec.tags), Config().quality)
    stated = controller_of(spec, prepared)
    assert stated is not None
    scale = time_scale(prepared.record, None, stated)
    assert differing(prepared.record, stated, scale, Config().settings) is None
