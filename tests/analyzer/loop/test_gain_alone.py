"""A level under gain alone with a moving set point: its valve gets no fault, and its lasting error is not
reported.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.decisions import Action, Cause, Fault
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import match
from analyzer.night.chunk import assess_loop

N, EVERY = 43_200, 10


def level(seed: int, kp: float, slope: float) -> pd.DataFrame:
    """Twelve hours of a vessel under a gain alone, with a drifting load and a set point that moves every hour."""
    rng, pole = np.random.default_rng(seed), math.exp(-1.0 / 1800.0)
    sp = 50.0 + np.repeat(rng.uniform(-5.0, 5.0, N // 3600), 3600)
    drive, noise = rng.standard_normal(N) * 8.0 * math.sqrt(1.0 - pole**2), 0.03 * rng.standard_normal(N)
    pv, op, y, load, u = np.empty(N), np.empty(N), 50.0, 0.0, 50.0
    for k in range(N):
        load = pole * load + drive[k]
        y += slope * (u - 50.0 - load)
        pv[k] = y + noise[k]
        op[k] = u = min(max(50.0 + kp * (sp[k] - pv[k]), 0.0), 100.0)
    time = pd.Timestamp("2026-03-02", tz="UTC") + pd.to_timedelta(np.arange(0, N, EVERY), unit="s")
    signals = {"L.SP": sp, "L.PV": pv, "L.OP": op}
    return pd.DataFrame({"timestamp": time, **{k: v[::EVERY].round(3) for k, v in signals.items()}})


@pytest.mark.parametrize(("seed", "kp", "slope"), [(1, -2.4, -7e-4), (2, -3.5, -1.5e-3)])
def test_a_gain_alone_gives_no_valve_fault(tmp_path, seed, kp, slope):
    """A level without fault under gain alone has no valve fault, no settings and no action."""
    (tmp_path / "trends").mkdir()
    level(seed, kp, slope).to_parquet(tmp_path / "trends" / "trends.parquet")
    export, config = open_export([tmp_path / "trends"]), Config()
    row = LoopSpec("L", type="level", kp=kp, ti=0.0, pv_lo=0.0, pv_hi=100.0, scan_s=1.0)
    (spec,), *_ = match([row], export.tags)
    found, advice = assess_loop(spec, prepare(spec, export.read(spec.tags), config.quality), config)
    assert (found.verdict.cause, found.verdict.fault) == (Cause.NONE, Fault.NONE)
    assert (advice.action, found.settings) == (Action.NONE, None)
