"""Before and after: verdicts are right if something changed, and rare if nothing changed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.comparison.before_after import HOUR_S, compare, follows, grade, reasons_against
from analyzer.comparison.block_bootstrap import Side, difference, drift_factor, replicates
from analyzer.comparison.measures import LIMITS, MEASURES, ChangeVerdict, Span, gridded, spans_around
from proofs.honesty import examined

CHANGED_S = 1000 * 86400.0
WEEK = 168


def hours(factor: float = 1.0, seed: int = 0, **after: float) -> dict[str, np.ndarray]:
    """Two weeks of hourly figures with noise; in the second week they are `factor` times as large."""
    rng = np.random.default_rng(seed)
    later = np.arange(2 * WEEK) >= WEEK
    found = {"hour_s": CHANGED_S + HOUR_S * (np.arange(2 * WEEK) - WEEK), "usable_h": np.ones(2 * WEEK)}
    for m in MEASURES:
        found[m.name] = np.where(later, factor, 1.0) * 10 * np.exp(0.1 * rng.normal(size=2 * WEEK))
    level = {"sp_mean_pct": 50.0, "pv_mean_pct": 50.0, "op_mean_pct": 40.0, "normal_pct": 100.0}
    for name, value in {**level, "sp_travel_pct": 0.0, "at_limits_pct": 0.0}.items():
        found[name] = np.where(later, after.get(name, value), value)
    return found


def compared(found: dict[str, np.ndarray]) -> list[ChangeVerdict]:
    """Verdicts on the four primary figures."""
    return [c.verdict for c in compare("L", found, *spans_around(CHANGED_S, 7)).primary]


def test_halved_figures_are_better() -> None:
    """If all four figures halve, each is called better, and each interval contains the true change."""
    found = compare("L", hours(0.5), *spans_around(CHANGED_S, 7))
    assert [c.verdict for c in found.primary] == [ChangeVerdict.BETTER] * 4
    assert grade(found) == "clear"
    for change in found.primary:
        low, high = change.interval_pct or (0.0, 0.0)
        assert low < -50.0 < high


def test_doubled_figures_are_worse() -> None:
    """Figures that double are called worse."""
    assert compared(hours(2.0)) == [ChangeVerdict.WORSE] * 4


def test_service_is_better_when_higher() -> None:
    """A higher effective service factor is better, not worse."""
    found = compare("L", hours(1.5), *spans_around(CHANGED_S, 7))
    service = next(c for c in found.changes if c.measure.name == "service_pct")
    assert service.verdict is ChangeVerdict.BETTER


def test_small_improvements_are_modest() -> None:
    """An improvement of 10 % in all four figures is found and called modest."""
    assert grade(compare("L", hours(0.9), *spans_around(CHANGED_S, 7))) == "modest"


@pytest.mark.parametrize(
    ("column", "value", "fragment"),
    [
        ("sp_mean_pct", 60.0, "set point"),
        ("pv_mean_pct", 60.0, "PV level"),
        ("op_mean_pct", 55.0, "load"),
        ("normal_pct", 60.0, "automatic"),
        ("sp_travel_pct", 8.0, "set point travel"),
        ("at_limits_pct", 30.0, "limit"),
    ],
)
def test_incomparable_spans_are_not_counted(column: str, value: float, fragment: str) -> None:
    """A week with another set point, level, load, mode, set point travel or time at limits gives no verdict, with the
    reason.
    """
    found = compare("L", hours(0.5, **{column: value}), *spans_around(CHANGED_S, 7))
    assert {c.verdict for c in found.changes} == {ChangeVerdict.INCOMPARABLE}
    assert any(fragment in reason for reason in found.reasons)
    assert grade(found) == "incomparable"


def test_a_loop_that_oscillated_to_its_limits_is_compared() -> None:
    """OP at a limit for 30 % of the time does not prevent a comparison if the loop oscillated all that week."""
    found = hours(0.5)
    found["at_limits_pct"][:WEEK] = 30.0
    found["oscillating_pct"][:WEEK] = 100.0
    assert compare("L", found, *spans_around(CHANGED_S, 7)).reasons == ()
    found["oscillating_pct"][:WEEK] = 0.0
    assert compare("L", found, *spans_around(CHANGED_S, 7)).reasons != ()


def test_too_little_time_is_not_counted() -> None:
    """Two days after a change are too few, and the text states the number of days."""
    found = hours(0.5)
    cut = {k: v[: WEEK + 48] for k, v in found.items()}
    result = compare("L", cut, *spans_around(CHANGED_S, 7))
    assert result.reasons == ("too little time after: needs 3 usable days, has 2.0",)


def test_days_that_round_to_the_minimum_are_enough() -> None:
    """71.9 usable hours are reported as 3.0 days, and 3 days are enough."""
    found = hours(0.5)
    found["usable_h"][WEEK + 1 :] = 71.9 / (WEEK - 1)
    limits = replace(LIMITS, usable_share=0.0)
    assert compare("L", found, *spans_around(CHANGED_S, 7), limits=limits).reasons == ()


def test_gaps_are_left_out_of_the_means() -> None:
    """Hours without a figure or without usable time do not change a mean."""
    found = hours(1.0)
    name = "valve_travel_pct_per_h"
    found[name][10:30] = np.nan
    found["usable_h"][40:50] = 0.0
    found[name][40:50] = 1e6
    side = gridded(found, Span(CHANGED_S - WEEK * HOUR_S, CHANGED_S), name)
    kept = np.r_[0:10, 30:40, 50:WEEK]
    assert side.mean == pytest.approx(found[name][kept].mean())


def test_means_weigh_usable_time() -> None:
    """An hour that is half usable has half the weight."""
    side = Side(np.array([1.0, 4.0]), np.array([1.0, 0.5]))
    assert side.mean == pytest.approx(2.0)


def test_other_changes_end_the_spans() -> None:
    """Another change of the same loop ends the span in which it happens."""
    before, after = spans_around(CHANGED_S, 7, [CHANGED_S - 86400.0, CHANGED_S + 2 * 86400.0])
    assert before == Span(CHANGED_S - 86400.0 + 3600.0, CHANGED_S)
    assert after == Span(CHANGED_S + 3600.0, CHANGED_S + 2 * 86400.0)


def test_blocks_agree_with_a_slow_reference() -> None:
    """Replicates equal means of circular blocks that are summed one by one."""
    rng = np.random.default_rng(5)
    side = Side(rng.normal(size=60), rng.uniform(size=60))
    fast = replicates(side, np.random.default_rng(6))[:20]
    starts = np.random.default_rng(6).integers(0, 60, (2000, 2))[:20]
    for mean, drawn in zip(fast, starts, strict=True):
        at = np.concatenate([(s + np.arange(24)) % 60 for s in drawn])
        assert mean == pytest.approx((side.value * side.weight)[at].sum() / side.weight[at].sum())


def test_drift_widens_and_noise_hardly_does() -> None:
    """Days that drift widen the interval more than independent days do."""
    rng = np.random.default_rng(7)

    def factor(drift: float) -> float:
        found = []
        for _ in range(40):
            x = np.repeat(np.cumsum(rng.normal(size=14)) * drift + rng.normal(size=14), 24)
            found.append(drift_factor(Side(x[:WEEK], np.ones(WEEK)), Side(x[WEEK:], np.ones(WEEK))))
        return float(np.mean(found))

    assert 1.0 <= factor(0.0) < factor(3.0)


def test_intervals_cover_the_truth() -> None:
    """For 300 pairs of weeks with slow noise of 24 h, a 95 % interval misses the true difference in at most 5 %."""
    rng = np.random.default_rng(8)
    missed = 0
    for seed in range(300):
        x = np.zeros(2 * WEEK + 200)
        for i in range(1, x.size):
            x[i] = np.exp(-1 / 24) * x[i - 1] + rng.normal()
        x = x[200:] + 1.5 * (np.arange(2 * WEEK) >= WEEK)
        found = difference(Side(x[:WEEK], np.ones(WEEK)), Side(x[WEEK:], np.ones(WEEK)), 0.95, seed)
        missed += not found.low <= 1.5 <= found.high
    assert missed <= 15


def test_unchanged_plants_are_called_unchanged() -> None:
    """Of 48 figures of 12 simulated plants without a change, at most two are called better or worse.

    The complete proof, with 200 plants, is proofs/honesty.py.
    """
    found = [f for f, _ in examined(12, 1, first=5000)]
    calls = [c.verdict for f in found for c in f.primary]
    assert len(calls) == 48
    assert sum(c in (ChangeVerdict.BETTER, ChangeVerdict.WORSE) for c in calls) <= 2


def test_constant_figures_do_not_change() -> None:
    """Figures that are constant, at zero or elsewhere, get no verdict of change and raise no error."""
    found = hours()
    for m in MEASURES:
        found[m.name] = np.full(2 * WEEK, 0.0 if m.primary else 5.0)
    found["at_limits_pct"] = np.zeros(2 * WEEK)
    result = compare("L", found, *spans_around(CHANGED_S, 7))
    assert {c.verdict for c in result.changes} == {ChangeVerdict.UNCLEAR}
    assert all(c.value_pct is None for c in result.primary)


def test_unknown_figures_are_left_out() -> None:
    """A figure that is unknown on one side is left out and never called better."""
    found = hours(0.5)
    found["variability_pct"][:WEEK] = np.nan
    assert "variability_pct" not in {
        c.measure.name for c in compare("L", found, *spans_around(CHANGED_S, 7)).changes
    }


def test_shifting_time_changes_nothing() -> None:
    """The same weeks shifted by 365 whole days give the same result."""
    found = hours(0.8)
    moved = {**found, "hour_s": found["hour_s"] + 365 * 86400.0}
    one = compare("L", found, *spans_around(CHANGED_S, 7))
    two = compare("L", moved, *spans_around(CHANGED_S + 365 * 86400.0, 7))
    assert [c.found for c in one.changes] == [c.found for c in two.changes]


def test_equal_spans_have_no_reasons() -> None:
    """Two equal spans can be compared."""
    assert reasons_against(hours(), *spans_around(CHANGED_S, 7)) == ()


def test_followers_name_their_source() -> None:
    """A loop's source is the source that at least half of the oscillating nights name; otherwise the loop has
    none.
    """
    assert follows(["A", "A", None], [True, True, False]) == "A"
    assert follows(["A", None, None, None], [True] * 4) == ""
    assert follows(["A", "B", "A"], [True] * 3) == "A"
    assert follows([], []) == ""
    assert LIMITS.source_share == 0.5
