"""A misfit is located at its true feature, not at correlated features, and nowhere on white noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from statsmodels.stats.multitest import multipletests

from identification.mismatch.location import (
    Located,
    at_limits,
    block_products,
    chances,
    directions,
    least_turn,
    located,
    part_of_range,
    piecewise_linear_basis,
    turns,
)

N = 4000
MEMORY = 25


def trends(seed: int, n: int = N) -> tuple[np.ndarray, np.ndarray]:
    """OP that varies slowly about 50 %, and PV that follows it with a lag and its own noise."""
    rng = np.random.default_rng(seed)
    op = 50 + lfilter([1.0], [1.0, -0.99], rng.normal(0, 1, n))
    return 1.2 * lfilter([0.05], [1.0, -0.95], op) + rng.normal(0, 0.5, n), op


def at(e: np.ndarray, pv: np.ndarray, op: np.ndarray) -> Located:
    """The location without a dead time."""
    return located(e, pv, op, np.ones(e.size, dtype=bool), 1.0, 0, MEMORY)


def names(found: Located) -> list[str]:
    """Names of the features that carry the misfit."""
    return [f.name for f in found.carrying]


def test_white_noise_is_located_nowhere() -> None:
    """At most 5 of 100 draws of white noise are located at a feature."""
    pv, op = trends(1, 1500)
    assert (
        sum(bool(at(np.random.default_rng(s).normal(0, 1, 1500), pv, op).carrying) for s in range(100)) <= 5
    )


def fed_back(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """White innovations, and PV and OP of a PI loop that they drive in addition to set-point steps."""
    rng = np.random.default_rng(seed)
    e, sp = rng.normal(0, 1, N), np.repeat(rng.normal(0, 5, N // 160), 160)
    pv, op = np.zeros(N), np.zeros(N)
    total = x = load = 0.0
    for k in range(N):
        load = 0.9 * load + e[k]
        pv[k] = x + 0.3 * load
        total += (sp[k] - pv[k]) / 20
        op[k] = 1.5 * (sp[k] - pv[k] + total)
        x = 0.95 * x + 0.06 * op[k]
    return e, 50 + pv, np.clip(50 + op, 0, 100)


def test_innovations_of_a_closed_loop_are_located_nowhere() -> None:
    """Under feedback, where OP responds to earlier noise, the innovations of at most 3 of 40 loops are located
    at a feature."""
    assert sum(bool(at(*fed_back(seed)).carrying) for seed in range(40)) <= 3


def test_residual_above_an_op_is_located_there() -> None:
    """A residual that is larger where OP was above 60 % is located at OP above 57 to 63 %, and not at PV."""
    pv, op = trends(2)
    e = np.random.default_rng(3).normal(0, 1, N) * np.where(np.roll(op, 2) > 60, 2.0, 1.0)
    found = at(e, pv, op)
    assert found.features[0].name == "op_level"
    assert "pv_level" not in names(found)
    low, _ = found.features[0].range
    assert 57 < low < 63


def test_residual_above_a_pv_is_located_at_pv() -> None:
    """A residual that is larger above a PV is located at PV, although OP is correlated with it."""
    pv, op = trends(4)
    e = np.random.default_rng(5).normal(0, 1, N) * np.where(np.roll(pv, 2) > np.quantile(pv, 0.8), 2.0, 1.0)
    assert at(e, pv, op).features[0].name == "pv_level"


def test_bias_by_direction_is_located_at_the_direction() -> None:
    """A bias that changes its sign with OP's direction is located at the direction, by sign and not by power."""
    pv, op = trends(6)
    way = np.roll(turns(op, least_turn(op))[0], 2)
    first = at(np.random.default_rng(7).normal(0, 1, N) + 0.4 * way, pv, op).features[0]
    assert (first.name, first.by) == ("op_direction", "sign")


def test_residual_after_reversals_is_located_there() -> None:
    """A bias against OP's direction within ten samples after an OP reversal is located at the time since the
    reversal."""
    pv, op = trends(8)
    way, since = (np.roll(x, 2) for x in turns(op, least_turn(op)))
    e = np.random.default_rng(9).normal(0, 1, N) - 0.8 * way * (since < 10)
    first = at(e, pv, op).features[0]
    assert first.name == "after_reversals"
    low, _ = first.range
    assert low < 10


def test_late_residual_is_located_at_time() -> None:
    """A residual that is larger in the last fifth of the record is located at time."""
    pv, op = trends(10)
    e = np.random.default_rng(11).normal(0, 1, N) * np.where(np.arange(N) > 0.8 * N, 1.8, 1.0)
    assert at(e, pv, op).features[0].name == "time_in_record"


def test_scale_and_masked_samples_change_nothing() -> None:
    """Residuals a thousand times as large, or with extreme values at masked samples, are located at the same
    features."""
    pv, op = trends(12)
    e = np.random.default_rng(13).normal(0, 1, N) * np.where(np.roll(op, 2) > 55, 1.6, 1.0)
    judged = np.ones(N, dtype=bool)
    judged[500:600] = False
    with_extremes = np.where(judged, 1000 * e, 1e9)
    one, two = (located(x, pv, op, judged, 1.0, 0, MEMORY) for x in (e, with_extremes))
    assert [(f.name, f.p) for f in one.features] == [(f.name, f.p) for f in two.features]


def test_short_record_is_not_located() -> None:
    """A record shorter than ten settling times has no features."""
    pv, op = trends(14, 200)
    assert at(np.random.default_rng(15).normal(0, 1, 200), pv, op).features == ()


def test_reversals_are_those_of_a_triangle() -> None:
    """OP up 4, down 4 and up again reverses where it has moved back far enough, and ripples are no reversals."""
    op = np.array([0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2, 1.8, 2, 3.0])
    way, since = turns(op, 0.5)
    np.testing.assert_array_equal(way, [0, 1, 1, 1, 1, -1, -1, -1, -1, 1, 1, 1, 1, 1])
    np.testing.assert_array_equal(since[4:10], [3, 0, 1, 2, 3, 0])


def test_reversals_use_no_later_samples() -> None:
    """Later samples of OP change neither the direction nor the time since the reversal."""
    _, op = trends(18)
    whole, part = turns(op, 1.0), turns(op[:1000], 1.0)
    np.testing.assert_array_equal(whole[0][:1000], part[0])
    np.testing.assert_array_equal(whole[1][:1000], part[1])


def test_block_products_agree_with_a_slow_implementation() -> None:
    """Products of reordered blocks equal those of reordered arrays."""
    rng = np.random.default_rng(19)
    x, y, order = rng.normal(0, 1, (60, 3)), rng.normal(0, 1, (60, 2)), rng.permutation(6)
    moved = np.concatenate([y.reshape(6, 10, 2)[i] for i in order])
    fast = block_products(x, y, 6)[np.arange(6), order].sum(axis=0)
    np.testing.assert_allclose(fast, x.T @ moved, atol=1e-12)


def test_directions_are_orthogonal_to_other_groups() -> None:
    """The directions of a group are orthogonal to all other groups. A copy of another group adds none."""
    rng = np.random.default_rng(20)
    a, b = rng.normal(0, 1, (500, 2)), rng.normal(0, 1, (500, 1))
    own, duplicate, free = directions([a, a.copy(), b + a[:, :1]])
    assert own.shape[1] == duplicate.shape[1] == 0
    np.testing.assert_allclose(free.T @ (a - a.mean(axis=0)), 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("height", "run"), [([0, 0, 5, 6, 0, 4], (2, 3)), ([1, 1, 1, 1], None), ([1, 9], None)]
)
def test_part_of_range_is_the_longest_high_run(height: list[float], run: tuple[int, int] | None) -> None:
    """The reported part of a range is the longest run of high values. A constant profile has none."""
    assert part_of_range(np.array(height, dtype=float)) == run


def test_limits_and_piecewise_linear_basis() -> None:
    """OP at 100 % or constant at its own extreme is at a limit; a test signal between two values is not."""
    op = np.concatenate(([50.0, 100, 100, 60, 70, 40, 40, 40], np.arange(45.0, 60.0)))
    np.testing.assert_array_equal(at_limits(op)[:9], [0, 1, 1, 0, 0, 1, 1, 1, 0])
    assert not at_limits(np.repeat([40.0, 60.0, 40.0], 5)).any()
    assert piecewise_linear_basis(np.full(50, 3.0)).shape == (50, 0)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_p_values_of_independent_features_agree_with_sidak(seed: int) -> None:
    """For eight independent features, two of which act, the corrected p-values are those of statsmodels' correction
    after Sidak within .08: 400 permutations have a standard error of .03."""
    rng = np.random.default_rng(seed)
    bases = [np.linalg.qr(rng.standard_normal((4000, 2)))[0] for _ in range(8)]
    y = rng.standard_normal((4000, 2))
    y[:, 0] += np.sqrt(4000) * (0.045 * bases[1][:, 0] + 0.065 * bases[2][:, 0])
    y = (y - y.mean(axis=0)) / y.std(axis=0)
    alone = [chances([basis], y, 40)[0][0] for basis in bases]
    corrected = multipletests(np.minimum(alone, 1.0 - 1e-9), method="sidak")[1]
    assert chances(bases, y, 40)[0] == pytest.approx(corrected, abs=0.08)
