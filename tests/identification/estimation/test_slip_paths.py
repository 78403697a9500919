"""Stems reconstructed slip by slip: the beam search against all paths, friction that scatters, and backlash,
which has no slips."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.stats import norm

from identification.estimation.backlash_stiction import fit_backlash, fit_linear, fit_stick_slip
from identification.estimation.irregular_slips import fit_irregular
from identification.estimation.noise import generic_noise
from identification.estimation.problem import in_blocks
from identification.estimation.slip_beam import (
    SCATTER,
    STUCK,
    Noise,
    Response,
    SlipDistances,
    decoded,
    log_chance,
    slip_chance,
)
from identification.record import Floats
from identification.simulation.lag import Lag

POLE, DELAY, GAIN = 0.7, 2, 1.5
BREAKAWAY, SLIDING, NOISE = 1.0, 0.2, 0.02


def chance_of(op: Floats, slips: tuple[int, ...], start: float) -> tuple[float, Floats]:
    """Log probability of slips at some samples, and the stem, computed with the normal distribution of scipy."""
    scatter = SCATTER * BREAKAWAY
    stem, out, farthest, total = start, np.empty(op.size), {True: 0.0, False: 0.0}, 0.0
    for k, u in enumerate(op):
        up, far = u > stem, abs(u - stem)
        if k > 0 and far > BREAKAWAY * (1 - 3.5 * SCATTER) and far > farthest[up]:
            survived = norm.sf(farthest[up], BREAKAWAY, scatter)
            stays = norm.sf(far, BREAKAWAY, scatter) / survived
            if k in slips:
                total += math.log(max(1.0 - stays, 1e-300))
                stem, farthest = u - math.copysign(SLIDING, u - stem), {True: 0.0, False: 0.0}
            else:
                total += math.log(max(stays, 1e-12))
                farthest[up] = far
        elif k in slips:
            return -math.inf, out
        out[k] = stem
    return total, out


def responded(stem: Floats) -> Floats:
    """PV without noise: a lag and a delay, step by step."""
    x, pv = stem[0], np.empty(stem.size)
    for k in range(stem.size):
        pv[k] = GAIN * x
        x = POLE * x + (1 - POLE) * stem[max(k - DELAY, 0)]
    return pv


def test_the_path_is_the_most_probable_of_all():
    """On a short record the reconstructed path is the most probable of all paths with up to four slips, and so
    is its score."""
    rng = np.random.default_rng(3)
    op = 1.25 * np.sin(np.arange(26) * 0.5)
    start = op[0] - BREAKAWAY
    possible = [k for k in range(1, op.size) if abs(op[k]) > 0.2]
    truth = max(
        (chance_of(op, slips, start) for n in (3, 4) for slips in itertools.combinations(possible, n)),
        key=lambda found: found[0],
    )[1]
    pv = responded(truth) + NOISE * rng.standard_normal(op.size)

    def worth(slips: tuple[int, ...]) -> tuple[float, Floats]:
        chance, stem = chance_of(op, slips, start)
        e = pv - responded(stem) - (pv[0] - responded(stem)[0]) * POLE ** np.arange(op.size)
        return chance - 0.5 * float((e[1:] ** 2).sum()) / NOISE**2, stem

    every = [worth(s) for n in range(5) for s in itertools.combinations(possible, n)]
    best, stem = max(every, key=lambda found: found[0])
    r = Response(Lag(POLE, 1 - POLE, 0.0, DELAY), GAIN, np.zeros(op.size))
    counts = np.arange(op.size) > 0
    noise = Noise(np.zeros(1), NOISE**2)
    found, score = decoded(op, pv, counts, r, noise, SlipDistances(BREAKAWAY, SLIDING, 1000), 200)
    assert score >= best - 1e-6  # the search also allows other first positions
    np.testing.assert_allclose(np.flatnonzero(np.diff(found)), np.flatnonzero(np.diff(stem)))
    np.testing.assert_allclose(found[5:], stem[5:], atol=1e-12)


def test_chance_of_slips_is_that_of_a_normal_threshold():
    """The probability of a slip between two distances is the normal one, and that of a path is the product of
    these."""
    at = np.linspace(0.85, 1.2, 8)
    for farthest, far in itertools.pairwise(at):
        wanted = 1.0 - norm.sf(far, 1.0, SCATTER) / norm.sf(farthest, 1.0, SCATTER)
        assert slip_chance(far, farthest, 1.0) == pytest.approx(wanted, rel=1e-6)
    op = 1.4 * np.sin(np.arange(60) * 0.3)
    stem, slips = 0.0, []
    for k in range(1, op.size):
        if abs(op[k] - stem) > BREAKAWAY:
            stem = op[k] - math.copysign(SLIDING, op[k] - stem)
            slips.append(k)
    total, path = chance_of(op, tuple(slips), 0.0)
    assert len(slips) >= 5
    assert log_chance(op, path, BREAKAWAY) == pytest.approx(total, abs=1e-6)


def test_a_stem_that_rests_too_long_is_penalised():
    """A stem that rests longer than allowed has a fixed penalty each time, so a path that moves is preferred."""
    op = 1.05 * np.sin(np.arange(200) * 0.1)
    r = Response(Lag(POLE, 1 - POLE, 0.0, DELAY), GAIN, np.zeros(op.size))
    every, noise = np.ones(op.size, dtype=bool), Noise(np.zeros(1), 1.0)
    _, free = decoded(op, np.zeros(op.size), every, r, noise, SlipDistances(BREAKAWAY, SLIDING, 1000), 50)
    _, held = decoded(op, np.zeros(op.size), every, r, noise, SlipDistances(BREAKAWAY, SLIDING, 40), 50)
    assert held <= free
    assert free - held < 6 * STUCK


def oscillating(scatter: float, seed: int, n: int = 4000) -> tuple[Floats, Floats]:
    """PV and OP, each (n,), of an integrating vessel with a stem that slips at 1.5 %, with a relative scatter.

    Backlash where the scatter is 0. In plain Python, without code of the simulator.
    """
    rng = np.random.default_rng(seed)
    slope, dead, kp, ti = 0.1, 3, 0.8, 40.0
    stem, x, total, op, limit = 50.0, 3.0, 50.0, 50.0, 1.5
    pipe, pv_out, op_out = [50.0] * dead, np.empty(n), np.empty(n)
    for k in range(n):
        pv = 50.0 + x + 0.04 * rng.standard_normal()
        total += kp * (50.0 - pv) / ti
        op = total + kp * (50.0 - pv)
        pv_out[k], op_out[k] = pv, op
        if scatter == 0.0:
            stem = min(max(stem, op - 1.1), op + 1.1)
        elif abs(op - stem) > limit:
            stem = op - math.copysign(0.7, op - stem)
            limit = 1.5 * (1.0 + scatter * rng.standard_normal())
        pipe.append(stem)
        x += slope * (pipe.pop(0) - 50.0)
    return np.round(pv_out, 2), np.round(op_out, 2)


def fitted(scatter: float, seed: int):
    """The fits of backlash and of a slip path for such a loop, without its first quarter."""
    pv, op = (x[1000:] for x in oscillating(scatter, seed))
    problem = in_blocks(pv, np.ascontiguousarray(op), np.ones(pv.size, dtype=bool), 1.0)
    crossings = int((np.diff(np.sign(op - op.mean())) != 0).sum())
    period = 2.0 * op.size / max(crossings, 1)
    period = max(period, 40.0)
    backlash = fit_backlash(fit_linear(problem, period), period)
    return backlash, fit_irregular(backlash, generic_noise(), period)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_friction_that_scatters_is_recovered(seed):
    """Slips that scatter by 5 % give the stickband within 10 % and the jump within 35 %, and also the process."""
    backlash, path = fitted(0.05, seed)
    assert path is not None
    assert path.log_likelihood > backlash.log_likelihood + 20.0
    assert path.fit.valve.stickband == pytest.approx(2.2, rel=0.1)
    assert path.fit.valve.slip_jump == pytest.approx(0.8, rel=0.35)
    assert path.fit.dead_time_s == pytest.approx(3.0, abs=1.0)
    assert path.fit.slope == pytest.approx(0.1, rel=0.3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_backlash_has_no_slips(seed):
    """Backlash, which never jumps, is not reported as friction with scattering slips."""
    _, path = fitted(0.0, seed)
    assert path is None


@pytest.mark.parametrize("seed", [1, 2])
def test_a_square_pv_of_a_fast_flow_is_not_backlash(seed):
    """The friction of a valve in a fast flow loop, logged every 10 s, is recovered within 15 %. A backlash
    model needs three times the true gain for this PV."""
    rng = np.random.default_rng(seed)
    kp, ti, x, total, stem, load = 0.3, 50.0, 53.0, 50.0, 50.0, 0.0
    pipe, pv_out, op_out = [50.0] * 4, [], []
    for k in range(10 * 3600):
        load = 0.9995 * load + 0.006 * rng.standard_normal()
        pv = x + 0.05 * rng.standard_normal()
        total += kp * (50.0 - pv) / ti
        op = total + kp * (50.0 - pv)
        if k % 10 == 0:
            pv_out.append(round(pv, 2))
            op_out.append(round(op, 2))
        if abs(op - stem) > 5.5:
            stem = op - math.copysign(0.5, op - stem)
        pipe.append(stem)
        x += (1.0 - math.exp(-1.0 / 12.0)) * (50.0 + 1.1 * (pipe.pop(0) + load - 50.0) - x)
    pv, op = np.array(pv_out[100:]), np.array(op_out[100:])
    problem = in_blocks(pv, op, np.ones(pv.size, dtype=bool), 10.0)
    backlash = fit_backlash(fit_linear(problem, 300.0), 300.0)
    assert backlash.gain > 3.0 * 1.1
    path = fit_irregular(backlash, generic_noise(), 300.0)
    assert path is not None
    assert path.log_likelihood > backlash.log_likelihood + 1000.0
    assert path.fit.gain == pytest.approx(1.1, rel=0.25)
    assert path.fit.valve.stickband == pytest.approx(6.0, rel=0.15)


def test_a_jump_of_nearly_the_stickband_is_recovered():
    """A stem that jumps by 0.9 of its stickband has its stickband recovered within 5 % and its gain within 20
    %. A backlash model is 40 % wider and has a gain 50 % higher."""
    rng = np.random.default_rng(4)
    static, kinetic, kp, ti, n = 5.16, 0.27, 2.6, 10.0, 7200
    stem, x, total, load, pipe, pv, op = 50.0, 2.0, 50.0, 0.0, [50.0] * 4, np.empty(n), np.empty(n)
    for k in range(n):
        load += -load / 400.0 + 0.03 * rng.standard_normal()
        pv[k] = round(50.0 + x + 0.03 * rng.standard_normal(), 3)
        total += kp * (50.0 - pv[k]) / ti
        op[k] = round(total + kp * (50.0 - pv[k]), 3)
        if abs(op[k] - stem) > static:
            stem = op[k] - math.copysign(kinetic, op[k] - stem)
        pipe.append(stem)
        x += (1.0 - math.exp(-1.0 / 57.0)) * (1.4 * (pipe.pop(0) + load - 50.0) - x)
    pv, op = pv[1800:], np.ascontiguousarray(op[1800:])  # the oscillation has reached its full amplitude
    problem = in_blocks(pv, op, np.ones(pv.size, dtype=bool), 1.0)
    backlash = fit_backlash(fit_linear(problem, 92.0), 92.0)
    assert backlash.valve.stickband > 1.4 * (static + kinetic)
    assert backlash.gain > 1.5 * 1.4
    found = fit_stick_slip(backlash, 92.0)
    assert found.valve.stickband == pytest.approx(static + kinetic, rel=0.05)
    assert found.gain == pytest.approx(1.4, rel=0.2)
