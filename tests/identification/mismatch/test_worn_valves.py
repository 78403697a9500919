"""Worn valves as they are: friction that differs from slip to slip, seen through coarse grids and few samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.controller.check import Finding, StatedSettings
from identification.estimation.model import Fitted, Model
from identification.estimation.prediction_error import descended
from identification.estimation.problem import Problem, problem
from identification.mismatch.answer import Answer, answer
from identification.mismatch.candidate_proof import runs_out
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.diagnosis import explain, without_the_idle
from identification.mismatch.explanation import Explanation
from identification.mismatch.friction import simulated_anew
from identification.mismatch.plain_loop import inputs_of
from identification.mismatch.proof import HeldOut, Misfit
from identification.mismatch.recording import Recording, SeenInCycles
from identification.mismatch.selection import Candidate, applies
from identification.mismatch.starts import Round
from identification.models import Fopdt, Stiction
from identification.record import Floats
from identification.simulation.open_loop import as_parameters, simulate
from identification.simulation.parameters import Slot
from tests.identification.recordings import BACKLASH, recording

N, GAIN, LAG, DEAD, STUCK, JUMP = 4000, 1.5, 20, 4, 3.0, 2.0


def worn_loop(seed: int, scatter: float, stuck: float = STUCK) -> tuple[Floats, Floats]:
    """PV and OP [%], shape (N,) each, of a PI loop with a stem that lets go at another force each time.

    Written out step by step, with none of the estimator's own code: the stem holds until OP is a stickband away,
    jumps, and holds again; each stickband and jump is drawn anew.
    """
    rng = np.random.default_rng(seed)
    stem, pv, total = 50.0, 50.0, 50.0
    pipe = [50.0] * DEAD
    hold, leap, load = stuck, JUMP / STUCK * stuck, 0.0
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
            hold = stuck * rng.uniform(1 - scatter, 1 + scatter)
            leap = JUMP / STUCK * hold
        pipe.append(stem)
        pv += (50.0 + GAIN * (pipe.pop(0) - 50.0) - pv) / LAG
        out[:, k] = seen, op
    return out[0], out[1]


def seen_valve(agreeing: float = 0.8, stuck: float = STUCK) -> SeenInCycles:
    """What a night's verdict would bring along, not quite right."""
    valve = Stiction(1.1 * stuck, 0.5 * stuck)
    return SeenInCycles(Fopdt(1.2 * GAIN, 1.2 * LAG, DEAD), valve, 100, agreeing, 80.0)


def recorded(
    seed: int, scatter: float, grid: float, cycles: SeenInCycles | None, stuck: float = STUCK
) -> Recording:
    """The loop as recorded in steps of a grid."""
    pv, op = worn_loop(seed, scatter, stuck)
    pv, op = np.round(pv / grid) * grid, np.round(op, 2)
    stamp = np.arange(N, dtype=np.float64)
    return Recording(None, pv, op, np.ones(N, dtype=bool), 1.0, stamp, cycles=cycles)


def told(s: Recording) -> Answer:
    """The answer for a recording."""
    return answer(explain(s), s)


def test_coarse_grid_does_not_hide_a_jump() -> None:
    """A grid of 0.2 % hides no jump of 3 %: the valve is named, the grid beside it."""
    said = told(recorded(1, 0.3, 0.2, seen_valve()))
    assert said.verdict in ("stiction", "backlash")
    assert [e.name for e in said.effects][-1] == "quantization"
    assert "stretches between OP reversals" in said.shown


def test_grid_alone_is_named_where_the_valve_is_free() -> None:
    """A sound valve behind the same grid gets no fault."""
    said = told(recorded(2, 0.0, 0.2, None, stuck=0.0))
    assert {e.block for e in said.effects} <= {"sensor", "load"}
    assert said.verdict == "quantization"


def test_free_valve_is_asked_for_no_friction() -> None:
    """Where the cycles convict no valve, no effect of friction is tried, and all others are."""
    s = recorded(3, 0.3, 0.01, None)
    p = problem(inputs_of(s), s.pv - s.pv.mean(), s.usable)
    near = Fitted(p, Model((), as_parameters(Fopdt(GAIN, LAG, DEAD))), 1.0, N, np.zeros(3), np.zeros(N))
    asked = {
        free: {r.name for e in EFFECTS.values() for r in e.candidates if applies(x, r)}
        for free in (False, True)
        for x in [Round(p, near, replace(s, free_valve=free))]
    }
    friction = {name for name, e in EFFECTS.items() if e.friction is not None}
    assert asked[False] - asked[True] == friction


def test_unseen_scans_leave_the_inverse_response_open() -> None:
    """A controller that answers within a sample looks like a PV that goes the wrong way first: not asked there."""
    s = recorded(4, 0.3, 0.01, None)
    assert s.every_scan
    assert not replace(s, dt_s=5.0).every_scan


def as_problem(seed: int, scatter: float) -> Problem:
    """The recording as the fits see it."""
    s = recorded(seed, scatter, 0.01, None)
    inputs = inputs_of(s)
    return problem(inputs, s.pv - inputs.level, s.usable)


def parts_left(p: Problem, simulated: Floats, window: int) -> float:
    """Standard deviation of what a simulation leaves about a line in each window."""
    left = p.y - simulated
    parts = np.array_split(left, left.size // window)
    own = [x - np.polyval(np.polyfit(np.arange(x.size), x, 1), np.arange(x.size)) for x in parts]
    return float(np.concatenate(own).std())


@pytest.mark.parametrize("seed", [5, 6])
def test_stem_placed_anew_follows_a_worn_valve(seed: int) -> None:
    """From where the stem stood, the right constants follow a cycle that they lose when run over hours."""
    p, c = as_problem(seed, 0.3), as_parameters(Fopdt(GAIN, LAG, DEAD), Stiction(STUCK, JUMP))
    window = 80
    open_run, anew = simulate(p.inputs, c), simulated_anew(p, c, window)
    free = simulate(p.inputs, as_parameters(Fopdt(GAIN, LAG, DEAD)))
    assert parts_left(p, anew, window) < 0.8 * parts_left(p, open_run, window)
    assert parts_left(p, anew, window) < 0.8 * parts_left(p, free, window)


def test_stem_is_left_alone_without_friction() -> None:
    """Without friction there is no stem to place: the simulation is the usual one to the last bit."""
    p, c = as_problem(7, 0.0), as_parameters(Fopdt(GAIN, LAG, DEAD))
    np.testing.assert_array_equal(simulated_anew(p, c, 80), simulate(p.inputs, c))


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
    """A constant at the far end of its range asks for another name; one near zero, or within, does not."""
    p = as_problem(8, 0.0)
    row = EFFECTS[name].candidates[0]
    c = as_parameters(Fopdt(GAIN, LAG, DEAD))
    for q in row.params:
        c[q.slot] = 5.0 if q.log else -0.5
    c[slot] = value if name != "saturation" else float(p.inputs.op.max())
    assert runs_out(p, Fitted(p, Model((row,), c), 1.0, N, np.zeros(3), np.zeros(N))) is out


def test_play_that_a_valve_in_good_order_has_is_no_finding() -> None:
    """A play of 2 % is named; of the same recording, with an OP and a play a fortieth as large, no valve's fault."""
    s = recording(11, BACKLASH)
    assert told(s).verdict == "backlash"
    fine = replace(s, op=50.0 + (s.op - 50.0) / 40.0, stated=StatedSettings(1.8 / 40.0, 20.0))
    assert not {e.name for e in told(fine).effects} & {"backlash", "stiction", "positioner"}


@pytest.mark.parametrize(("fit_pct", "carries"), [(-20.0, False), (0.0, False), (30.0, True)])
def test_less_far_astray_is_no_proof(fit_pct: float, carries: bool) -> None:
    """A model that leaves more than PV's own motion proves nothing by leaving less than a worse one."""
    plain, better = Misfit(2.0, -100.0), Misfit(1.0, fit_pct)
    constants = np.zeros(3), np.zeros(3)
    assert HeldOut(5.0, (plain, better), (plain, better), (plain, better), constants).carries is carries


@pytest.mark.parametrize(
    ("gain", "held", "carries"),
    [(2.5, 1.03, False), (3.5, 1.03, True), (50.0, 1.03, True), (50.0, 1.4, False)],
)
def test_what_is_seen_ahead_has_to_simulate_as_well_as_a_plain_loop(
    gain: float, held: float, carries: bool
) -> None:
    """An effect that removes no held-out misfit stands where innovations show it plainly and it loses nothing."""
    plain, drawn, better = Misfit(1.0, 20.0), Misfit(0.9, 25.0), Misfit(held, 20.0)
    constants = np.zeros(3), np.zeros(3)
    assert HeldOut(gain, (plain, drawn), (plain, better), (plain, drawn), constants).carries is carries


def test_idle_effect_goes_again() -> None:
    """An effect taken before the one that makes it idle is given up once that one is there; the other stays."""
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
    left = without_the_idle(Explanation(p, fit, fit, tuple(taken)), 0)
    assert [c.name for c in left.accepted] == ["backlash"] == list(left.best.names)


@pytest.mark.parametrize(
    ("name", "first"), [("backlash", False), ("inverse-response", False), ("load-step", True)]
)
def test_grid_yields_to_what_lasts_and_not_to_a_load(name: str, first: bool) -> None:
    """An effect of valve or process that the grid cannot hide stands before it; a load says nothing against it."""
    p = as_problem(10, 0.0)
    plain = Fitted(p, Model((), as_parameters(Fopdt(GAIN, LAG, DEAD))), 1.0, N, np.zeros(3), np.zeros(N))
    row = EFFECTS[name].candidates[0]
    best = Fitted(p, Model((row,), plain.model.c), 0.5, N, np.zeros(3), np.zeros(N))
    grid = Finding({"step_pct": 0.2}, np.ones(N, dtype=bool), "quantization")
    found = Explanation(p, plain, best, (Candidate(best, 20.0, 10.0),), recorder=grid)
    assert (found.finding is grid) is first
