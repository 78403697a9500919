"""A verdict rests on one stretch: in automatic, and under one pair of settings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.history.export import open_export
from analyzer.loop.assess import assess
from analyzer.loop.record.judged_stretch import Earlier, judged_stretch
from analyzer.loops.changes import read_changes
from analyzer.loops.tags import match, read_loops
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.pages.rank import brief
from analyzer.store.store import Store
from analyzer.words.reason import in_short
from identification.models import Pid
from identification.record import LoopRecord
from proofs.plant import CONFIG, SAMPLE_DATA, START_S, Trends, prepared, run, spec, wander

HOUR = 3600
DAY_S = 86400.0
PI = Pid(0.65, 30.0, scan_s=1.0)


def half_in_manual(play: float) -> tuple[Trends, np.ndarray]:
    """Three hours of a flow in automatic, then three in manual, and where it is in manual."""
    n = 6 * HOUR
    rng = np.random.default_rng(5)
    manual = np.arange(n) >= n // 2
    load, noise = wander(rng, n, 0.3, 1800.0), 0.05 * rng.standard_normal(n)
    own = (np.full(n, PI.kp), np.full(n, PI.ti_s), np.zeros(n), manual)
    pv, op, stem = run(np.full(n, 50.0), load, noise, *own, 50.0, (play, 0.0, 0.0), (12.0, 150.0, 6.0))
    return Trends(np.full(n, 50.0), pv, op, stem), manual


@pytest.mark.parametrize(("play", "cause"), [(2.7, "valve"), (0.0, "none")])
def test_a_half_in_manual_hides_nothing_of_the_other(play, cause):
    """A play that a night in automatic shows is told from its half in automatic, and a sound valve is not blamed."""
    trends, manual = half_in_manual(play)
    whole = prepared(trends)
    masks = {**whole.record.masks, "manual": manual}
    found = assess(replace(whole, record=replace(whole.record, masks=masks)), PI, CONFIG)
    assert found.verdict.cause == cause
    assert found.judged_h == pytest.approx(3.0, abs=0.01)
    if play:
        assert found.verdict.measured.play.valve.stickband == pytest.approx(play, rel=0.15)


def still(hours: float, manual: slice = slice(0)) -> LoopRecord:
    """A record of so many hours of which a part is in manual; its trends do not matter."""
    n = int(hours * HOUR)
    out = np.zeros(n, dtype=bool)
    out[manual] = True
    x = np.zeros(n)
    return LoopRecord("L", START_S, 1.0, x, x, x, np.zeros(n, dtype=bool), masks={"manual": out})


OLD = Pid(1.0, 10.0)


@pytest.mark.parametrize(
    ("changed_h", "expected"),
    [
        ((), (0.0, 24.0, PI, False)),
        ((9.0,), (9.0, 24.0, PI, False)),
        ((4.0, 9.0), (9.0, 24.0, PI, False)),
        ((23.0,), (0.0, 23.0, OLD, True)),
        ((2.0, 23.0), (2.0, 23.0, OLD, True)),
    ],
)
def test_the_stretch_since_the_last_change_counts(changed_h, expected):
    """What came before a change tells nothing of the settings in force; where too little came since, the longest part
    is judged by its own settings, which are outdated."""
    earlier = [Earlier(START_S + h * HOUR, spec("L"), OLD) for h in changed_h]
    found = judged_stretch(still(24.0), PI, earlier, CONFIG)
    assert (found.first / HOUR, found.last / HOUR, found.controller, found.outdated) == expected


def test_pieces_too_short_to_stand_for_the_record_are_not_picked():
    """Six automatic hours between spans in manual of half an hour are judged together, as before."""
    record = still(6.0)
    for hour in range(6):
        record.mask("manual")[hour * HOUR : hour * HOUR + HOUR // 2] = True
    found = judged_stretch(record, PI, (), CONFIG)
    assert (found.first, found.last) == (0, len(record))


@pytest.fixture(scope="module")
def retuned(tmp_path_factory):
    """Rows by loop of the night in which seven loops of the sample mill were retuned, as changes.csv tells, beside
    three that nobody touched."""
    export = open_export([SAMPLE_DATA / "mill.parquet"])
    changes = read_changes(SAMPLE_DATA / "changes.csv")
    wanted = {"FIC2110", "FIC2113", "PIC2116", *(c.loop for c in changes)}
    matched, _ = match(read_loops(SAMPLE_DATA / "loops.csv"), export.tags)
    specs = tuple(s for s in matched if s.loop in wanted)
    first = START_S + 7 * DAY_S
    store = Store(tmp_path_factory.mktemp("retuned") / "store")
    batch.run(Plant(export, specs, CONFIG, (first, first + DAY_S), changes), store, 1)
    rows = store.read("nights", store.require()).to_pylist()
    return {r["loop"]: r for r in rows}, {c.loop for c in changes}


def test_no_false_alarm_of_settings_on_the_day_of_a_change(retuned):
    """The night of seven recorded changes asks nobody to check settings, and names each change with its time."""
    rows, changed = retuned
    assert not [loop for loop, r in rows.items() if r["action"] == "check settings"]
    named = {loop for loop, r in rows.items() if r["settings_changed"]}
    assert named == changed
    assert rows["TIC2106"]["judged_since_s"] == START_S + 7 * DAY_S + 9 * HOUR + 600.0
    assert rows["TIC2106"]["reason"].startswith("since 09:10 (new settings): ")
    assert "; Ti 70 \u2192 520 s at 09:10" in rows["TIC2106"]["reason"]


def test_a_list_tells_every_loop_in_twenty_words(retuned):
    """Of the mill's loops on the day of seven changes none takes over 20 words in a list, and loses nothing."""
    for row in retuned[0].values():
        head, rest = in_short(row["reason"])
        assert len(brief(row, ("reason",))["reason"].split()) <= 20
        assert "; ".join(filter(None, (head, rest))) == row["reason"]


def test_a_follower_is_told_as_one_on_the_day_of_its_change(retuned):
    """LIC2103, fed by FIC2110, follows it, whose own row names it; its valve is left in peace."""
    rows, _ = retuned
    assert (rows["LIC2103"]["source_loop"], rows["LIC2103"]["valve_fault"]) == ("FIC2110", "none")
    assert "LIC2103" in rows["FIC2110"]["reason"]
