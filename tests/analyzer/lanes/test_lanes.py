"""Loops that need attention without an oscillation: each lane with its figure, its clause and its action."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.lanes.lanes import FIGURE, in_lanes
from analyzer.loop.action import decided
from analyzer.loop.decisions import Action, Finding, Lane, Remedy, Requirement, RequirementKind, Status
from analyzer.loops.spec import LoopSpec
from analyzer.night import chunk
from analyzer.night.nights import Night
from analyzer.pages.rank import worst_first
from analyzer.store.rows import night_row
from analyzer.words.orders import order
from proofs.plant import CONFIG, START_S, Sketch, series, simulate, spec
from tests.identification.signals import hand_loop

NIGHT = Night("2026-03-02", START_S, START_S + 86400.0)
HOURS = 6


def trends(kp: float = 2.0, seed: int = 0, ramp: float = 0.0) -> dict[str, np.ndarray]:
    """Six hours of a PI loop (lag 60 s, dead time 10 s, Ti 60 s) under a drifting load; OP follows its control law.

    In the third hour the load also moves by a ramp of size `ramp`.
    """
    rng = np.random.default_rng(seed)
    n = HOURS * 3600
    walk = np.convolve(rng.normal(size=n + 599), np.ones(600) / 120.0, "valid")
    walk += ramp * np.clip(np.arange(n) / 3600.0 - 2.0, 0.0, 1.0)
    error = hand_loop.error(kp, 60.0, 60.0, 10, walk, 0.1 * rng.normal(size=n))
    op = 50.0 + kp * (error + np.cumsum(error) / 60.0)
    return {"sp": np.full(n, 50.0), "pv": 50.0 - error, "op": op}


FLOW = spec(kp=2.0, ti=60.0, type="flow")


def row_of(
    values: dict[str, np.ndarray],
    kp: float = 2.0,
    stated: LoopSpec = FLOW,
    every_s: float = 1.0,
    **extra: np.ndarray,
) -> dict[str, object]:
    """The row of one night for a loop with these trends."""
    stamp = START_S + every_s * np.arange(values["pv"].size, dtype=float)
    found = {f"L.{role.upper()}": series(stamp, x) for role, x in {**values, **extra}.items()}
    stated = replace(stated, kp=kp, mode="L.MODE" if "mode" in extra else None)
    kept = chunk.Rows()
    chunk._loop_row(stated, found, NIGHT, CONFIG, True, kept)
    (alone,) = kept.nights
    return night_row(in_lanes(alone, CONFIG.lanes))


def lanes(row: dict[str, object]) -> set[str]:
    """The lanes of a row."""
    return set(str(row["lanes"] or "").split(", ")) - {""}


def test_a_good_loop_is_in_no_lane() -> None:
    """Fast control of a drifting load is in no lane, for four draws of the noise."""
    assert [lanes(row_of(trends(seed=s))) for s in range(4)] == [set()] * 4


def test_a_small_gain_is_sluggish() -> None:
    """At a tenth of the gain, errors of the same loop last several integral times, and the loop is reported as
    sluggish.
    """
    row = row_of(trends(0.2), 0.2)
    assert lanes(row) == {Lane.SLUGGISH}
    assert "sluggish" in str(row["reason"])
    assert row["kp_new"] is None


@pytest.mark.parametrize("ramp", [60.0, -120.0])
def test_a_ramp_of_the_load_is_not_sluggish(ramp: float) -> None:
    """During a ramp of the load the error of any PI loop is constant: a change of throughput makes no loop
    sluggish.
    """
    row = row_of(trends(ramp=ramp))
    memory = row["error_memory_ti"]
    assert isinstance(memory, float)
    assert memory < CONFIG.lanes.error_memory_ti
    assert "sluggish" not in lanes(row)


def test_a_loop_at_its_set_point_is_not_sluggish() -> None:
    """Slow errors of a hundredth of that size, below the resolution of a transmitter, put a loop in no lane."""
    values = trends(0.2)
    small = {"sp": values["sp"], "pv": 50.0 + 0.01 * (values["pv"] - 50.0), "op": values["op"]}
    assert Lane.SLUGGISH not in lanes(row_of(small, 0.2))


def test_a_loop_within_its_noise_is_not_sluggish() -> None:
    """Slow errors below the noise of PV, with samples too far apart for averaging, are not reported as sluggish."""
    values = {role: x[::12] for role, x in trends(0.2).items()}
    noise = np.random.default_rng(1).normal(scale=0.9 * (values["pv"] - 50.0).std(), size=values["pv"].size)
    row = row_of({**values, "pv": values["pv"] + noise}, 0.2, every_s=12.0)
    assert row["error_memory_ti"] is None
    assert Lane.SLUGGISH not in lanes(row)


@pytest.mark.parametrize(("share", "sluggish"), [(0.1, 7), (1.0, 0)])
def test_a_process_that_allows_far_more_gain_is_reported(share: float, sluggish: int) -> None:
    """Of ten temperatures with set point steps, at least seven are sluggish at a tenth of SIMC's gain, and none at
    SIMC's gain.

    Lasting errors and a process that allows more gain are two separate signs.
    """
    found = []
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        gain, late = rng.uniform(0.8, 2.0), rng.uniform(5.0, 25.0)
        lag = late * rng.uniform(8.0, 40.0)
        kp = share * lag / (gain * 2.5 * (late + 1.0))
        ti = lag if share < 1.0 else min(lag, 10.0 * late)
        load = {"load_std": 10 ** rng.uniform(-0.5, 0.5), "load_s": 10 ** rng.uniform(2.0, 3.8)}
        made = simulate(Sketch("none", (gain, lag, late), kp, ti, noise=0.05, moves=3.0, **load), 12.0, seed)
        values = {role: getattr(made, role)[::5] for role in ("sp", "pv", "op")}
        found.append(Lane.SLUGGISH in lanes(row_of(values, kp, spec(type="temperature", ti=ti), 5.0)))
    assert sum(found) >= sluggish if sluggish else not any(found)


def test_compression_is_not_sluggish() -> None:
    """A trend that a historian stores as straight lines is slow because of its recorder, and is not called
    sluggish.
    """
    good = trends()
    kept = np.arange(0, good["pv"].size, 300)
    pv = np.interp(np.arange(good["pv"].size), kept, good["pv"][kept])
    assert Lane.SLUGGISH not in lanes(row_of({**good, "pv": pv}))


def test_a_loop_in_manual_has_its_lane_though_it_is_not_assessed() -> None:
    """A loop in manual all night is not assessed, needs time in automatic, and is in the lane manual."""
    good = trends()
    row = row_of(good, mode=np.zeros(good["pv"].size))
    assert (row["status"], row["action"]) == (Status.NOT_ASSESSED, Action.NEEDS_DATA)
    assert (lanes(row), row["manual_pct"]) == ({Lane.MANUAL}, 100.0)


def test_a_lasting_error_leads_to_a_check_of_the_measurement() -> None:
    """With PV 20 % of span below SP in automatic and OP free, the action is to check the measurement, and the side is
    stated.
    """
    good = trends()
    row = row_of({**good, "sp": good["sp"] + 20.0})
    assert Lane.LASTING_ERROR in lanes(row)
    assert row["lasting_error_pct"] == pytest.approx(20.0, abs=1.0)
    assert row["action"] == Action.CHECK_MEASUREMENT
    assert "below SP" in str(row["reason"])


def test_op_at_its_limit_explains_the_error() -> None:
    """With OP at 100 % all night, the limit explains the lasting error, and no check of the measurement is
    advised.
    """
    good = trends()
    row = row_of({**good, "sp": good["sp"] + 20.0, "op": np.full(good["op"].size, 100.0)})
    assert {Lane.AT_LIMIT, Lane.LASTING_ERROR} <= lanes(row)
    assert row["action"] != Action.CHECK_MEASUREMENT
    assert "upper limit" in str(row["reason"])


def test_a_frozen_measurement_is_reported() -> None:
    """PV that is constant for an hour while OP moves is frozen."""
    good = trends()
    pv = good["pv"].copy()
    pv[7200:10800] = pv[7200]
    row = row_of({**good, "pv": pv})
    assert Lane.FROZEN in lanes(row)
    assert row["frozen_pct"] == pytest.approx(100 / HOURS, abs=2.0)
    assert row["action"] == Action.CHECK_MEASUREMENT


def test_without_op_no_figures_of_op_are_reported() -> None:
    """Without OP the lanes that need OP have empty figures and not zeros."""
    row = row_of({k: v for k, v in trends().items() if k != "op"})
    assert [row[FIGURE[lane]] for lane in (Lane.MANUAL, Lane.AT_LIMIT, Lane.FROZEN, Lane.TRAVEL)] == [
        None
    ] * 4


def made(loop: str, lanes: str, loss: float | None, significance: float = 0.0) -> dict[str, object]:
    """A row with the columns that the list sorts by."""
    figures = {"oscillation_significance": significance, "loss": loss, "importance": loss, "cause": "none"}
    figures |= {"due": None}
    return {"loop": loop, "lanes": lanes or None, **figures}


def test_losses_order_the_list_where_importance_is_stated() -> None:
    """A loop at its limit with the largest loss comes first; a loop without a lane comes last."""
    rows = [
        made("A", "oscillation", 5.0, 40.0),
        made("B", "", 9.0),
        made("C", "at limit, lasting error", 22.0),
    ]
    assert [r["loop"] for r in worst_first(rows)] == ["C", "A", "B"]


def test_without_importance_oscillation_comes_first() -> None:
    """Without importances, oscillating loops come first by significance, then the other lanes, then the rest."""
    rows = [made("A", "manual", None), made("B", "", None), made("C", "oscillation", None, 3.0)]
    assert [r["loop"] for r in worst_first([*rows, made("D", "oscillation", None, 8.0)])] == [
        "D",
        "C",
        "A",
        "B",
    ]


def test_a_failed_loop_has_no_action() -> None:
    """A failed loop has no action, and its reason is unchanged."""
    failed = Finding(
        "L", "2026-03-02", Status.FAILED, Requirement(None, RequirementKind.AS_TOLD, ("ValueError: x",))
    )
    done = night_row(in_lanes(failed, CONFIG.lanes))
    assert (done["action"], done["reason"], done["lanes"]) == (None, "ValueError: x", None)


def test_an_op_at_its_limit_has_an_action():
    """A loop with OP at its limit gets the action `check limit` and not `none`, and its page states what to check."""
    row = {"status": "ok", "action": "none", "cause": "none", "loop": "TIC1", "lanes": "at limit"}
    lanes = (Lane.AT_LIMIT, Lane.LASTING_ERROR)
    idle = Finding("TIC1", "2026-03-02", Status.OK, remedy=Remedy(Action.NONE))
    assert decided(replace(idle, lanes=lanes), False).remedy.action is Action.CHECK_LIMIT
    assert decided(idle, False).remedy.action is Action.NONE
    (_, do), (_, look), _ = order({**row, "action": "check limit"})
    assert "limit" in do
    assert "valve's size" in look
