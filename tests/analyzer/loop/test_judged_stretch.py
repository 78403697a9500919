"""A verdict is based on one stretch, in automatic and with one pair of settings."""

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


def half_in_manual(backlash: float) -> tuple[Trends, np.ndarray]:
    """Three hours of a flow in automatic, then three in manual, and the mask of the time in manual."""
    n = 6 * HOUR
    rng = np.random.default_rng(5)
    manual = np.arange(n) >= n // 2
    load, noise = wander(rng, n, 0.3, 1800.0), 0.05 * rng.standard_normal(n)
    own = (np.full(n, PI.kp), np.full(n, PI.ti_s), np.zeros(n), manual)
    pv, op, stem = run(np.full(n, 50.0), load, noise, *own, 50.0, (backlash, 0.0, 0.0), (12.0, 150.0, 6.0))
    return Trends(np.full(n, 50.0), pv, op, stem), manual


@pytest.mark.parametrize(("backlash", "cause"), [(2.7, "valve"), (0.0, "none")])
def test_a_half_in_manual_does_not_change_the_verdict(backlash, cause):
    """A backlash is found in the half of the night in automatic, and a valve without fault has no cause."""
    trends, manual = half_in_manual(backlash)
    whole = prepared(trends)
    masks = {**whole.record.masks, "manual": manual}
    found = assess(replace(whole, record=replace(whole.record, masks=masks)), PI, CONFIG)
    assert found.verdict.cause == cause
    assert found.judged_h == pytest.approx(3.0, abs=0.01)
    if backlash:
        assert found.verdict.measured.backlash.valve.stickband == pytest.approx(backlash, rel=0.15)


def still(hours: float, manual: slice = slice(0)) -> LoopRecord:
    """A record of that many hours with a part in manual; its trends do not matter."""
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
    """Data before a change are not used for the settings in force.

    If the time since the change is too short, the longest part is assessed with its own settings, which are outdated.
    """
    earlier = [Earlier(START_S + h * HOUR, spec("L"), OLD) for h in changed_h]
    found = judged_stretch(still(24.0), PI, earlier, CONFIG)
    assert (found.first / HOUR, found.last / HOUR, found.controller, found.outdated) == expected


def test_pieces_too_short_for_the_record_are_not_chosen():
    """Six automatic hours, separated by half hours in manual, are assessed together."""
    record = still(6.0)
    for hour in range(6):
        record.mask("manual")[hour * HOUR : hour * HOUR + HOUR // 2] = True
    found = judged_stretch(record, PI, (), CONFIG)
    assert (found.first, found.last) == (0, len(record))


@pytest.fixture(scope="module")
def retuned(tmp_path_factory):
    """Rows by loop of the night in which seven loops of the sample mill were retuned according to changes.csv.

    Three loops without a change are included.
    """
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
    """On the night of seven recorded changes no loop gets 'check settings', and each change is named with its
    time.
    """
    rows, changed = retuned
    assert not [loop for loop, r in rows.items() if r["action"] == "check settings"]
    named = {loop for loop, r in rows.items() if r["settings_changed"]}
    assert named == changed
    assert rows["TIC2106"]["judged_since_s"] == START_S + 7 * DAY_S + 9 * HOUR + 600.0
    assert rows["TIC2106"]["reason"].startswith("since 09:10 (new settings): ")
    assert "; Ti 70 \u2192 520 s at 09:10" in rows["TIC2106"]["reason"]


def test_a_list_describes_each_loop_in_twenty_words(retuned):
    """On the day of seven changes, no loop of the mill needs more than 20 words in a list, and no text is lost."""
    for row in retuned[0].values():
        head, rest = in_short(row["reason"])
        assert len(brief(row, ("reason",))["reason"].split()) <= 20
        assert "; ".join(filter(None, (head, rest))) == row["reason"]


def test_a_follower_is_reported_as_one_on_the_day_of_its_change(retuned):
    """LIC2103, which FIC2110 feeds, follows it, and the row of FIC2110 names it; the valve of LIC2103 gets no
    fault.
    """
    rows, _ = retuned
    assert (rows["LIC2103"]["source_loop"], rows["LIC2103"]["valve_fault"]) == ("FIC2110", "none")
    assert "LIC2103" in rows["FIC2110"]["reason"]
