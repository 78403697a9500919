"""Valves with friction that differs from slip to slip, recorded with coarse grids and few samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.controller.check import Finding, StatedSettings
from identification.estimation.model import Fitted, Model
from identification.estimation.prediction_error import descended
from identification.estimation.problem import Problem, problem
from identification.mismatch.answer import Answer, answer
from identification.mismatch.baseline import inputs_of
from identification.mismatch.candidate_proof import runs_out
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.diagnosis import explain, without_redundant
from identification.mismatch.explanation import Explanation
from identification.mismatch.friction import simulated_reestimated
from identification.mismatch.proof import HeldOut, Misfit
from identification.mismatch.recording import Recording, SeenInCycles
from identification.mismatch.selection import Candidate, applies
from identification.mismatch.starts import Round
from identification.models import Fopdt, Stiction
from identification.record import Floats
from identification.simulation.open_loop import as_parameters, simulate
from identification.simulation.parameters import Slot
from tests.identification.recordings import BACKLASH, recording

N, GAIN, LAG, DEAD, STICKBAND, JUMP = 4000, 1.5, 20, 4, 3.0, 2.0


def sticking_loop(seed: int, scatter: float, stickband: float = STICKBAND) -> tuple[Floats, Floats]:
    """PV and OP [%], each shape (N,), of a PI loop whose stem slips at a different force each time.

    In plain Python, without code of the estimator: the stem rests until OP is a stickband away, jumps, and
    rests again. Each stickband and jump is drawn at random.
    """
    rng = np.random.default_rng(seed)
    stem, pv, total = 50.0, 50.0, 50.0
    pipe = [50.0] * DEAD
    hold, leap, load = stickband, JUMP / STICKBAND * stickband, 0.0
    out = np.empty((2, N))
    for k in range(N):
        load += -load / 60 + rng.normal(0.0, 0.04)
        seen = pv + load + rng.normal(0.0, 0.08)
        e = 50.0 - seen
        total += 0.8 * e / 20.0
        op = 0.8 * e + total
        away = op - stem
        if abs(away) > 0.5 * (hold + leap):
            stem = op - np.sign(away) * 0.5 * (hold - leap)
            hold = stickband * rng.uniform(1 - scatter, 1 + scatter)
            leap = JUMP / STICKBAND * hold
        pipe.append(stem)
        pv += (50.0 + GAIN * (pipe.pop(0) - 50.0) - pv) / LAG
        out[:, k] = seen, op
    return out[0], out[1]


def seen_valve(agreeing: float = 0.8, stickband: float = STICKBAND) -> SeenInCycles:
    """The valve of a night's verdict, with some errors."""
    valve = Stiction(1.1 * stickband, 0.5 * stickband)
    return SeenInCycles(Fopdt(1.2 * GAIN, 1.2 * LAG, DEAD), valve, 100, agreeing, 80.0)


def recorded(
    seed: int, scatter: float, grid: float, cycles: SeenInCycles | None, stickband: float = STICKBAND
) -> Recording:
    """The loop as recorded in steps of a grid."""
    pv, op = sticking_loop(seed, scatter, stickband)
    pv, op = np.round(pv / grid) * grid, np.round(op, 2)
    stamp = np.arange(N, dtype=np.float64)
    return Recording(None, pv, op, np.ones(N, dtype=bool), 1.0, stamp, cycles=cycles)


def answer_for(s: Recording) -> Answer:
    """The answer for a recording."""
    return answer(explain(s), s)


def test_coarse_grid_does_not_hide_a_jump() -> None:
    """A grid of 0.2 % does not hide a jump of 3 %: the valve is reported, and the grid in addition."""
    found = answer_for(recorded(1, 0.3, 0.2, seen_valve()))
    assert found.verdict in ("stiction", "backlash")
    assert [e.name for e in found.effects][-1] == "quantization"
    assert "stretches between OP reversals" in found.shown


def test_grid_alone_is_named_where_the_valve_is_free() -> None:
    """A valve without friction recorded with the same grid has no fault, and the grid is reported."""
    found = answer_for(recorded(2, 0.0, 0.2, None, stickband=0.0))
    assert {e.block for e in found.effects} <= {"sensor", "load"}
    assert found.verdict == "quantization"


def test_no_friction_is_tried_for_a_free_valve() -> None:
    """If the oscillation shows no valve fault, no effect of friction is tried, and all other effects are."""
    s = recorded(3, 0.3, 0.01, None)
    p = problem(inputs_of(s), s.pv - s.pv.mean(), s.usable)
    near = Fitted(p, Model((), as_parameters(Fopdt(GAIN, LAG, DEAD))), 1.0, N, np.zeros(3), np.zeros(N))
    tried = {
        free: {r.name for e in EFFECTS.values() for r in e.candidates if applies(x, r)}
        for free in (False, True)
        for x in [Round(p, near, replace(s, free_valve=free))]
    }
    friction = {name for name, e in EFFECTS.items() if e.friction is not None}
    assert tried[False] - tried[True] == friction


def test_unrecorded_scans_exclude_the_inverse_response() -> None:
    """A recording of 1 s has every scan, and one of 5 s does not. A controller that responds within a sample
    looks like an inverse response."""
    s = recorded(4, 0.3, 0.01, None)
    assert s.every_scan
    assert not replace(s, dt_s=5.0).every_scan


def as_problem(seed: int, scatter: float) -> Problem:
    """The recording as the fits use it."""
    s = recorded(seed, scatter, 0.01, None)
    inputs = inputs_of(s)
    return problem(inputs, s.pv - inputs.level, s.usable)


def residual_in_windows(p: Problem, simulated: Floats, window: int) -> float:
    """Standard deviation of the residual of a simulation about a straight line in each window."""
    kept = p.y - simulated
    parts = np.array_split(kept, kept.size // window)
    own = [x - np.polyval(np.polyfit(np.arange(x.size), x, 1), np.arange(x.size)) for x in parts]
    return float(np.concatenate(own).std())


@pytest.mark.parametrize("seed", [5, 6])
def test_stem_with_known_positions_follows_a_sticking_valve(seed: int) -> None:
    """With the stem position known at each window, the right constants follow an oscillation. Without it they
    lose the oscillation over hours."""
    p, c = as_problem(seed, 0.3), as_parameters(Fopdt(GAIN, LAG, DEAD), Stiction(STICKBAND, JUMP))
    window = 80
    open_run, placed = simulate(p.inputs, c), simulated_reestimated(p, c, window)
    free = simulate(p.inputs, as_parameters(Fopdt(GAIN, LAG, DEAD)))
    assert residual_in_windows(p, placed, window) < 0.8 * residual_in_windows(p, open_run, window)
    assert residual_in_windows(p, placed, window) < 0.8 * residual_in_windows(p, free, window)


def test_simulation_without_friction_is_unchanged() -> None:
    """Without friction there is no stem position to set, and the simulation is identical to the usual one."""
    p, c = as_problem(7, 0.0), as_parameters(Fopdt(GAIN, LAG, DEAD))
    np.testing.assert_array_equal(simulated_reestimated(p, c, 80), simulate(p.inputs, c))


@pytest.mark.parametrize(
    ("name", "slot", "value", "out"),
    [
        ("inverse-response", Slot.SHARE, -4.99, True),
        ("inverse-response", Slot.SHARE, -0.001, False),
        ("flow-dependent-delay", Slot.PIPE, 3.0, True),
        ("flow-dependent-delay", Slot.PIPE, 0.3, False),
        ("saturation", Slot.STOP_HI, 0.0, False),
    ],
)
def test_constant_at_its_far_end_is_no_finding(name: str, slot: Slot, value: float, out: bool) -> None:
    """An effect with a constant at the far end of its range is rejected; a constant near zero or inside the
    range is accepted."""
    p = as_problem(8, 0.0)
    row = EFFECTS[name].candidates[0]
    c = as_parameters(Fopdt(GAIN, LAG, DEAD))
    for q in row.params:
        c[q.slot] = 5.0 if q.log else -0.5
    c[slot] = value if name != "saturation" else float(p.inputs.op.max())
    assert runs_out(p, Fitted(p, Model((row,), c), 1.0, N, np.zeros(3), np.zeros(N))) is out


def test_backlash_of_a_good_valve_is_no_finding() -> None:
    """Backlash of 2 % is reported. A backlash of a fortieth of this, with an OP scaled in the same way, is not
    reported as a valve fault."""
    s = recording(11, BACKLASH)
    assert answer_for(s).verdict == "backlash"
    fine = replace(s, op=50.0 + (s.op - 50.0) / 40.0, stated=StatedSettings(1.8 / 40.0, 20.0))
    assert not {e.name for e in answer_for(fine).effects} & {"backlash", "stiction", "positioner"}


@pytest.mark.parametrize(("fit_pct", "carries"), [(-20.0, False), (0.0, False), (30.0, True)])
def test_a_smaller_error_without_a_fit_is_no_proof(fit_pct: float, carries: bool) -> None:
    """A model with a residual larger than PV's own variation is not accepted, although it is better than a
    worse model."""
    plain, better = Misfit(2.0, -100.0), Misfit(1.0, fit_pct)
    constants = np.zeros(3), np.zeros(3)
    assert HeldOut(5.0, (plain, better), (plain, better), (plain, better), constants).carries is carries


@pytest.mark.parametrize(
    ("gain", "held", "carries"),
    [(2.5, 1.03, False), (3.5, 1.03, True), (50.0, 1.03, True), (50.0, 1.4, False)],
)
def test_an_effect_proved_by_prediction_simulates_as_well_as_the_baseline(
    gain: float, held: float, carries: bool
) -> None:
    """An effect that removes no held-out misfit is accepted only if the innovations show it clearly and its
    simulation is no worse."""
    plain, drawn, better = Misfit(1.0, 20.0), Misfit(0.9, 25.0), Misfit(held, 20.0)
    constants = np.zeros(3), np.zeros(3)
    assert HeldOut(gain, (plain, drawn), (plain, better), (plain, drawn), constants).carries is carries


def test_idle_effect_is_removed() -> None:
    """An effect that becomes idle after another effect is added is removed, and the other effect stays."""
    s = recording(9, BACKLASH)
    inputs = inputs_of(s)
    p = problem(inputs, s.pv - inputs.level, s.usable)
    rows = {name: EFFECTS[name].candidates[0] for name in ("backlash", "gain-drift")}
    fit = descended(p, Model((), as_parameters(Fopdt(1.2, 20.0, 3.4))), 20)
    taken = []
    for name, value in (("gain-drift", 0.01), ("backlash", BACKLASH.width)):
        c = fit.model.c.copy()
        c[rows[name].params[0].slot] = value
        fit = descended(p, Model((*fit.model.added, rows[name]), c), 20)
        taken.append(Candidate(fit, 0.0, 0.0))
    kept = without_redundant(Explanation(p, fit, fit, tuple(taken)), 0)
    assert [c.name for c in kept.accepted] == ["backlash"] == list(kept.best.names)


@pytest.mark.parametrize(
    ("name", "first"), [("backlash", False), ("inverse-response", False), ("load-step", True)]
)
def test_grid_is_second_to_a_valve_or_process_effect_and_not_to_a_load(name: str, first: bool) -> None:
    """An effect of valve or process that the grid cannot hide is reported before the grid. A load is not."""
    p = as_problem(10, 0.0)
    plain = Fitted(p, Model((), as_parameters(Fopdt(GAIN, LAG, DEAD))), 1.0, N, np.zeros(3), np.zeros(N))
    row = EFFECTS[name].candidates[0]
    best = Fitted(p, Model((row,), plain.model.c), 0.5, N, np.zeros(3), np.zeros(N))
    grid = Finding({"step_pct": 0.2}, np.ones(N, dtype=bool), "quantization")
    found = Explanation(p, plain, best, (Candidate(best, 20.0, 10.0),), recorder=grid)
    assert (found.finding is grid) is first
