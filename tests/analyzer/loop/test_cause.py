"""Verdicts on simulated loops with a known fault; the simulation shares no code with the estimators."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from analyzer.loop.assess import Assessment, assess
from analyzer.loop.cause.dead_valve import dead_valve
from analyzer.loop.cause.verdict import Verdict, judge
from analyzer.loop.record.quality import prepare
from analyzer.plantwide.night import followers_of, trace
from analyzer.words.reason import sign_text
from identification.errors import NotAssessedError
from proofs.plant import CONFIG, START_S, Sketch, Trends, peer, prepared, record, series, simulate, spec
from proofs.untidy.recorder import swinging_door

SKETCHES = {
    "no fault, flow": Sketch(
        "none", (0.9, 15.0, 4.0), 0.8, 16.0, noise=0.15, load_std=0.8, moves=3.0, kind="flow"
    ),
    "no fault, pressure": Sketch("none", (1.5, 40.0, 8.0), 1.2, 40.0, noise=0.1, load_std=0.8),
    "no fault, temperature": Sketch("none", (1.2, 400.0, 40.0), 2.5, 420.0, noise=0.03, load_std=1.0),
    "sluggish": Sketch("none", (1.2, 60.0, 10.0), 0.2, 300.0, noise=0.1, load_std=1.0),
    "backlash, fast level": Sketch("valve", (80.0, 200.0, 1.0), 1.0, 10.0, backlash=1.0, load_std=0.05),
    "backlash, level": Sketch("valve", (40.0, 1200.0, 8.0), 0.8, 100.0, backlash=0.8, load_std=0.1),
    "backlash, tank": Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5),
    "backlash, temperature": Sketch(
        "valve", (2.4, 600.0, 18.0), 3.6, 90.0, backlash=4.0, noise=0.02, load_std=0.3
    ),
    "sticking flow": Sketch(
        "valve", (1.2, 8.0, 3.0), 0.4, 20.0, stickband=4.0, slip_jump=3.0, noise=0.08, kind="flow"
    ),
    "sticking pressure": Sketch("valve", (1.5, 40.0, 8.0), 0.8, 40.0, stickband=3.0, slip_jump=1.5),
    "tight pressure": Sketch(
        "tuning", (1.2, 260.0, 40.0), 7.8, 170.0, noise=0.03, load_std=0.6, load_s=300.0
    ),
    "tight temperature": Sketch(
        "tuning", (1.5, 120.0, 20.0), 4.6, 60.0, noise=0.03, load_std=0.6, load_s=300.0
    ),
    "swinging load, pressure": Sketch(
        "load", (1.4, 90.0, 10.0), 0.8, 120.0, noise=0.08, load_std=0.3, sine=3.0, sine_s=840.0
    ),
    "swinging load, flow": Sketch(
        "load", (1.0, 20.0, 5.0), 0.6, 22.0, noise=0.1, load_std=0.3, sine=2.0, sine_s=130.0
    ),
}
SEEDS = {"tight pressure": 2}


@cache
def trends(name: str) -> Trends:
    """Four hours of a sketch, or six hours if its process is slow."""
    return simulate(SKETCHES[name], 6 if SKETCHES[name].process[1] > 500 else 4, SEEDS.get(name, 1))


@cache
def assessed(name: str) -> Assessment:
    """The assessment of a sketch with stated settings."""
    sketch = SKETCHES[name]
    return assess(prepared(trends(name), sketch.kind, name), sketch.controller, CONFIG, sketch.kind)


def named(cause: str) -> list[str]:
    """The sketches of one cause."""
    return [name for name, sketch in SKETCHES.items() if sketch.cause == cause]


@pytest.mark.parametrize("name", named("none"))
def test_a_loop_without_fault_has_no_cause(name):
    """Loops without fault and sluggish loops under load have no oscillation and no cause, and no confidence reaches
    50 %.
    """
    found = assessed(name)
    assert found.oscillations.first is None
    assert (found.verdict.cause, found.verdict.fault) == ("none", "none")
    assert max(found.verdict.confidence.values()) < 50


@pytest.mark.parametrize("name", [n for n, s in SKETCHES.items() if s.cause != "none"])
def test_the_cause_is_named_for_two_reasons(name):
    """Backlash, stiction, tight tuning and an oscillating load are each named, with at least two signs in words."""
    found = assessed(name)
    first = found.oscillations.first
    assert first is not None
    assert first.oscillating_pct >= 50
    verdict = found.verdict
    assert verdict.cause == SKETCHES[name].cause
    assert verdict.confidence[verdict.cause] >= 50
    pointing = [sign for sign in verdict.signs if sign.points_to == verdict.cause]
    assert len(pointing) >= 2
    assert all(sign_text(sign) and 0 < sign.strength <= 1 for sign in pointing)


@pytest.mark.parametrize("name", [n for n in named("valve") if SKETCHES[n].backlash])
def test_width_of_backlash_is_recovered(name):
    """Backlash is distinguished from stiction and its width is recovered within 10 %, in spite of the actuator's
    lag.
    """
    verdict = assessed(name).verdict
    assert verdict.fault == "backlash"
    assert verdict.measured is not None
    assert verdict.measured.backlash.valve.stickband == pytest.approx(SKETCHES[name].backlash, rel=0.10)


@pytest.mark.parametrize("name", [n for n in named("valve") if SKETCHES[n].stickband])
def test_stick_slip_is_distinguished_from_backlash(name):
    """Stick-slip is called stiction in at least four of five recordings, with its stickband within 15 %."""
    sketch = SKETCHES[name]
    runs = [prepared(simulate(sketch, 6.0, seed), sketch.kind, name) for seed in range(1, 6)]
    verdicts = [assess(p, sketch.controller, CONFIG, sketch.kind).verdict for p in runs]
    stiction = [v for v in verdicts if v.fault == "stiction"]
    assert len(stiction) >= 4
    for verdict in stiction:
        assert verdict.measured is not None
        assert verdict.measured.stick_slip is not None
        assert verdict.measured.stick_slip.valve.stickband == pytest.approx(sketch.stickband, rel=0.15)


@pytest.mark.parametrize("name", named("load"))
def test_period_of_the_load_is_that_of_the_machine(name):
    """The period of a loop that oscillates because of a load is the period of the load within 1 %."""
    first = assessed(name).oscillations.first
    assert first is not None
    assert first.period_s == pytest.approx(SKETCHES[name].sine_s, rel=0.01)


@pytest.mark.parametrize("name", ["backlash, level", "sticking flow"])
def test_the_valve_is_found_without_the_settings(name):
    """The valve fault is found without stated settings too."""
    sketch = SKETCHES[name]
    found = assess(prepared(trends(name), sketch.kind), None, CONFIG, sketch.kind)
    assert found.verdict.cause == "valve"


@pytest.mark.parametrize("name", ["backlash, level", "tight temperature", "swinging load, flow"])
def test_verdict_does_not_depend_on_the_clock(name):
    """The same trends a year later have the same cause and the same signs."""
    sketch = SKETCHES[name]
    made = prepared(trends(name), sketch.kind, name)
    later = replace(made, record=replace(made.record, start_s=START_S + 365 * 86400))
    found = assess(later, sketch.controller, CONFIG, sketch.kind).verdict
    assert (found.cause, found.signs) == (assessed(name).verdict.cause, assessed(name).verdict.signs)


def test_direct_acting_loops_get_the_same_verdict():
    """If the signs of process and controller are reversed, the verdict is the same."""
    sketch = SKETCHES["backlash, level"]
    made = trends("backlash, level")
    turned = Trends(100 - made.sp, 100 - made.pv, made.op, made.stem)
    settings = replace(sketch.controller, kp=-sketch.kp)
    verdict = assess(prepared(turned), settings, CONFIG).verdict
    assert (verdict.cause, verdict.fault) == ("valve", "backlash")
    assert verdict.measured is not None
    assert verdict.measured.backlash.valve.stickband == pytest.approx(sketch.backlash, rel=0.10)


def test_trends_that_do_not_identify_a_cause_state_what_they_need():
    """Without OP, or with compressed trends, the cause is undecided, and the verdict states what is needed and what
    is present.
    """
    made = prepared(trends("swinging load, flow"))
    unseen = assess(replace(made, op_known=False), None, CONFIG)
    figures = [unseen.night.valve_travel_pct_per_h, unseen.hours[0].figures.at_limits_pct]
    assert figures == [None, None]
    blind = unseen.verdict
    assert (blind.cause, blind.fault) == ("undecided", "undecided")
    assert str(blind.needs) == "needs OP, which is not recorded"
    straight = assess(replace(made, compressed_share=0.9, archived_share=0.02), None, CONFIG).verdict
    assert straight.cause == "undecided"
    wanted = "needs trends without compression, or 7 archived samples per cycle"
    assert str(straight.needs) == f"{wanted}, has 2.6 per cycle and 90 % of the samples on straight segments"


@pytest.mark.parametrize("seed", [0, 1, 4, 5])
@pytest.mark.parametrize("grid", [0.01, 0.1])
def test_a_large_backlash_is_found_for_any_noise_and_load(seed, grid):
    """A backlash of half the range of OP is found.

    A small backlash with a long dead time, which looks the same at the period, is not chosen instead.
    """
    sketch = SKETCHES["backlash, tank"]
    made = simulate(sketch, 6, seed)
    pv, op = (np.round(x / (grid * np.std(x))) * grid * np.std(x) for x in (made.pv, made.op))
    found = assess(prepared(replace(made, pv=pv, op=op)), sketch.controller, CONFIG).verdict
    assert found.cause == "valve"
    assert found.measured is not None
    assert found.measured.backlash.valve.stickband == pytest.approx(sketch.backlash, rel=0.1)


def compressed(name: str, share: float) -> Trends:
    """Trends of a sketch after swinging-door compression; the deviation is a multiple of the usual step between
    samples.
    """
    made = trends(name)
    pv, op = (swinging_door(x, share * float(np.std(np.diff(x))), 600) for x in (made.pv, made.op))
    return replace(made, pv=pv, op=op)


@pytest.mark.parametrize("name", [n for n, s in SKETCHES.items() if s.cause in ("valve", "load")])
def test_compressed_trends_show_the_cause_of_a_cycle_that_they_contain(name):
    """With swinging-door compression the cause is the true one or none, without new settings.

    If little is stored of each cycle, the cause is undecided or none.
    """
    causes = {}
    for share in (0.9, 3.0, 10.0):
        prep = prepared(compressed(name, share))
        found = assess(prep, None, CONFIG)
        causes[share] = found.verdict.cause
        if prep.compressed_share > CONFIG.quality.straight_share:
            assert found.for_settings is not None
            assert found.verdict.cause in (SKETCHES[name].cause, "undecided", "none")
    if name in ("backlash, tank", "swinging load, flow", "swinging load, pressure"):
        assert causes[0.9] == SKETCHES[name].cause
    assert causes[10.0] in ("undecided", "none")


@pytest.mark.parametrize("name", named("none"))
def test_a_loop_without_fault_has_no_cause_with_compression(name):
    """A compressed trend gives no cause for a loop without fault."""
    for share in (0.9, 3.0, 10.0):
        found = assess(prepared(compressed(name, share)), SKETCHES[name].controller, CONFIG)
        assert found.verdict.cause in ("none", "undecided")


def test_a_slow_loop_without_fault_has_no_cause_in_a_day():
    """A day of slow noise, of which half a day looks like an oscillation, gives no cause."""
    sketch = SKETCHES["no fault, temperature"]
    found = assess(prepared(simulate(sketch, 24.0, 10), sketch.kind), sketch.controller, CONFIG, sketch.kind)
    assert (found.verdict.cause, found.oscillations.first) == ("none", None)


def holed(name: str, bad: np.ndarray) -> Verdict:
    """The verdict on a loop whose PV is bad at the given samples."""
    made = trends(name)
    stamp = START_S + np.arange(made.pv.size, dtype=float)
    found = {f"L.{role.upper()}": series(stamp, getattr(made, role)) for role in ("sp", "op")}
    found["L.PV"] = series(stamp, np.where(bad[: stamp.size], np.nan, made.pv), bad[: stamp.size])
    return assess(prepare(spec("L"), found, CONFIG.quality), None, CONFIG).verdict


@pytest.mark.parametrize("every", [2, 3])
def test_holes_far_shorter_than_the_cycle_change_no_verdict(every):
    """If only each second or third PV is good, the backlash of a tank is found as in a record with such an
    interval.
    """
    verdict = holed("backlash, tank", np.arange(200_000) % every != 0)
    assert (verdict.cause, verdict.fault) == ("valve", "backlash")


def test_the_rest_of_half_a_record_shows_the_cause():
    """If ten minutes of each twenty are lost, the backlash of a tank is found in the rest, and loops without fault
    have no cause.
    """
    lost = np.arange(200_000) % 1200 < 600
    assert holed("backlash, tank", lost).cause == "valve"
    assert {holed(name, lost).cause for name in named("none")} <= {"none", "undecided"}


def test_a_loop_in_manual_is_not_assessed():
    """A loop with constant OP and an oscillating PV all night was in manual, and is not assessed."""
    made = trends("swinging load, flow")
    with pytest.raises(NotAssessedError, match="manual 100 %"):
        assess(prepared(replace(made, op=np.full(made.op.size, 50.0))), None, CONFIG)


# Neighbours


def followed(coupling: float = 1.0) -> tuple[Assessment, Assessment]:
    """A tank with backlash and the temperature loop that it feeds."""
    source = trends("backlash, tank")
    extra = coupling * (source.pv - source.sp)
    sketch = Sketch("load", (1.3, 60.0, 10.0), 0.8, 80.0)
    fed = simulate(sketch, 6, 5, extra)
    return assessed("backlash, tank"), assess(prepared(fed, loop="fed"), sketch.controller, CONFIG)


def traced(*found: Assessment) -> dict[str, str]:
    """Followers and their sources according to the plant-wide pass."""
    peers = {}
    for a in found:
        m = a.verdict.measured
        peers[a.loop] = peer(a.verdict.cause, m.evidence if m else 0.0, a.verdict.confidence["tuning"])
    oscillations = [w for a in found for w in a.oscillation_lines]
    followers = followers_of(trace(oscillations, peers, CONFIG.plant))
    return {loop: source.loop for loop, (source, _) in followers.items()}


def test_a_follower_is_traced_to_its_source():
    """A loop fed by a tank with backlash follows the tank, and its own valve gets no fault."""
    source, fed = followed()
    assert traced(source, fed) == {"fed": "backlash, tank"}
    assert fed.verdict.cause != "valve"


def test_loops_that_cycle_by_themselves_follow_no_loop():
    """Two loops with backlash, and one that oscillates because of a load, follow no other loop."""
    found = [
        assessed(name) for name in ("backlash, tank", "backlash, temperature", "swinging load, pressure")
    ]
    assert traced(*found) == {}


# A valve that no longer moves


def wound(answer: float = 0.0) -> Trends:
    """OP winds up over 60 % while PV, away from its set point, moves by `answer` [%]."""
    n = 7200
    rise = np.linspace(0, 1, n)
    noise = np.random.default_rng(7).standard_normal(n)
    return Trends(np.full(n, 50.0), 30 + answer * rise + 0.1 * noise, 20 + 60 * rise, np.full(n, 20.0))


def test_a_stuck_valve_is_the_cause_without_oscillation():
    """If OP winds up over 60 % while PV stays away from its set point, the cause is the valve with an undecided
    fault.
    """
    found = assess(prepared(wound()), None, CONFIG)
    assert found.oscillations.first is None
    assert (found.verdict.cause, found.verdict.fault) == ("valve", "undecided")
    assert "OP moves over 60 %" in sign_text(found.verdict.signs[0])


def test_a_valve_that_responds_is_not_stuck():
    """The same OP with a PV that rises by 10 % is no stuck valve."""
    assert dead_valve(prepared(wound(10.0)).record, CONFIG.cause) is None


def test_a_loop_at_rest_has_no_stuck_valve():
    """PV at its set point with a drifting OP is no stuck valve, and neither is PV away from it with a constant OP."""
    n = 7200
    noise = 0.1 * np.random.default_rng(8).standard_normal(n)
    assert dead_valve(record(50 + noise, op=np.linspace(20, 80, n)), CONFIG.cause) is None
    assert dead_valve(record(30 + noise, op=np.full(n, 100.0)), CONFIG.cause) is None


@pytest.mark.parametrize("name", ["evidence", "jump", "size", "kurtosis"])
def test_a_sign_that_is_not_known_names_no_cause(name):
    """A measure that is not a number makes the cause undecided."""
    found = assessed("backlash, tank")
    first = found.oscillations.first
    assert first is not None
    assert found.verdict.measured is not None
    assert judge(found.verdict.measured, first, CONFIG.cause).cause == "valve"
    broken = replace(found.verdict.measured, **{name: float("nan")})
    assert judge(broken, first, CONFIG.cause).cause == "undecided"


def test_a_load_of_few_samples_a_cycle_is_named_by_its_phase_alone():
    """With rows every 10 s and fewer than 8 samples per cycle, only the phase identifies the load.

    There is no third harmonic, so the waveform does not separate backlash from a load. A sine keeps its phase over
    500 periods.
    """
    swung = Sketch("load", (1.4, 40.0, 5.0), 0.8, 60.0, noise=0.05, load_std=0.3, sine=4.0, sine_s=55.0)
    worn = Sketch("valve", (1.2, 8.0, 3.0), 0.4, 20.0, stickband=4.0, slip_jump=3.0, noise=0.08)
    verdicts = []
    for sketch in (swung, worn):
        t, every = simulate(sketch, 8), 10
        stamp = START_S + every * np.arange(t.pv[::every].size, dtype=float)
        tags = {f"L.{name.upper()}": series(stamp, getattr(t, name)[::every]) for name in ("sp", "pv", "op")}
        loop = prepare(spec("L", ""), tags, CONFIG.quality)
        verdicts.append(assess(loop, sketch.controller, CONFIG).verdict)
    load, valve = verdicts
    assert (load.cause, load.signs[0].kind) == ("load", "kept phase")
    assert valve.cause != "load"
    tank = trends("backlash, tank")
    few = {
        f"L.{name.upper()}": series(START_S + 63 * np.arange(tank.pv[::63].size), getattr(tank, name)[::63])
        for name in ("sp", "pv", "op")
    }
    worn_tank = assess(
        prepare(spec("L", ""), few, CONFIG.quality), SKETCHES["backlash, tank"].controller, CONFIG
    ).verdict
    assert worn_tank.cause == "undecided"
