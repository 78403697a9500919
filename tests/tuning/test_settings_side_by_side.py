"""Settings side by side: the lambda rule against theory, and the figures of each against a separate simulation."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from identification.models import Backlash, Fopdt, Integrator, Loop, Pid, Process
from identification.simulation.closed_loop import closed_loop
from tuning.forecast import LAMBDA, LONGER, NOW, RECOMMENDED, SIMC, alternatives, run, settled, tried
from tuning.frequency_response import maximum_sensitivity
from tuning.rules import lambda_settings

PIPE = Loop(Fopdt(1.5, 40.0, 4.0), Pid(1.2, 15.0), Backlash(2.0))


def test_lambda_makes_the_loop_as_slow_as_lambda() -> None:
    """After a step of the set point, PV reaches 63 % at lambda plus the dead time, here 40 and 4 s."""
    process = Fopdt(1.5, 40.0, 4.0)
    loop = Loop(process, replace(lambda_settings(process), scan_s=0.2))
    sp = np.where(np.arange(2000) < 10, 0.0, 1.0)
    pv = closed_loop(loop, sp, np.zeros(2000)).pv
    reached = 0.2 * (int(np.argmax(pv >= 1.0 - math.exp(-1.0))) - 10)
    assert reached == pytest.approx(44.0, rel=0.03)


def test_lambda_keeps_three_dead_times() -> None:
    """A process with mainly dead time, and a level, get a lambda of three dead times. They are as robust as
    SIMC (Ms 1.7)."""
    for process in (Fopdt(2.0, 5.0, 10.0), Integrator(0.01, 10.0)):
        assert maximum_sensitivity(Loop(process, replace(lambda_settings(process), scan_s=0.5))) < 1.7


@pytest.mark.parametrize("process", [Fopdt(0.0, 10.0, 1.0), Integrator(0.1, 0.0)])
def test_lambda_error_states_what_is_missing(process: Process) -> None:
    """A process without gain, or an integrator without dead time, has no rule, and the error states what is
    needed."""
    with pytest.raises(ValueError, match="needs gain and delay"):
        lambda_settings(process)


def test_present_settings_come_first_and_none_twice() -> None:
    """The present settings are first, the recommended second. A rule with the same settings as another is left
    out."""
    assert list(alternatives(PIPE, Pid(0.5, 60.0))) == [NOW, RECOMMENDED, SIMC, LAMBDA, LONGER]
    long = replace(PIPE, controller=Pid(1.2, 90.0))
    assert LONGER not in alternatives(long, None)
    assert RECOMMENDED not in alternatives(long, None)
    assert LONGER not in alternatives(replace(PIPE, process=Integrator(0.04, 4.0)), None)


def test_figures_are_sums_over_a_simulated_record() -> None:
    """Travel, error and peak are sums over the simulated record. A longer Ti more than halves the travel of the
    present settings."""
    load = 0.1 * np.random.default_rng(2).standard_normal(6000)
    found = {t.name: t for t in tried(PIPE, load, alternatives(PIPE, Pid(0.5, 60.0)))}
    record = settled(run(PIPE, load))
    stem, error = record.position, record.sp - record.pv
    assert stem is not None
    hours = len(record) * record.dt_s / 3600.0
    assert found[NOW].stem_travel == pytest.approx(sum(abs(b - a) for a, b in pairwise(stem)) / hours)
    assert found[NOW].error == pytest.approx(sum(abs(e) for e in error) / len(error))
    assert found[NOW].peak == pytest.approx(max(abs(e) for e in error))
    assert found[NOW].integral_s == pytest.approx(12.5)
    assert found[LONGER].stem_travel < 0.5 * found[NOW].stem_travel
