"""Masks on raw stamps, before the analysis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.config import QualityLimits
from analyzer.history.series import Series
from analyzer.loop.record.quality import Prepared, prepare
from identification.errors import NotAssessedError
from proofs.plant import START_S, series, spec

N = 8000
T = np.arange(N, dtype=float)
STAMP = START_S + T
LIMITS = QualityLimits()


def noise(seed: int, n: int = N) -> np.ndarray:
    """White noise of unit variance, shape (n,)."""
    return np.random.default_rng(seed).standard_normal(n)


PV = 50 + 5 * np.sin(T / 200) + 0.5 * noise(1)
OP = 40 + 8 * np.sin(T / 150) + 0.2 * noise(2)
SP = np.full(N, 50.0)


def ready(**changed: Series | None) -> Prepared:
    """A loop without fault; the given tags (sp, pv, op, mode) are replaced, or left out if None."""
    tags = {"sp": series(STAMP, SP), "pv": series(STAMP, PV), "op": series(STAMP, OP), **changed}
    found = {f"L.{role.upper()}": s for role, s in tags.items() if s is not None}
    missing = {role: None for role, s in tags.items() if s is None}
    mode = {"mode": "L.MODE"} if "mode" in changed else {}
    return prepare(spec(**mode, **missing), found, LIMITS)


def where(prepared: Prepared, name: str) -> np.ndarray:
    """Indices at which the named mask is True."""
    return np.flatnonzero(prepared.record.mask(name))


def test_good_trends_are_unchanged():
    """Uniform good samples are unchanged, with no mask set except random short straight lines, and without a note."""
    found = ready()
    assert np.array_equal(found.record.pv, PV)
    assert np.array_equal(found.record.op, OP)
    assert (found.record.start_s, found.record.dt_s, len(found.record)) == (STAMP[0], 1.0, N)
    assert not any(where(found, name).size for name in found.record.masks if name != "compressed")
    assert found.compressed_share < 0.005
    assert found.notes == ()


def test_gap_begins_five_intervals_after_the_last_sample():
    """A value is held for five intervals and is a gap from there to the next sample."""
    kept = (T < 3000) | (T >= 3400)
    found = ready(pv=series(STAMP[kept], PV[kept]))
    assert np.array_equal(where(found, "gap"), np.arange(3005, 3400))
    assert np.array_equal(found.record.bad, found.record.mask("gap"))
    assert np.isfinite(found.record.pv).all()


def test_bad_quality_is_a_gap_sample_by_sample():
    """A bad sample of the historian is a gap at this sample only, and its value is never used."""
    bad = np.zeros(N, dtype=bool)
    bad[[100, 101, 5000]] = True
    found = ready(pv=series(STAMP, np.where(bad, np.nan, PV), bad))
    assert np.array_equal(where(found, "gap"), [100, 101, 5000])
    assert np.isfinite(found.record.pv).all()


def test_gap_of_op_is_a_gap_of_the_loop():
    """If OP is missing, the loop cannot be assessed at these samples either."""
    kept = (T < 3000) | (T >= 3400)
    assert np.array_equal(where(ready(op=series(STAMP[kept], OP[kept])), "gap"), np.arange(3005, 3400))


def test_stale_pv_is_marked_where_op_moves():
    """PV frozen for over an hour while OP moves is stale, exactly as long as it is frozen."""
    frozen = np.where((T >= 2000) & (T < 6000), PV[2000], PV)
    found = ready(pv=series(STAMP, frozen))
    assert np.array_equal(where(found, "stale"), np.arange(2000, 6000))
    assert "stale 50 % of the time" in found.notes


def test_constant_pv_is_not_stale_while_op_is_constant():
    """A constant PV with a constant OP is a plant at rest."""
    frozen = np.where((T >= 2000) & (T < 6000), PV[2000], PV)
    still = np.where((T >= 1900) & (T < 6100), 40.0, OP)
    assert not where(ready(pv=series(STAMP, frozen), op=series(STAMP, still)), "stale").size


def test_short_standstill_is_not_stale():
    """A PV that is constant for twenty minutes is not yet stale."""
    assert not where(ready(pv=series(STAMP, np.where((T > 2000) & (T < 3200), 50.0, PV))), "stale").size


def test_straight_segments_are_compressed():
    """Samples between the break points of a compressed trend lie on straight lines and are marked."""
    knots = np.arange(0, N, 20)
    found = ready(pv=series(STAMP, np.interp(T, T[knots], PV[knots])))
    inner = np.setdiff1d(np.arange(1, knots[-1]), knots)
    assert np.isin(inner, where(found, "compressed")).mean() > 0.99
    assert found.compressed_share > 0.9
    assert any("straight segments" in note for note in found.notes)


@pytest.mark.parametrize("step", [0.25, 1.0])
def test_resolution_is_found(step):
    """A trend on a grid is quantized with a known step; a trend without a grid has no step."""
    found = ready(pv=series(STAMP, step * np.round(PV / step)))
    assert found.pv_step == pytest.approx(step)
    assert found.record.mask("quantized").all()
    assert ready().pv_step == 0.0


def test_coarse_steps_are_not_taken_for_compression():
    """Level steps of a coarse grid are not taken for compression."""
    assert ready(pv=series(STAMP, np.round(PV))).compressed_share < 0.05


def test_saturated_within_two_percent_of_a_limit():
    """OP within 2 % of 0 or 100 is saturated at these samples and at no others."""
    op = np.clip(50 + 60 * np.sin(T / 300), 0, 100)
    assert np.array_equal(ready(op=series(STAMP, op)).record.mask("saturated"), (op <= 2) | (op >= 98))


def test_limits_follow_the_stated_range():
    """With OP from 4 to 20 mA the limits are those of this range."""
    op = np.clip(12 + 9 * np.sin(T / 300), 4, 20)
    tags = {"L.SP": series(STAMP, SP), "L.PV": series(STAMP, PV), "L.OP": series(STAMP, op)}
    found = prepare(spec(op_lo=4.0, op_hi=20.0), tags, LIMITS)
    assert found.record.op == pytest.approx((op - 4) / 16 * 100)
    assert np.array_equal(found.record.mask("saturated"), (found.record.op <= 2) | (found.record.op >= 98))


@pytest.mark.parametrize(
    "op",
    [0.5 + 0.3 * np.sin(T / 150), 5 * np.sin(T / 150) - 20, 130 + 5 * np.sin(T / 150)],
    ids=["fractions", "deviations", "beyond"],
)
def test_op_outside_its_range_is_not_saturated(op):
    """An OP recorded from 0 to 1, as a deviation, or beyond 100 has unknown limits, and a note says so."""
    found = ready(op=series(STAMP, op))
    assert not where(found, "saturated").size
    assert any("state op_lo and op_hi" in note for note in found.notes)


@pytest.mark.parametrize(
    ("by_hand", "automatic"), [("MAN", "AUTO"), ("Manual", "Cas"), ("man", "aut"), ("IMAN", "RCAS")]
)
def test_mode_texts(by_hand, automatic):
    """A mode text for manual applies from the stamp of its change to the stamp of the next one."""
    stamp = START_S + np.array([0.0, 1000.5, 2500.0])
    texts = np.array([automatic, by_hand, automatic], dtype=object)
    mode = Series(stamp, np.full(3, np.nan), np.zeros(3, dtype=bool), texts)
    assert np.array_equal(where(ready(mode=mode), "manual"), np.arange(1001, 2500))


def test_mode_numbers():
    """A numeric mode is manual where it is 0."""
    value = np.where((T >= 1000) & (T < 2000), 0.0, 1.0)
    assert np.array_equal(where(ready(mode=series(STAMP, value)), "manual"), np.arange(1000, 2000))


def test_unknown_mode_texts_are_not_used():
    """With unknown mode texts the loop is in manual only if OP shows it."""
    mode = Series(STAMP[:1], np.full(1, np.nan), np.zeros(1, dtype=bool), np.array(["SHUT"], dtype=object))
    frozen = np.where((T >= 2000) & (T < 5000), 40.0, OP)
    assert not where(ready(mode=mode), "manual").size
    assert np.array_equal(where(ready(mode=mode, op=series(STAMP, frozen)), "manual"), np.arange(2000, 5000))


def test_frozen_op_is_manual_where_the_error_moves():
    """OP that is constant for half an hour while the error moves is manual; a shorter constant span is not."""
    half = np.where((T >= 2000) & (T < 4000), 40.0, OP)
    short = np.where((T >= 2000) & (T < 3000), 40.0, OP)
    assert np.array_equal(where(ready(op=series(STAMP, half)), "manual"), np.arange(2000, 4000))
    assert not where(ready(op=series(STAMP, short)), "manual").size


def test_op_that_is_constant_at_a_limit_is_saturated_and_not_manual():
    """A controller that is wound up at its limit does not move OP, and is not in manual."""
    found = ready(op=series(STAMP, np.where((T >= 2000) & (T < 6000), 100.0, OP)))
    assert np.array_equal(where(found, "saturated"), np.arange(2000, 6000))
    assert not where(found, "manual").size


def test_missing_set_point_is_estimated_and_reported():
    """Without SP the median of PV replaces it, and the notes say so."""
    found = ready(sp=None)
    assert found.record.sp_estimated
    assert found.record.sp == pytest.approx(np.full(N, np.median(PV)))
    assert "no SP recorded: estimated as the median of PV" in found.notes


def test_missing_op_is_reported():
    """Without OP the notes say that no cause can be identified."""
    assert "no OP recorded: no cause can be identified" in ready(op=None).notes


def test_unstated_range_is_the_recorded_one_and_reported():
    """Without a PV range, percent refers to the 0.5 to 99.5 % quantiles of PV, and the notes say so."""
    tags = {"L.SP": series(STAMP, SP), "L.PV": series(STAMP, PV), "L.OP": series(STAMP, OP)}
    found = prepare(replace(spec(), pv_lo=None, pv_hi=None), tags, LIMITS)
    assert np.quantile(found.record.pv, [0.005, 0.995]) == pytest.approx([0, 100])
    assert "no PV range stated: percent of the recorded range" in found.notes


def test_irregular_stamps_are_placed_on_a_grid():
    """Stamps with a jitter of 0.2 s are placed on a grid of one second with the values that were logged last."""
    jitter = np.random.default_rng(3).uniform(-0.2, 0.2, N)
    found = ready(pv=series(STAMP + jitter, PV)).record
    assert found.dt_s == pytest.approx(1.0, abs=0.01)
    assert not found.bad[1:].any()  # the first tick may lie before the first sample of OP
    clock = found.start_s + found.dt_s * np.arange(len(found))
    last = [PV[np.flatnonzero(STAMP + jitter <= c + 0.01 * found.dt_s)[-1]] for c in clock[::97]]
    assert found.pv[::97] == pytest.approx(last)


def test_tags_of_different_intervals_use_the_grid_of_pv():
    """A set point logged on change and an OP logged every ten seconds are held on the grid of PV."""
    sp = series(START_S + np.array([0.0, 4000.0]), np.array([50.0, 55.0]))
    op = series(STAMP[::10], OP[::10])
    found = ready(sp=sp, op=op).record
    assert found.op == pytest.approx(np.repeat(OP[::10], 10)[:N])
    assert found.sp[[0, 3999, 4000, N - 1]] == pytest.approx([50, 50, 55, 55])


def test_empty_ends_are_cut():
    """A record begins and ends with a good PV."""
    bad = (T < 500) | (T >= 7000)
    found = ready(pv=series(STAMP, np.where(bad, np.nan, PV), bad)).record
    assert (found.start_s, len(found)) == (STAMP[500], 6500)


@pytest.mark.parametrize(
    ("pv", "text"),
    [
        (None, "no PV tag L.PV in the export"),
        (series(STAMP[:0], PV[:0]), "needs PV samples, has none that is good"),
        (
            series(STAMP, np.full(N, np.nan), np.ones(N, dtype=bool)),
            "needs PV samples, has none that is good",
        ),
        (series(STAMP[:1], PV[:1]), "needs 200 good PV samples, has 1"),
        (series(STAMP[:199], PV[:199]), "needs 200 good PV samples, has 199"),
    ],
    ids=["no tag", "empty", "all NaN", "one sample", "short"],
)
def test_too_little_data_is_reported_with_need_and_present_count(pv, text):
    """A record that cannot be assessed states what it needs and what it has."""
    tags = {} if pv is None else {"L.PV": pv}
    with pytest.raises(NotAssessedError) as error:
        prepare(spec(), tags, LIMITS)
    assert str(error.value) == text


def test_a_frozen_pv_stays_frozen_when_op_is_at_its_limit():
    """A PV that is exactly constant for a quarter of a day, away from its set point, with OP at its limit, is frozen.

    A PV that is constant at the end of its own range, or that has noise, is not frozen.
    """
    stamp = np.arange(0.0, 30_000.0, 5.0)
    op, sp = series(stamp, np.full(stamp.size, 100.0)), series(stamp, np.full(stamp.size, 50.0))

    def stale(pv: np.ndarray) -> int:
        return where(ready(pv=series(stamp, pv), op=op, sp=sp), "stale").size

    noise = np.random.default_rng(0).normal(0.0, 0.05, stamp.size)
    assert stale(np.full(stamp.size, 43.2)) == stamp.size
    assert stale(np.full(stamp.size, 0.0)) == 0
    assert stale(43.2 + noise) == 0
