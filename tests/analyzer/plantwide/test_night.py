"""Results of a night for loops that share an oscillation: rows, groups, list and pages agree with the simulated
truth.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from typing import Any

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.columns import GROUP_LIST, names
from analyzer.lanes.lanes import lanes_in
from analyzer.loop.decisions import counts
from analyzer.pages import groups
from analyzer.pages.night import pages_of_night
from analyzer.plantwide.view import GroupView
from analyzer.store.store import Store
from reports.html import render
from reports.pages import Graph, HeatMap, Trend
from reports.pictures import as_file
from tests.analyzer.conftest import RunPlant

Row = Mapping[str, Any]


def rows(plant: RunPlant, table: str = "nights") -> list[Row]:
    """Rows of the night."""
    store = Store(plant.store)
    return store.read(table, store.require()).to_pylist()


def listed(plant: RunPlant, form: str) -> str:
    """The output of `triage rank --groups`."""
    done = CliRunner().invoke(
        main, ["rank", str(plant.store), "--groups", "--format", form], catch_exceptions=False
    )
    assert done.exit_code == 0
    return done.output


def source(plant: RunPlant) -> str:
    """The loop with the sticking valve."""
    return next(name for name, t in plant.truth.items() if t["role"] == "source")


def followers(plant: RunPlant, swell: float) -> set[str]:
    """Loops whose error the sticking valve increases by at least this factor."""
    return {name for name, t in plant.truth.items() if t["role"] == "follower" and t["swell"] >= swell}


def test_the_loops_that_the_source_moves_follow_it(run_plant: RunPlant):
    """Of six loops whose error the sticking valve doubles, at least five follow it; the source keeps its verdict."""
    by_name = {r["loop"]: r for r in rows(run_plant)}
    lead = source(run_plant)
    followers_found = [by_name[name] for name in followers(run_plant, 2.0) if by_name[name]["source_loop"]]
    assert len(followers_found) >= 5
    for row in followers_found:
        assert (row["source_loop"], row["cause"], row["action"]) == (lead, "load", "see source loop")
    assert by_name[lead]["cause"] == "valve"
    assert by_name[lead]["source_loop"] is None
    assert "fix this one first" in by_name[lead]["reason"]


def test_each_oscillating_loop_is_in_that_lane(run_plant: RunPlant):
    """Lanes are assigned after the plant-wide pass: exactly the loops that oscillate after it are in the oscillation
    lane.
    """
    found = rows(run_plant)
    assert {r["loop"] for r in found if "oscillation" in lanes_in(r)} == {
        r["loop"] for r in found if counts(r["oscillating_pct"])
    }
    assert any(r["source_loop"] for r in found)


def test_no_follower_gets_settings(run_plant: RunPlant):
    """Loops that follow another loop get no settings, and loops without a coupling to the source follow none."""
    for row in rows(run_plant):
        if row["source_loop"]:
            assert row["kp_new"] is None
            assert row["ti_new"] is None
            assert run_plant.truth[row["loop"]]["roots"], row["loop"]


def test_the_group_is_listed_in_every_format(run_plant: RunPlant):
    """Table, CSV, JSON and Markdown name the loop to fix first and the loops that would improve."""
    lead = source(run_plant)
    (first, *_) = json.loads(listed(run_plant, "json"))
    assert first["fix_first"] == lead
    assert len(followers(run_plant, 2.0) & set(first["members"])) >= 5
    table = list(csv.DictReader(io.StringIO(listed(run_plant, "csv"))))
    assert tuple(table[0]) == names(GROUP_LIST)
    assert table[0]["fix_first"] == lead
    for form in ("table", "markdown"):
        assert lead in listed(run_plant, form)
    assert sum(first["candidates"].values()) + first["unseen_pct"] <= 100.5


def test_groups_have_pages_with_pictures(run_plant: RunPlant):
    """The morning page links to a page of the group with the path, the trends and the spectra of its loops."""
    found = {p.name: p for p in pages_of_night(Store(run_plant.store))}
    assert 'href="group-1.html"' in render(found["index"])
    blocks = [b for s in found["group-1"].sections for b in s.blocks]
    (way,) = (b for b in blocks if isinstance(b, Graph))
    (spectra,) = (b for b in blocks if isinstance(b, HeatMap))
    (trend,) = (b for b in blocks if isinstance(b, Trend))
    assert way.nodes[0].name == source(run_plant)
    assert {a.last for a in way.arrows} == {n.name for n in way.nodes[1:]}
    assert set(trend.panels) == set(spectra.rows)
    assert all(as_file(b).startswith("<svg ") for b in (way, spectra, trend))
    assert "group-1.html" in "".join(
        render(p) for p in found.values() if p.title in followers(run_plant, 2.0)
    )


def test_the_table_of_groups_has_roles_and_gains(run_plant: RunPlant):
    """Each group has one source, confidences that leave room for an unseen source, and gains not larger than the
    error.
    """
    errors = {r["loop"]: r["average_absolute_error_pct"] for r in rows(run_plant)}
    for row in rows(run_plant, "groups"):
        assert 0 <= row["gain_pct"] <= errors[row["loop"]]
        assert (row["parent"] is None) == (row["coherence"] == 1.0 and row["lag_s"] == 0.0)
    by_group: dict[str, float] = {}
    for row in rows(run_plant, "groups"):
        by_group[row["group"]] = by_group.get(row["group"], 0.0) + row["source_pct"]
    assert all(total < 97.0 for total in by_group.values())


def test_a_second_run_of_some_loops_keeps_the_others_group(run_plant: RunPlant, tmp_path):
    """Groups of another export of the night are numbered after the groups that the store has."""
    import shutil

    store = tmp_path / "store"
    shutil.copytree(run_plant.store, store)
    alone = next(name for name, t in run_plant.truth.items() if t["role"] == "healthy" and not t["roots"])
    (tmp_path / "loops.csv").write_text(f"loop,pv_lo,pv_hi\n{alone},0,100\n")
    arguments = ["run", str(run_plant.export), "--loops", str(tmp_path / "loops.csv"), "--store", str(store)]
    assert CliRunner().invoke(main, [*arguments, "--jobs", "1"], catch_exceptions=False).exit_code == 0
    kept = Store(store)
    found = kept.read("groups", kept.require()).to_pylist()
    assert [r["loop"] for r in found] == [r["loop"] for r in rows(run_plant, "groups")]


@pytest.mark.parametrize("form", ["table", "json", "csv", "markdown"])
def test_a_night_without_groups_says_so(tmp_path, form):
    """A store whose night has no groups lists none and gives no error."""
    from analyzer.columns import NIGHTS
    from analyzer.store.table import rows_table, write_table

    path = tmp_path / "nights" / "2026-03-02.parquet"
    write_table(rows_table([{"loop": "FIC1", "status": "ok"}], NIGHTS), path)
    done = CliRunner().invoke(
        main, ["rank", str(tmp_path), "--groups", "--format", form], catch_exceptions=False
    )
    assert done.exit_code == 0
    if form == "table":
        assert "no loops share an oscillation" in done.output


def test_list_and_page_show_the_same_confidence():
    """A confidence is rounded once: the list and the morning page show the same percentage of a source."""
    known = {"role": "source", "group_period_s": 60.0, "source_pct": 63.46, "gain_pct": None}
    night = {"cause": "valve", "action": "repair valve", "kp_new": None, "ti_new": None}
    group = GroupView("1", ({**known, "loop": "A"},), {"A": night})
    assert "A 63 %" in [cell.text for cell in groups.morning_table([group], False).rows[0]]
    assert all("A 63 %" in groups.rendered_groups([group], "N", form) for form in ("table", "markdown"))
