"""Valve and lag fitted to trends whose process and valve are known."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from identification.estimation.backlash_stiction import (
    better_linear,
    fit_backlash,
    fit_linear,
    fit_stick_slip,
)
from identification.estimation.evidence import evidence
from identification.estimation.gauss_newton import descend, innovations
from identification.estimation.problem import Problem, Stems, block_means, in_blocks, stem_blocks
from identification.models import Backlash, Fopdt, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from identification.simulation.lag import respond, unit_lag
from identification.simulation.valve import HALTS, RESTS, SLIDES, StemLaw, first_slip, sticking, walk
from tests.identification.slow_responses import pv_of

N = 3000


def steps(seed: int, n: int = N) -> np.ndarray:
    """OP that moves to a new value about every half minute [% OP], shape (n,)."""
    rng = np.random.default_rng(seed)
    moves = (rng.random(n) < 1 / 30) * rng.normal(0.0, 3.0, n)
    return 50 + np.cumsum(moves) - np.linspace(0, moves.sum(), n)


def problem_of(process: Fopdt, valve: Backlash | None, seed: int, noise: float = 0.1) -> Problem:
    """An open loop under a moving OP with white noise on PV."""
    op = steps(seed)
    pv = pv_of(process, valve, op, 1.0) + noise * np.random.default_rng(seed + 1).standard_normal(N)
    return in_blocks(pv, op, np.ones(N, dtype=bool), 1.0)


@pytest.mark.parametrize(
    "process",
    [Fopdt(2.0, 30.0, 5.0), Fopdt(-0.8, 12.0, 3.4), Fopdt(1.5, 90.0, 12.0)],
    ids=["lag", "negative gain", "slow"],
)
def test_process_is_recovered(process):
    """Gain is recovered within 3 %, time constant within 5 % and dead time within 0.3 s, in an open loop with
    noise."""
    for seed in (1, 2, 3):
        fit = fit_linear(problem_of(process, None, seed), 120.0)
        assert fit.gain == pytest.approx(process.gain, rel=0.03)
        assert fit.time_constant_s == pytest.approx(process.time_constant_s, rel=0.05)
        assert fit.dead_time_s == pytest.approx(process.dead_time_s, abs=0.3)


def test_noise_level_is_recovered():
    """The innovations variance of a fit is the variance of the added noise within 8 %."""
    fit = fit_linear(problem_of(Fopdt(2.0, 30.0, 5.0), None, 4, noise=0.2), 120.0)
    assert fit.loss == pytest.approx(0.04, rel=0.08)


@pytest.mark.parametrize("seed", range(5))
def test_ideal_valve_gives_no_evidence_of_backlash(seed):
    """Behind an ideal valve the evidence of backlash is below 5 nats, under half of the limit for a verdict."""
    w = problem_of(Fopdt(2.0, 30.0, 5.0), None, 10 + seed)
    linear = fit_linear(w, 120.0)
    found = fit_backlash(linear, 120.0)
    assert evidence(found, better_linear(linear, found)) < 5.0


@pytest.mark.parametrize("width", [1.0, 2.5, 5.0])
def test_width_of_backlash_is_recovered(width):
    """Backlash of 1 to 5 % under a moving OP is recovered within 0.1 %, with an evidence above 100 nats."""
    w = problem_of(Fopdt(2.0, 30.0, 5.0), Backlash(width), 20)
    linear = fit_linear(w, 120.0)
    found = fit_backlash(linear, 120.0)
    assert found.valve.stickband == pytest.approx(width, abs=0.1)
    assert evidence(found, better_linear(linear, found)) > 100


def test_backlash_is_recovered_from_its_limit_cycle():
    """In closed loop, where OP depends on PV, the backlash of the study's loop (1 %) is recovered within 2 %."""
    loop = Loop(Fopdt(80.0, 200.0, 1.0), Pid(1.0, 10.0), Backlash(1.0))
    noise = 0.05 * np.random.default_rng(30).standard_normal(N)
    noise[5:] += 1.0  # a step of the load: without it the stem would never cross its backlash
    record = closed_loop(loop, np.full(N, 50.0), noise)
    w = in_blocks(record.pv, record.op, np.ones(N, dtype=bool), 1.0)
    found = fit_backlash(fit_linear(w, 38.0), 38.0)
    assert found.valve.stickband == pytest.approx(1.0, rel=0.02)
    assert found.slope == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize("free_width", [False, True], ids=["width held", "width free"])
def test_descent_never_increases_the_innovations(free_width):
    """From every start, the descent ends with innovations that are not larger than those at the start."""
    w = problem_of(Fopdt(2.0, 30.0, 5.0), Backlash(2.0), 40)
    first = fit_linear(w, 120.0)
    rng = np.random.default_rng(41)
    for _ in range(12):
        moved = first.moved(
            gain=first.gain * rng.uniform(0.2, 3),
            time_constant_s=first.time_constant_s * 10 ** rng.uniform(-1, 1),
            dead_time_s=rng.uniform(0, 30),
            valve=sticking(rng.uniform(0.3, 6), rng.uniform(0, 1)),
        )
        start = replace(moved, ar=first.ar * rng.uniform(0, 1))
        end = descend(start, free_width)
        before, after = (float(np.mean(innovations(fit) ** 2)) for fit in (start, end))
        assert after <= before * (1 + 1e-9)
        assert end.loss == pytest.approx(after, rel=1e-6)


def test_evidence_of_a_fit_over_itself_is_zero():
    """A fit has no evidence over itself."""
    w = problem_of(Fopdt(2.0, 30.0, 5.0), None, 50)
    fit = fit_linear(w, 120.0)
    assert evidence(fit, fit) == 0.0


def test_unusable_samples_do_not_count():
    """Wrong values at unusable samples change neither gain nor time constant by more than the scatter."""
    w = problem_of(Fopdt(2.0, 30.0, 5.0), None, 60)
    y, usable = w.pv.copy(), np.ones(N, dtype=bool)
    y[1000:1200], usable[1000:1200] = 500.0, False
    fit = fit_linear(in_blocks(y, w.blocks.op, usable, 1.0), 120.0)
    assert fit.gain == pytest.approx(2.0, rel=0.04)
    assert fit.time_constant_s == pytest.approx(30.0, rel=0.06)


def test_lag_agrees_with_a_slow_implementation():
    """The kernel's lag with a whole dead time equals the textbook recursion, sample by sample."""
    stem = steps(70, 200) - 50
    pole = np.exp(-1 / 20)
    y, slow = 0.0, []
    for k in range(200):
        slow.append(y)
        y = pole * y + (1 - pole) * stem[max(k - 4, 0)]
    assert respond(stem, unit_lag(20.0, 4.0, 1.0)) == pytest.approx(np.array(slow), abs=1e-9)


def test_stem_in_blocks_is_the_mean_of_the_stem():
    """Stem positions of blocks are means of the stem computed sample by sample, for every motion of the stem."""
    op = steps(80, 1200) + np.cumsum(np.random.default_rng(81).normal(0, 0.1, 1200))
    blocks = op.reshape(200, 6)
    stems = Stems(op[None], blocks.min(1)[None], blocks.max(1)[None], np.empty(0), np.empty(0), 6)
    for constants in product((0.4, 1.0, 4.0), (0.2, 0.4), (RESTS, HALTS, SLIDES, 0.15)):
        law = StemLaw(*constants)
        slow = walk(op, law, first_slip(op, law))
        quick = stem_blocks(stems, law)
        assert quick == pytest.approx(block_means(slow, 6))


class KanoValve:
    """Stick-slip by the rules of Kano (2004), computed from OP's stops and reversals instead of distances."""

    def __init__(self, stickband: float, jump: float) -> None:
        self.stickband, self.jump = stickband, jump
        self.stem, self.stopped_at, self.way, self.moving, self.last = 0.0, 0.0, 1.0, False, 0.0

    def follow(self, u: float) -> float:
        """Stem [% OP] for the next OP [% OP]."""
        if self.moving and (u - self.last) * self.way < 0:
            self.moving, self.stopped_at = False, self.last
        if not self.moving:
            gone = (u - self.stopped_at) * self.way
            if gone > self.jump or -gone > self.stickband:
                self.way = self.way if gone > 0 else -self.way
                self.moving = True
        if self.moving:
            self.stem = u - self.way * (self.stickband - self.jump) / 2
        self.last = u
        return self.stem


def oscillating_tank(seed: int, stickband: float, jump: float, slope: float = 0.1) -> Problem:
    """A tank under PI control with such a valve. PV is simulated in tenths of a scan, and OP is recorded with a
    step of 0.05 %."""
    rng = np.random.default_rng(seed)
    n, dead = 1800, 3
    valve, level, total = KanoValve(stickband, jump), 3.0, 0.0
    path, pv, op = [0.0] * (dead * 10 + 1), np.empty(n), np.empty(n)
    for k in range(n):
        pv[k] = level + rng.normal(0, 0.03)
        total -= pv[k] / 25.0
        op[k] = np.round(1.5 * (total - pv[k]) / 0.05) * 0.05
        stem = valve.follow(op[k])
        for _ in range(10):
            path.append(stem)
            level += 0.1 * slope * path[-dead * 10 - 1]
    return in_blocks(pv, op, np.ones(n, dtype=bool), 1.0)


@pytest.mark.parametrize("jump", [1.22, 2.02])
def test_stick_slip_is_recovered_from_its_limit_cycle(jump):
    """Stickband, jump and slope of an oscillating tank are recovered within 3, 10 and 10 %, with more
    likelihood than any backlash."""
    tank = oscillating_tank(3, 2.43, jump)
    linear = fit_linear(tank, 60.0)
    backlash = fit_backlash(linear, 60.0)
    found = fit_stick_slip(backlash, 60.0)
    assert found.valve.stickband == pytest.approx(2.43, rel=0.03)
    assert found.valve.slip_jump == pytest.approx(jump, rel=0.1)
    assert found.slope == pytest.approx(0.1, rel=0.1)
    assert found.log_likelihood > backlash.log_likelihood + 20


def test_descent_and_innovations_agree():
    """The innovations of a fit's residual have the variance that the descent reports, in blocks of eight
    samples."""
    rng = np.random.default_rng(2)
    op = 50 + np.cumsum(rng.normal(0, 0.2, 8 * 600))
    pv = block_means(respond(op - 50, unit_lag(300.0, 12.0, 1.0)), 8) + rng.normal(0, 0.05, 600) + 3.0
    for fine in (False, True):
        data = in_blocks(pv, op, np.ones(600, dtype=bool), 8.0, 8, fine=fine)
        for fit in (fit_linear(data, 400.0), fit_backlash(fit_linear(data, 400.0), 400.0)):
            assert float(np.mean(innovations(fit) ** 2)) == pytest.approx(fit.loss, rel=1e-6)
    process = fit_linear(data, 400.0).process
    assert process.time_constant_s == pytest.approx(300.0, rel=0.05)
    assert process.dead_time_s == pytest.approx(12.0, abs=2.0)
