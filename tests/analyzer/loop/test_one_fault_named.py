"""`run` and `explain` name the same fault of a valve that slips a few times without a cycle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from analyzer import api
from analyzer.api import PlantLoop
from analyzer.loop.oscillation.detection import counting
from identification.models import Backlash, Fopdt, Loop, Motion, Pid, Stiction
from identification.simulation.closed_loop import closed_loop

N, STEP_S = 700, 10.0


def recorded(folder: Path, valve: Stiction | None) -> PlantLoop:
    """Two hours of a flow under a slow controller, with a drifting load and one step of its set point."""
    rng = np.random.default_rng(1)
    loop = Loop(Fopdt(1.5, 8.0, 3.0), Pid(0.2, 80.0, scan_s=STEP_S), valve)
    load = 0.05 * np.cumsum(rng.standard_normal(N)) / 3 + 0.15 * rng.standard_normal(N)
    r = closed_loop(loop, 50.0 + np.where(np.arange(N) > N // 3, 2.0, 0.0), load)
    stamp = pd.Timestamp("2026-03-02") + pd.to_timedelta(STEP_S * np.arange(N), unit="s")
    trends = {"FIC1.SP": r.sp, "FIC1.PV": r.pv.round(3), "FIC1.OP": r.op.round(3)}
    pd.DataFrame({"timestamp": stamp, **trends}).to_parquet(folder / "export.parquet")
    (folder / "loops.csv").write_text("loop,type,scan_s\nFIC1,flow,10\n")
    return api.read(folder / "export.parquet", loops=folder / "loops.csv").loop("FIC1")


def test_a_valve_that_slips_without_a_cycle_is_named_by_both(tmp_path: Path) -> None:
    """A stem with a stickband of 3 % and jumps of 2 % that slips four times is reported as stiction by both
    commands.
    """
    loop = recorded(tmp_path, Stiction(3.0, 2.0, Motion.HALTS))
    found = api.assess(loop)
    assert counting(found.oscillations) is None
    assert (found.verdict.cause, found.verdict.fault) == ("valve", "stiction")
    answer = api.explain(loop).said
    assert answer.verdict == "stiction"
    assert "between moves of the stem" in answer.shown


def test_the_same_loop_with_a_free_valve_names_no_friction(tmp_path: Path) -> None:
    """Under the same load and noise neither command reports a fault of a free valve."""
    loop = recorded(tmp_path, None)
    assert api.assess(loop).verdict.cause == "none"
    assert api.explain(loop).said.verdict not in ("stiction", "backlash")


def worn(folder: Path) -> PlantLoop:
    """Eleven hours of a level that oscillates because of a backlash of 2 %; only a stretch of them is simulated."""
    n = 41_000
    rng = np.random.default_rng(4)
    r = closed_loop(
        Loop(Fopdt(20.0, 800.0, 4.0), Pid(1.5, 60.0), Backlash(2.0)),
        np.full(n, 50.0),
        0.02 * np.cumsum(rng.standard_normal(n)) * 0.1 + 0.05 * rng.standard_normal(n),
    )
    stamp = pd.Timestamp("2026-03-02") + pd.to_timedelta(np.arange(n), unit="s")
    trends = {"LIC1.SP": r.sp, "LIC1.PV": r.pv.round(3), "LIC1.OP": r.op.round(3)}
    pd.DataFrame({"timestamp": stamp, **trends}).to_parquet(folder / "export.parquet")
    (folder / "loops.csv").write_text("loop,type,kp,ti,pv_lo,pv_hi\nLIC1,level,1.5,60,0,100\n")
    return api.read(folder / "export.parquet", loops=folder / "loops.csv").loop("LIC1")


def test_a_backlash_has_one_width_and_one_interval(tmp_path: Path) -> None:
    """`explain` and `fit` report the same width and interval of a backlash, and the interval contains the truth.

    This holds although `explain` simulates only a stretch.
    """
    loop = worn(tmp_path)
    fitted = api.fit(loop).estimates["backlash_pct"]
    found = api.explain(loop)
    answer = found.said.effects[0].parameters["backlash_pct"]
    assert found.case.shortened
    assert (answer.value, answer.low, answer.high) == (fitted.value, fitted.low, fitted.high)
    assert fitted.low <= 2.0 <= fitted.high
