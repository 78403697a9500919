"""Settings have dates: each night has the settings in force at its end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.history.stamps import parse_time
from analyzer.loops.changes import TuningChange, in_force, read_changes, settings_from
from analyzer.loops.tags import match, read_loops
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.pages.change_cases import detected
from analyzer.store.store import Store
from identification.errors import InputError
from proofs.plant import START_S, Sketch, Trends, simulate, spec, write_export

LOOP = spec("L", kp=1.0, ti=10.0)
FIRST = TuningChange("L", 100.0, 1.0, 10.0, 2.0, 20.0)
SECOND = TuningChange("L", 200.0, kp_new=3.0)


@pytest.mark.parametrize(
    ("at_s", "expected"),
    [
        (50.0, (0.5, 5.0)),
        (100.0, (2.0, 20.0)),
        (150.0, (2.0, 20.0)),
        (200.0, (3.0, 20.0)),
        (1e9, (3.0, 20.0)),
    ],
)
def test_the_last_change_before_a_time_applies(at_s, expected):
    """Before the first change the old settings apply, then those of the last change; a value that a change omits is
    unchanged.
    """
    first = TuningChange("L", 100.0, 0.5, 5.0, 2.0, 20.0)
    found = in_force(LOOP, (SECOND, TuningChange("M", 60.0, kp_new=9.0), first), at_s)
    assert (found.kp, found.ti) == expected


def test_without_changes_loops_csv_applies():
    """Without changes, or with changes of other loops only, the settings of loops.csv are unchanged."""
    assert in_force(LOOP, (), 0.0) is LOOP
    assert in_force(LOOP, (TuningChange("M", 0.0, kp_new=9.0),), 1e9) is LOOP


def test_a_run_advises_on_the_settings_in_force(tmp_path):
    """If the gain in loops.csv is old by a factor of two, the date of the change turns 'check settings' into a
    retune.
    """
    pipe = Sketch("valve", (12.0, 150.0, 6.0), 0.65, 30.0, backlash=2.5, load_std=0.1)
    export = open_export([write_export(tmp_path / "x.parquet", {"L": simulate(pipe, 6.0)})])
    stale = match([spec("L", kp=0.3, ti=90.0, scan_s=1.0)], export.tags)[0]
    dated = (TuningChange("L", START_S - 86400.0, 0.3, 90.0, 0.65, 30.0),)
    rows = []
    for changes in ((), dated):
        store = Store(tmp_path / f"store{len(changes)}")
        batch.run(Plant(export, stale, Config(), changes=changes), store)
        (row,) = store.read("nights", store.require()).to_pylist()
        rows.append(row)
    assert [r["action"] for r in rows] == ["check settings", "retune"]
    assert (rows[1]["kp"], rows[1]["ti"]) == (0.65, 30.0)


def test_a_date_without_a_time_belongs_to_the_night_that_begins_there(tmp_path):
    """Settings dated at midnight apply to the night that begins then.

    The night before keeps the old ones without 'check settings', and the change is found at that time.
    """
    flow = Sketch("none", (1.0, 40.0, 8.0), 1.0, 30.0, moves=3.0)
    changed = replace(flow, kp=0.4, ti=60.0)
    days = [simulate(s, 24.0, seed) for seed, s in enumerate((flow, flow, changed, changed))]
    joined = Trends(
        *(np.concatenate([getattr(d, n)[::10] for d in days]) for n in ("sp", "pv", "op", "stem"))
    )
    export = open_export([write_export(tmp_path / "x.parquet", {"L": joined}, dt_s=10.0)])
    stated = match([spec("L", kp=1.0, ti=30.0, scan_s=1.0)], export.tags)[0]
    path = tmp_path / "changes.csv"
    path.write_text("loop,time,kp_old,ti_old,kp_new,ti_new\nL,2026-03-04,1,30,0.4,60\n", encoding="utf-8")
    store = Store(tmp_path / "store")
    batch.run(Plant(export, stated, Config(), changes=read_changes(path)), store)
    rows = [store.read("nights", night).to_pylist()[0] for night in store.nights()]
    assert [r["kp"] for r in rows] == [1.0, 1.0, 0.4, 0.4]
    assert not any(r["settings_changed"] or r["action"] == "check settings" for r in rows)
    (found,) = detected(store, None, Config())
    assert found.time_s == START_S + 2 * 86400.0


DATED = """loop,kp,ti,gain_unit,valid_from
L,1,10,percent,
L,50,20,band,2026-03-09 08:00
L,40,30,band,2026-03-12T08:00:00Z
M,5,50,percent,
"""


@pytest.mark.parametrize(
    ("at", "expected"),
    [
        ("2026-03-01", (1.0, 10.0, "percent")),
        ("2026-03-09 05:59", (1.0, 10.0, "percent")),
        ("2026-03-09 06:00", (50.0, 20.0, "band")),
        ("2026-03-20", (40.0, 30.0, "band")),
    ],
)
def test_dated_rows_of_loops_csv(tmp_path, at, expected):
    """Each row applies from its valid_from on, in the clock of the plant if no zone is given, with its own units."""
    path = tmp_path / "loops.csv"
    path.write_text(DATED, encoding="utf-8")
    loops = read_loops(path, "Europe/Helsinki")
    assert [s.loop for s in loops] == ["L", "M"]
    found = in_force(loops[0], (), parse_time(at, "here"))
    assert (found.kp, found.ti, found.gain_unit) == expected


def test_two_rows_at_one_time_are_reported(tmp_path):
    """Two rows of one loop without different dates are refused."""
    path = tmp_path / "loops.csv"
    path.write_text("loop,kp,valid_from\nL,1,\nL,2,\n", encoding="utf-8")
    with pytest.raises(InputError, match="different times in valid_from"):
        read_loops(path)


@pytest.mark.parametrize(
    ("at_s", "expected"),
    [
        (50.0, "changes.csv, before 1970-01-01"),
        (100_000.0, "changes.csv, from 1970-01-01"),
        (200_000.0, "changes.csv, from 1970-01-03"),
    ],
)
def test_the_page_says_where_settings_come_from(at_s, expected):
    """Settings of changes.csv are reported with the day of the change, in days of the plant."""
    first = TuningChange("L", 100.0, 0.5, 5.0, 2.0, 20.0)
    second = TuningChange("L", 2 * 86400.0 - 3600.0, kp_new=3.0)
    assert settings_from(LOOP, (second, first), at_s, "Europe/Helsinki") == expected


def test_loops_csv_is_named_without_a_change_of_settings():
    """Without changes the settings are those of loops.csv; if none are stated, the source is empty."""
    assert settings_from(LOOP, (), 50.0, "UTC") == "loops.csv"
    assert settings_from(LOOP, (TuningChange("L", 10.0, who="me"),), 50.0, "UTC") == "loops.csv"
    assert settings_from(spec("M", kp=None, ti=None), (), 50.0, "UTC") == ""
