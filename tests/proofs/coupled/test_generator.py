"""The generator of coupled plants agrees with its description."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pytest

from proofs.coupled import loops, response, trends
from proofs.coupled.__main__ import written
from proofs.coupled.draw import clock_off, draw, thinned
from proofs.coupled.kernel import Plant, Trends, simulate
from proofs.coupled.measure import period, returning

SMALL = {"loops": 30, "hours": 6.0, "step_s": 10.0}
"""A plant that is quick to draw."""


def fault_free(n: int, step: float = 5.0, seed: int = 1) -> Plant:
    """Fault-free loops without cascades, with valves without backlash."""
    plant = loops.drawn(np.random.default_rng(seed), 3 * n, step)[0]
    lone = [i for i in range(3 * n) if plant.master[i] < 0 and plant.slave[i] < 0][:n]
    plant = plant.part(lone)
    for i in range(n):
        plant = plant.changed(i, backlash=0.0)
    return plant


def at_rest(plant: Plant, scans: int) -> Trends:
    """Inputs without loads and without noise."""
    still = np.zeros((scans, plant.size))
    return Trends(still + plant.sp0, still, still.copy(), {})


def in_plain_python(plant: Plant, drive: Trends, i: int) -> tuple[np.ndarray, np.ndarray]:
    """PV and OP of a loop with backlash, computed in plain Python."""
    dt, x, y, op, stem, last = plant.step, 0.0, 0.0, plant.op0[i], plant.op0[i], 0.0
    moved, pvs, ops = [0.0] * int(plant.dead[i]), [], []
    for sp, load, noise in zip(*(z[:, i] for z in (drive.sp, drive.load, drive.noise)), strict=True):
        pvs.append(min(max(plant.sp0[i] + plant.gain[i] * y + noise, 0), 100))
        e = sp - pvs[-1]
        op = min(max(op + plant.kp[i] * (e - last + dt / plant.ti[i] * e), 0), 100)
        last, half = e, plant.backlash[i] / 2
        stem = op - half if stem < op - half else op + half if stem > op + half else stem
        ops.append(op)
        moved.append(stem - plant.op0[i] + load)
        u, share = moved[len(ops) - 1], 1 - math.exp(-dt / plant.first[i])
        x += dt / plant.first[i] * u if plant.integrating[i] else share * (u - x)
        y += (x - y) if plant.second[i] == 0 else (1 - math.exp(-dt / plant.second[i])) * (x - y)
    return np.array(pvs), np.array(ops)


def test_the_kernel_equals_a_loop_in_plain_python():
    """Every uncoupled loop of the kernel equals a loop in plain Python within 1e-9, with backlash and at the
    limits of OP."""
    rng = np.random.default_rng(3)
    plant = loops.drawn(rng, 24, 5.0)[0]
    lone = [i for i in range(24) if plant.master[i] < 0 and plant.slave[i] < 0]
    plant = plant.part(lone).changed(0, backlash=3.0)
    natural = np.array([response.natural(plant, i) for i in range(plant.size)])
    drive = trends.drawn(rng, plant, natural, 1500)
    drive.load[500:700] += 70.0
    ran = simulate(plant, drive)
    assert ran.op.min() == 0.0
    for i in range(plant.size):
        pv, op = in_plain_python(plant, drive, i)
        assert np.abs(pv - ran.pv[:, i]).max() < 1e-9
        assert np.abs(op - ran.op[:, i]).max() < 1e-9


def test_an_oscillation_propagates_as_the_frequency_response_predicts():
    """A sine at one loop's load gives a chain with a recycle the amplitudes that the linear equations predict."""
    plant, turn, scans = fault_free(3), 600.0, 12_000
    ends = ((0, 1, 0.0, 0.3, 40.0, 7), (1, 2, 1.0, -0.4, 80.0, 3), (2, 0, 0.0, 0.1, 10.0, 5))
    for link in ends:
        plant = plant.linked(*link)
    drive = at_rest(plant, scans)
    drive.load[:, 0] = 0.5 * np.sin(2 * np.pi * np.arange(scans) * plant.step / turn)
    pv = response.swings(plant, 2 * np.pi / turn, -1, 0.0, 0.0, load=0)[0]
    found = simulate(plant, drive).pv[-2400:]
    assert np.sqrt(2) * found.std(axis=0) == pytest.approx(0.5 * np.abs(pv), rel=1e-3)


def test_the_critical_gain_separates_decay_from_growth():
    """The response to a load pulse decays at 95 % of the critical gain and grows at 105 %, for lags, levels and
    masters."""
    plant = loops.drawn(np.random.default_rng(5), 30, 5.0)[0]
    kinds = [int(np.flatnonzero(x)[0]) for x in (plant.slave >= 0, plant.slave < 0, plant.integrating > 0)]
    for i in kinds:
        for factor, grows in ((0.95, False), (1.05, True)):
            swung = plant.changed(i, kp=factor * response.critical_gain(plant, i), backlash=0.0)
            if plant.slave[i] >= 0:
                swung = swung.changed(int(plant.slave[i]), backlash=0.0)
            drive = at_rest(swung, 6000)
            drive.load[10:20, i] = 0.01
            e = np.abs(simulate(swung, drive).pv[:, i] - plant.sp0[i])
            assert (e[4000:].max() > 0.7 * e.max()) == grows


def test_a_sticking_valve_causes_a_triangle_in_op_and_jumps_of_the_stem():
    """Under stiction without varying loads the stem moves in jumps between rests and PV oscillates. Without
    stiction the loop rests."""
    plant = fault_free(1).changed(
        0, gain=1.0, first=20.0, second=0.0, integrating=0.0, dead=2, kp=0.5, ti=20.0
    )
    drive = at_rest(plant, 6000)
    drive.load[100:] = 3.0
    sticking = simulate(plant.changed(0, stick=2.0, slip=1.0), drive, stems=True)
    free = simulate(plant, drive)
    jumps = np.diff(sticking.stem[3000:, 0])
    assert (jumps == 0).mean() > 0.8
    assert np.abs(jumps).max() > 1.0
    assert np.ptp(sticking.pv[3000:]) > 100 * np.ptp(free.pv[3000:])


def test_periods_are_found_to_a_thousandth():
    """The period of a noisy sine, square or sawtooth is found within 0.1 %, and noise has no period."""
    rng, t = np.random.default_rng(1), np.arange(8000)
    for turn in (11.3, 47.9, 300.0):
        phase = t / turn
        for x in (np.sin(2 * np.pi * phase), np.sign(np.sin(2 * np.pi * phase)), phase % 1):
            assert period(x + 0.3 * rng.standard_normal(t.size)) == pytest.approx(turn, rel=1e-3)
    assert returning(rng.standard_normal(8000))[1] < 0.1


def test_the_truth_is_the_effect_of_removing_a_fault(monkeypatch):
    """Without its fault, the spectral line of a source disappears from its followers. Unrelated loops stay
    identical to the last digit."""
    kept = []
    from proofs.coupled import draw as module

    real = module.truths
    monkeypatch.setattr(module, "truths", lambda b, *rest: kept.append((b, rest)) or real(b, *rest))
    lines = unrelated = 0
    for seed in range(4):
        drawn = draw(seed, sources=2, **SMALL)
        bench, (names, sources, own) = kept[-1]
        with_it, without = (simulate(x, bench.trends) for x in (bench.faulty, bench.without(sources)))
        cut = bench.warm
        for i, name in enumerate(names):
            truth = drawn.truth[name]
            if i in own or (truth["role"] == "healthy" and not truth["roots"] and not truth["coupled_to"]):
                assert np.array_equal(with_it.pv[:, i], without.pv[:, i])
                unrelated += i in own
            if truth["role"] == "follower" and truth["swell"] > 1.5:
                turn = drawn.truth[truth["root"]]["period_s"]
                tops = [line((x.sp - x.pv)[cut:, i], turn / drawn.step_s) for x in (with_it, without)]
                assert tops[0] > 2 * tops[1]
                lines += 1
    assert lines > 3
    assert unrelated > 3


def line(e: np.ndarray, turn: float) -> float:
    """Mean square within 15 % of a period [samples]."""
    power = np.abs(np.fft.rfft(e - e.mean())) ** 2
    at = np.fft.rfftfreq(e.size) * turn
    return float(power[np.abs(at - 1) < 0.15].sum())


def test_plants_have_the_stated_sources_and_followers():
    """Each of 20 small plants has a source, a follower and finite trends. Sources have the stated amplification
    and period."""
    matched = 0
    for seed in range(20):
        drawn = draw(seed, **SMALL)
        truth = drawn.truth
        roles = [x["role"] for x in truth.values()]
        assert len(drawn.loops) == 30
        assert "source" in roles
        assert "follower" in roles
        for x in drawn.loops:
            assert np.isfinite([x.sp, x.pv, x.op]).all()
            assert np.mean((x.op <= 0) | (x.op >= 100)) < 0.5
            assert x.master == "" or x.master in truth[x.name]["coupled_to"]
        for x in truth.values():
            if x["role"] == "source":
                assert x["swell"] >= 1.5
                assert 7 * drawn.step_s <= x["period_s"] <= 6 * 3600 / 12
            if x["role"] == "follower":
                assert x["roots"][x["root"]] == x["swell"] >= 1.1
            if x["near"] and truth[x["near"]]["role"] == "source":
                matched += abs(x["period_s"] / truth[x["near"]]["period_s"] - 1) < 0.11
    assert matched >= 15


def test_the_same_seed_is_the_same_plant():
    """The same seed gives the same plant, and another seed gives another plant."""
    one, again, other = draw(5, **SMALL), draw(5, **SMALL), draw(6, **SMALL)
    assert one.truth == again.truth != other.truth
    assert all(np.array_equal(a.pv, b.pv) for a, b in zip(one.loops, again.loops, strict=True))


def test_the_gain_of_a_recycle_is_below_one():
    """The gain around every ring of couplings is below one at every frequency, over many plants."""
    from proofs.coupled import spread as module

    seen, real = [], module.Web.put
    module.Web.put = lambda self, link: seen.append((self, link, self.bench.faulty)) or real(self, link)
    try:
        for seed in range(4):
            draw(seed, **SMALL)
    finally:
        module.Web.put = real
    rings = [(plant, link) for web, link, plant in seen if closes(plant, link)]
    assert rings
    for plant, link in rings:
        assert module.returned(plant, link) < 0.35


def closes(plant: Plant, link: tuple[float, ...]) -> bool:
    """Whether the start of a coupling is downstream of its end."""
    seen = {int(link[1])}
    for _ in range(plant.size):
        on = {int(b) for a, b in zip(plant.link_from, plant.link_to, strict=True) if int(a) in seen}
        for i in list(seen):
            on |= {int(x[i]) for x in (plant.master, plant.slave) if x[i] >= 0}
        seen |= on
    return int(link[0]) in seen


def test_records_with_late_clocks_and_coarse_rows_and_files(tmp_path):
    """Records with late clocks or coarse rows keep their values. A written plant reads back with its truth."""
    drawn = draw(2, **SMALL)
    late, coarse = drawn.loops[0].name, drawn.loops[1].name
    odd = thinned(clock_off(drawn, 240.0, {late}), 3, {coarse})
    assert odd.loops[0].stamp_s[0] == 240.0
    assert odd.loops[1].dt == 30.0
    assert np.array_equal(odd.loops[1].pv, drawn.loops[1].pv[::3])
    written(tmp_path, odd, 2)
    back = pd.read_parquet(tmp_path / "export.parquet").set_index("timestamp")
    assert np.array_equal(back[f"{coarse}.PV"].dropna(), odd.loops[1].pv)
    table = pd.read_csv(tmp_path / "loops.csv", keep_default_na=False)
    assert list(table["master"]) == [x.master for x in odd.loops]
    assert json.loads((tmp_path / "truth.json").read_text())["loops"] == drawn.truth
