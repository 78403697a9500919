"""Loops among unnamed tags are found from the data, and none is found without a controller."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analyzer.finder.pair import LEAST_LAW_SHARE, SURE_PCT
from analyzer.finder.pairs import found_pairs
from analyzer.loops.spec import read_loops
from analyzer.loops.tags import controller
from benchmarks.world.draw import drawn, run

SAMPLE = Path(__file__).parents[3] / "sample_data"
DT_S = 10.0
NEVER_OPEN = {"TIC2118", "FIC2120"}
"""Loops of the mill whose OP is at a limit all day, or that are not read at all."""


@pytest.fixture(scope="module")
def mill() -> pd.DataFrame:
    """The numeric tags of the last day of the sample mill."""
    table = pd.read_parquet(SAMPLE / "mill.parquet")
    day = table[(table["timestamp"] >= "2026-03-08") & (table["timestamp"] < "2026-03-09")]
    return day.drop(columns="timestamp").select_dtypes("number").ffill().bfill().fillna(0.0)


def unrelated_tags(n: int, count: int, seed: int) -> np.ndarray:
    """Measurements of no loop, shape (n, count): drift, slow noise, oscillations, white noise."""
    rng = np.random.default_rng(seed)
    e, t = rng.normal(size=(n, count)), np.arange(n)
    out = e.copy()
    out[:, ::4] = 0.02 * np.cumsum(e[:, ::4], axis=0)
    for k in range(1, count, 4):
        out[1:, k] = np.convolve(e[:, k], 0.98 ** np.arange(200))[1:n]
    for k in range(2, count, 4):
        out[:, k] = 5.0 * np.sin(2 * np.pi * t / rng.uniform(60, 2000)) + 0.3 * e[:, k]
    return np.round(50.0 + out, 2)


def pi_loop(kp: float, ti_s: float, slope: float, n: int = 6000, seed: int = 1) -> np.ndarray:
    """SP, PV and OP of a PI loop on a lag of 100 s with a drifting load, one sample a second, shape (n, 3)."""
    rng = np.random.default_rng(seed)
    out, load, x, total = np.empty((n, 3)), 0.0, 50.0, 50.0
    for k in range(n):
        load = 0.999 * load + 0.05 * rng.normal()
        sp = 50.0 if k < n / 2 else 53.0
        pv = x + 0.1 * rng.normal()
        total += kp * (sp - pv) / ti_s
        op = kp * (sp - pv) + total
        x += (slope * (op - 50.0) + load + 50.0 - x) / 100.0
        out[k] = sp, pv, op
    return out


def test_the_loops_of_a_renamed_mill_are_found(mill: pd.DataFrame) -> None:
    """Among the shuffled tags of a plant and unrelated tags, at least 70 % of the loops are sure and none is wrong.

    Gains and integral times agree with those of the plant's controllers within 20 %.
    """
    rng = np.random.default_rng(5)
    values = np.column_stack([mill.to_numpy(float), unrelated_tags(len(mill), 20, 5)])
    names = np.array([*mill.columns, *(f"M{k}.X" for k in range(20))])
    order = rng.permutation(len(names))
    names, pairs = names[order], found_pairs(values[:, order])
    sure = [p for p in pairs if p.sure_pct >= SURE_PCT]
    loops = {names[p.op].rpartition(".")[0]: p for p in sure}
    wrong = [(names[p.pv], names[p.op]) for loop, p in loops.items() if names[p.pv] != f"{loop}.PV"]
    assert wrong == []
    assert len(loops) >= 0.7 * (22 - len(NEVER_OPEN))
    right = [names[p.sp] == f"{loop}.SP" for loop, p in loops.items() if p.sp is not None]
    assert all(right)
    assert len(right) >= 0.9 * len(loops)
    stated = {s.loop: s for s in read_loops(SAMPLE / "loops.csv")}
    for loop, pair in loops.items():
        spec = stated[loop]
        span = (spec.pv_hi or 0.0) - (spec.pv_lo or 0.0)
        pid = controller(spec, span)
        if pair.law_share < LEAST_LAW_SHARE or pid is None:
            continue
        assert pair.kp * span / 100.0 == pytest.approx(pid.kp, rel=0.2), loop
        if pair.ti_samples is not None:
            assert pair.ti_samples * DT_S == pytest.approx(pid.ti_s, rel=0.2), loop


@pytest.mark.parametrize("seed", range(25))
def test_no_loop_is_found_among_unrelated_tags(seed: int) -> None:
    """Of forty tags of noise, drift and oscillations no two form a loop, in 25 draws (1,000 tags)."""
    assert [p for p in found_pairs(unrelated_tags(3000, 40, seed)) if p.sure_pct >= SURE_PCT] == []


def test_recordings_without_op_have_no_loop(mill: pd.DataFrame) -> None:
    """PVs of a plant that oscillate together form no loops without an output among them."""
    pvs = mill[[c for c in mill if c.endswith(".PV")]].to_numpy(float)
    assert [p for p in found_pairs(pvs) if p.sure_pct >= SURE_PCT] == []


@pytest.mark.parametrize(("kp", "ti_s", "slope"), [(2.0, 60.0, 0.5), (-2.0, 60.0, -0.5), (0.8, 200.0, 1.5)])
def test_settings_and_sign_come_from_the_law(kp: float, ti_s: float, slope: float) -> None:
    """PV, OP and SP of a loop are distinguished, and its gain, sign and integral time are recovered within 10 %."""
    values = np.column_stack([unrelated_tags(6000, 8, 3), pi_loop(kp, ti_s, slope)])
    best = found_pairs(values)[0]
    assert (best.sp, best.pv, best.op) == (8, 9, 10)
    assert best.sure_pct >= SURE_PCT
    assert best.kp == pytest.approx(kp, rel=0.1)
    assert best.ti_samples == pytest.approx(ti_s, rel=0.1)


def test_units_and_order_change_nothing() -> None:
    """Another unit of PV scales only the gain, and another order of the tags changes no pair."""
    values = np.column_stack([pi_loop(2.0, 60.0, 0.5), unrelated_tags(6000, 6, 4)])
    plain = found_pairs(values)[0]
    turned = found_pairs(values[:, ::-1] * np.array([1.0] * 7 + [9.0, 9.0]))[0]
    last = values.shape[1] - 1
    assert (last - turned.pv, last - turned.op) == (plain.pv, plain.op)
    assert turned.kp * 9.0 == pytest.approx(plain.kp, rel=1e-6)


def test_too_few_data_give_no_loop() -> None:
    """One tag, or a hundred samples, give no loop and no error."""
    assert found_pairs(unrelated_tags(3000, 1, 1)) == []
    assert found_pairs(unrelated_tags(100, 8, 1)) == []


def test_loops_sampled_far_too_slowly_are_not_reversed() -> None:
    """At one sample a minute, the law of loops under load may fit in both directions by chance: no sure loop has the
    wrong direction.
    """
    trends = {(seed, d.name): run(d) for seed in (533, 523) for d in drawn(seed, 4, ("load",))}
    values = np.column_stack([getattr(t, role)[::60] for t in trends.values() for role in ("sp", "pv", "op")])
    sure = [p for p in found_pairs(np.round(values, 3)) if p.sure_pct >= SURE_PCT]
    assert sure
    assert {(p.pv % 3, p.op % 3) for p in sure} == {(1, 2)}
