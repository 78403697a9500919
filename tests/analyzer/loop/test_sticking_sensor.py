"""A sticking sensor makes a cycle that looks like a sticking valve: no cause is reported for such a PV."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.loop.assess import assess
from analyzer.loop.cause.fitness import pv_that_jumps
from analyzer.loop.decisions import MissingData
from benchmarks.world.draw import drawn, run
from benchmarks.world.recorder import recorded
from identification.models import Pid
from proofs.plant import CONFIG, Sketch, Trends, prepared

NO_FAULT = Sketch("none", (1.2, 60.0, 10.0), 1.2, 60.0, noise=0.1, load_std=1.0)


def behind_a_sticking_sensor(grip: float, seed: int, n: int = 14_400) -> Trends:
    """SP, PV and OP, shape (n,) each at 1 s, of a loop without valve fault whose sensor moves only if it is `grip`
    [%] off.
    """
    rng, (gain, lag, dead) = np.random.default_rng(seed), NO_FAULT.process
    late, held, x, load, shown = [50.0] * int(dead), 50.0, 50.0, 0.0, 50.0 - 0.4 * grip
    pv, op = np.empty(n), np.empty(n)
    for k in range(n):
        load += 0.02 * rng.standard_normal() - load / 600.0
        seen = x + 0.1 * rng.standard_normal()
        shown = round(seen, 2) if abs(seen - shown) >= grip else shown
        pv[k], e = shown, 50.0 - shown
        held += NO_FAULT.kp / NO_FAULT.ti * e
        op[k] = np.round(NO_FAULT.kp * e + held, 2)
        late.append(op[k])
        x += (50.0 + gain * (late.pop(0) - 50.0 + load) - x) / lag
    return Trends(np.full(n, 50.0), pv, op, op)


@pytest.mark.parametrize("grip", [0.8, 1.5, 3.0])
def test_its_valve_gets_no_fault(grip: float) -> None:
    """A loop that oscillates because of its sensor gets no cause; the reason states that PV is needed as measured."""
    trends = behind_a_sticking_sensor(grip, 3)
    found = assess(prepared(trends), NO_FAULT.controller, CONFIG)
    assert found.verdict.cause in ("undecided", "none")
    assert found.verdict.needs is not None
    assert found.verdict.needs.lack is MissingData.FINER
    assert "is constant for" in str(found.verdict.needs)


def test_a_sensor_without_fault_gives_no_reason() -> None:
    """The same loop with a sensor that follows has no such reason."""
    found = assess(prepared(behind_a_sticking_sensor(0.0, 3)), NO_FAULT.controller, CONFIG)
    assert found.verdict.cause == "none"
    assert found.verdict.needs is None or "is constant for" not in str(found.verdict.needs)


@pytest.mark.parametrize(("kind", "number"), [("stiction", 0), ("stiction", 3)])
def test_a_historian_that_omits_small_changes_is_no_sticking_sensor(kind: str, number: int) -> None:
    """PV is constant for nine of ten samples, as with a sticking sensor, but OP responds to the omitted changes.

    The sticking valve is named as in the full record.
    """
    d = drawn(621, number + 1, (kind,))[number]
    kept = recorded(run(d), "by exception", d.seed)
    assert np.mean(np.diff(kept["pv"]) == 0.0) > 0.9
    pid = Pid(d.controller.kp, d.controller.ti_s, scan_s=1.0)
    found = assess(prepared(Trends(kept["sp"], kept["pv"], kept["op"], kept["op"])), pid, CONFIG)
    assert (str(found.verdict.cause), str(found.verdict.fault)) == ("valve", kind)


def test_held_values_of_a_gap_do_not_count_as_a_sticking_sensor() -> None:
    """Constant spans and jumps are computed from the recorded samples only.

    A gap of half the record with held values changes neither the constant share nor the smallest jump.
    """
    record = prepared(behind_a_sticking_sensor(1.5, 3)).record
    alone = pv_that_jumps(record, CONFIG.explain.recorder)
    gap = record.pv.size
    with_gap = replace(
        record,
        sp=np.append(record.sp, np.full(gap, record.sp[-1])),
        pv=np.append(record.pv, np.full(gap, record.pv[-1])),
        op=np.append(record.op, np.full(gap, record.op[-1])),
        bad=np.append(record.bad, np.ones(gap, dtype=bool)),
    )
    assert alone is not None
    assert pv_that_jumps(with_gap, CONFIG.explain.recorder) == alone
