"""Explanations of simulated loops, fitted directly, without the search for a named effect."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from analyzer.config import Config
from analyzer.explain.case import Case, case
from analyzer.explain.explained import Explained, as_data
from analyzer.explain.models import judged
from analyzer.history.series import Series
from analyzer.loops.spec import LoopSpec
from identification.controller.check import judge
from identification.controller.pi_regression import Trends
from identification.estimation.model import Model, gain
from identification.estimation.prediction_error import descended
from identification.mismatch.answer import answer
from identification.mismatch.baseline import inputs_of, prepared
from identification.mismatch.catalogue import CANDIDATES
from identification.mismatch.diagnosis import controller_finding_of, recorder_finding_of
from identification.mismatch.explanation import Explanation
from identification.mismatch.proof import held_out
from identification.mismatch.selection import Candidate
from identification.models import Backlash, Fopdt, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from identification.simulation.parameters import Slot

N = 2400
START_S = 1_772_409_600.0


def of_loop(width: float, grid: float = 0.01, stated: float = 1.8) -> Case:
    """A loop with backlash of that width, a PV resolution of `grid` %, and a stated gain (1.8 is true)."""
    rng = np.random.default_rng(5)
    sp = 50 + np.repeat(rng.uniform(-7, 7, N // 120), 120)
    load = np.cumsum(rng.normal(0, 0.02, N)) + rng.normal(0, 0.08, N)
    r = closed_loop(Loop(Fopdt(1.2, 20.0, 3.4), Pid(1.8, 20.0), Backlash(width) if width else None), sp, load)
    stamp = START_S + np.arange(N, dtype=float)
    pv = np.round(r.pv / grid) * grid
    trends = {"A.SP": r.sp, "A.PV": pv, "A.OP": np.round(r.op, 2)}
    series = {k: Series(stamp, v, np.zeros(N, dtype=bool)) for k, v in trends.items()}
    spec = LoopSpec(
        "A",
        "<b>feed</b>",
        "flow",
        sp="A.SP",
        pv="A.PV",
        op="A.OP",
        pv_lo=0.0,
        pv_hi=100.0,
        kp=stated,
        ti=20.0,
    )
    return case(spec, (spec,), series, Config())


def with_backlash(found: Explanation, width: float) -> Explanation:
    """The explanation with backlash as its effect."""
    row = next(r for r in CANDIDATES if r.name == "backlash")
    c = found.plain.model.c.copy()
    c[Slot.STICKBAND] = width
    best = descended(found.p, Model((row,), c), 8)
    won = gain(best, found.plain)
    candidate = Candidate(best, won, won - 9.0)
    return Explanation(found.p, found.plain, best, (candidate,), (candidate,), law=found.law)


@cache
def explanation(kind: str) -> Explained:
    """An explanation with that verdict: backlash, none, quantization, controller-settings or unexplained."""
    given = of_loop(2.0 if kind == "backlash" else 0.0, 0.8 if kind == "quantization" else 0.01,
                    1.0 if kind == "controller-settings" else 1.8)  # fmt: skip
    s = given.recording
    assert s.sp is not None
    assert s.stated is not None
    inputs = inputs_of(s)
    p, plain = prepared(inputs, s.pv - inputs.level, s.usable)
    recorder = recorder_finding_of(s) if kind == "quantization" else None
    law = judge(Trends(s.sp, s.pv, s.op, s.usable), s.stated)[1]
    found = Explanation(
        p,
        plain,
        plain,
        recorder=recorder,
        controller=controller_finding_of(s, None)[0] if kind == "controller-settings" else None,
        law=law,
    )
    if kind == "backlash":
        found = with_backlash(found, 1.5)
    if kind == "unexplained":
        found = Explanation(p, plain, plain, residual_nat=99.0)
    found = replace(found, proof=held_out(found.p, found.plain, found.best))
    answered = answer(found, s)
    model = {
        "loop": "A",
        "constants": {"K": 120.0, "T": 20.0, "L": 3.0},
        "level_pv_pct": 50.0,
        "middle_op_pct": 50.0,
    }
    user_model = judged(model, found, s) if kind == "backlash" else None
    return Explained(given, found, answered, as_data(given, answered, user_model), user_model)
