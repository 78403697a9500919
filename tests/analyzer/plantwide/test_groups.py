"""Loops with the same oscillation are one group, and loops without a common oscillation are none, for any periods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from analyzer.loop.decisions import Cause, Finding
from analyzer.loop.oscillation.detection import detect
from analyzer.plantwide.groups import Group, groups_of
from analyzer.plantwide.night import Traced, followers_of, may_follow, trace
from analyzer.plantwide.oscillation_lines import (
    OscillationLines,
    error_lines_of,
    oscillation_table,
    oscillations_in,
)
from proofs.plant import CONFIG, START_S, peer, record

HOURS_8 = 28_800
LIMITS = CONFIG.plant


def oscillation(
    seed: int, n: int = HOURS_8, period: float = 200.0, walk: float = 0.01, square: bool = False
) -> np.ndarray:
    """An oscillation whose phase drifts by `walk` rad a sample, so that no two are equal, shape (n,)."""
    rng = np.random.default_rng(seed)
    phase = 2 * np.pi * np.arange(n) / period + np.cumsum(walk * rng.standard_normal(n))
    return np.sign(np.sin(phase)) if square else np.sin(phase)


def late(x: np.ndarray, lag: float, delay: int = 0) -> np.ndarray:
    """A signal after a lag [samples] and a delay [samples]."""
    pole = np.exp(-1.0 / lag)
    return np.concatenate((np.zeros(delay), lfilter([1 - pole], [1, -pole], x)))[: x.size]


def loop(
    name: str,
    error: np.ndarray,
    noise: float = 0.1,
    seed: int = 1,
    dt_s: float = 1.0,
    start_s: float = START_S,
) -> tuple[OscillationLines, ...]:
    """The oscillations of a loop whose error is a signal plus its own noise."""
    pv = 50.0 - error + noise * np.random.default_rng(seed).standard_normal(error.size)
    own = replace(record(pv, dt_s=dt_s), start_s=start_s)
    return error_lines_of(name, detect(own, CONFIG.oscillation), start_s + own.duration_s, LIMITS)


def grouped(*loops: Sequence[OscillationLines]) -> list[Group]:
    """Groups of some loops."""
    return groups_of([w for oscillations in loops for w in oscillations], LIMITS)


def names(groups: Sequence[Group]) -> list[set[str]]:
    """The loops of each group."""
    return [set(g.loops) for g in groups]


def traced(peers: dict[str, Finding], *loops: Sequence[OscillationLines]) -> list[Traced]:
    """Groups with their sources."""
    return trace([w for oscillations in loops for w in oscillations], peers, LIMITS)


def test_loops_with_one_oscillation_are_one_group():
    """Three loops that pass on one oscillation through lags and delays are one group, and an unrelated loop is not in
    it.
    """
    x = oscillation(1)
    found = grouped(
        loop("A", x, seed=1),
        loop("B", late(x, 60.0, 40), 0.05, seed=2),
        loop("C", late(late(x, 60.0, 40), 90.0, 100), 0.05, seed=3),
        loop("D", oscillation(2), seed=4),
    )
    assert names(found) == [{"A", "B", "C"}]


@pytest.mark.parametrize("seed", range(8))
def test_loops_with_similar_periods_by_chance_are_no_group(seed):
    """Five oscillations with periods within 2 % of each other, each with its own phase drift, are no group."""
    rng = np.random.default_rng(seed)
    periods = 200.0 * (1 + 0.02 * rng.uniform(-1, 1, 5))
    found = grouped(
        *(loop(f"L{k}", oscillation(100 * seed + k, period=p), seed=k) for k, p in enumerate(periods))
    )
    assert found == []


@pytest.mark.parametrize("kind", ["white", "drift", "constant", "ramp"])
def test_loops_without_oscillation_are_in_no_group(kind):
    """Noise, drift, ramps and constants are no shared oscillation, even if they are equal in all loops."""
    rng = np.random.default_rng(5)
    x = {
        "white": rng.standard_normal(HOURS_8),
        "drift": np.cumsum(0.01 * rng.standard_normal(HOURS_8)),
        "constant": np.zeros(HOURS_8),
        "ramp": np.linspace(0, 20, HOURS_8),
    }[kind]
    noise = 0.0 if kind == "constant" else 0.1
    assert grouped(*(loop(f"L{k}", x, noise, seed=k) for k in range(6))) == []


def test_an_oscillation_too_weak_by_itself_is_found_with_others():
    """A loop whose error is mostly its own load, and that is not seen to oscillate, joins the group of its
    oscillation.
    """
    x = oscillation(3, walk=0.03)
    rng = np.random.default_rng(9)
    load = lfilter([0.05], [1, -0.95], rng.standard_normal(HOURS_8))
    weak = loop("weak", 0.1 * x + load, 0.02)
    assert not any(w.own and abs(w.period_s / 200 - 1) < 0.1 for w in weak)
    assert names(grouped(loop("A", x), weak)) == [{"A", "weak"}]


def test_copies_of_one_tag_are_one_group_without_a_source():
    """Ten loops with the same trends are one group in which no loop is reported as the source."""
    x = oscillation(4)
    loops = [loop(f"L{k}", x, seed=1) for k in range(10)]
    peers = {f"L{k}": peer(Cause.LOAD) for k in range(10)}
    (found,) = traced(peers, *loops)
    assert len(found.group.loops) == 10
    assert found.candidates[0].confidence_pct < LIMITS.source_pct
    assert followers_of([found]) == {}


def test_a_group_of_two_loops_has_its_source():
    """Of two loops with one oscillation, the loop with a valve fault is the source, and the other follows it with the
    right lag.
    """
    x = oscillation(5, walk=0.03, square=True)
    peers = {"valve": peer(Cause.VALVE, 500.0), "fed": peer(Cause.LOAD)}
    found = traced(peers, loop("valve", x), loop("fed", late(x, 60.0, 120), seed=2))
    assert {k: s.loop for k, (s, _) in followers_of(found).items()} == {"fed": "valve"}
    slope = 60.0 / (1 + (2 * np.pi * 60.0 / 200.0) ** 2)  # group delay of the lag at the period
    assert found[0].links["fed"].lag_s == pytest.approx(120.0 + slope, abs=25.0)


def test_different_intervals_do_not_divide_a_group():
    """A loop sampled every 5 s joins the group of a loop sampled every second, although its record ends earlier."""
    x = oscillation(6)
    fed = late(x, 60.0, 40)
    slow = loop("slow", fed[: HOURS_8 - 1000 : 5], 0.05, dt_s=5.0)
    assert names(grouped(loop("A", x), slow)) == [{"A", "slow"}]


@pytest.mark.parametrize("off_s", [-180.0, 240.0])
def test_clocks_that_differ_by_minutes_do_not_divide_a_group(off_s):
    """A loop whose historian clock is minutes off is in the group, and the reported lag is the one between the
    clocks.
    """
    x = oscillation(7, walk=0.02)
    found = traced(
        {"A": peer(Cause.VALVE, 100.0), "off": peer(Cause.LOAD)},
        loop("A", x),
        loop("off", late(x, 20.0), 0.05, start_s=START_S + off_s),
    )
    assert names([t.group for t in found]) == [{"A", "off"}]
    loops_found = {c.loop: found[0].links.get(c.loop) for c in found[0].candidates}
    apart = [s.lag_s if k == "off" else -(s.lag_s or 0.0) for k, s in loops_found.items() if s is not None]
    assert apart == [pytest.approx(off_s, abs=40.0)]


def test_records_of_other_hours_are_no_group():
    """Two loops with the same trend at other hours of the day are no group."""
    x = oscillation(8)
    assert grouped(loop("A", x), loop("B", x, seed=2, start_s=START_S + HOURS_8)) == []


@pytest.mark.parametrize(("own", "follows"), [(100.0, True), (270.0, True), (1500.0, False)])
def test_the_valve_with_more_evidence_moves_the_other(own, follows):
    """Of two valves with a common oscillation, the one with more evidence is the source, and the other loop follows
    it.

    With less than its own evidence in the source it does not follow.
    """
    limits = CONFIG.plant
    valve = peer(Cause.VALVE, own)
    assert may_follow(valve, peer(Cause.VALVE, 1000.0), 0.95, limits) is follows
    assert not may_follow(valve, peer(Cause.LOAD, 0.0), 0.95, limits)


def test_a_loop_may_follow_in_two_groups():
    """A loop that two sources of different periods move is in the groups of both."""
    x, y = oscillation(9, period=200.0), oscillation(10, period=520.0)
    found = grouped(loop("A", x), loop("B", y, seed=2), loop("both", late(x, 30.0) + late(y, 30.0), seed=3))
    assert sorted(map(sorted, names(found))) == [["A", "both"], ["B", "both"]]


def test_harmonics_of_one_source_are_one_group():
    """A loop that shows only the third harmonic of a square oscillation is in the group of the loop with that
    oscillation.
    """
    x = oscillation(11, period=300.0, square=True, walk=0.005)
    phase = np.unwrap(
        np.angle(np.fft.ifft(np.fft.fft(x) * (np.abs(np.fft.fftfreq(x.size) - 1 / 300) < 4e-4)))
    )
    third = np.sin(3 * phase)
    found = grouped(loop("A", x), loop("B", late(x, 30.0), seed=2), loop("third", third, seed=3))
    assert names(found) == [{"A", "B", "third"}]


def test_oscillations_are_unchanged_by_the_store():
    """Oscillations that are written as a table and read back have exactly the same lines."""
    oscillations = [*loop("A", oscillation(12)), *loop("B", oscillation(13, period=70.0), seed=2)]
    back = oscillations_in([oscillation_table(oscillations)])
    assert [(w.loop, w.period_s, w.own) for w in back] == [(w.loop, w.period_s, w.own) for w in oscillations]
    for old, new in zip(oscillations, back, strict=True):
        np.testing.assert_array_equal(old.lines, new.lines)


def test_a_source_without_a_constant_period_is_found_by_prediction():
    """A loop whose drifting cycle moves two others through filters is their source, although its own verdict is
    unknown.
    """
    rng = np.random.default_rng(21)
    x = oscillation(21, period=200.0, walk=0.04)
    mine = x + lfilter([0.25], [1, -0.97], rng.standard_normal(HOURS_8))
    passed = late(late(mine, 40.0, 20), 40.0)
    found = traced(
        {"A": peer(Cause.LOAD), "B": peer(Cause.LOAD), "C": peer(Cause.LOAD)},
        loop("A", mine, 0.05),
        loop("B", late(passed, 30.0), 0.02, seed=2),
        loop("C", late(passed, 50.0, 30), 0.02, seed=3),
    )
    assert found[0].source == "A"
    assert set(found[0].group.loops) == {"A", "B", "C"}
