"""The indices of the literature are given with the verdict, on the page and in the JSON, and used in no decision."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.columns import BELIEVED, NIGHTS, row_of
from analyzer.loop.oscillation.detection import detect
from analyzer.loop.oscillation.field_indices import field_indices
from analyzer.pages.loop import loop_page
from analyzer.words.decision import as_data, indices
from identification.models import Pid
from proofs.plant import CONFIG, Sketch, prepared, record, simulate
from proofs.untidy.recorder import swinging_door
from tests.analyzer.conftest import RunPlant

STICKS = Sketch("valve", (1.5, 40.0, 8.0), 0.8, 40.0, stickband=3.0, slip_jump=1.5)
VALVES = {"horch", "kano", "choudhury", "yamashita", "ellipse", "he"}


@pytest.fixture(scope="module")
def worn():
    """Three hours of a loop with a sticking valve, and its oscillations."""
    made = prepared(simulate(STICKS))
    return made, detect(made.record, CONFIG.oscillation)


def indices_of(
    made, found, controller: Pid | None = STICKS.controller, kind: str = ""
) -> dict[str, list[float]]:
    """The stored indices."""
    return json.loads(field_indices(made, found, controller, kind, CONFIG))


def test_without_a_cycle_no_index_of_a_valve_is_stored():
    """Noise, a drift and a constant have no cycle: no index of a valve is stored, and all numbers are finite."""
    time = np.arange(10_000.0)
    for pv in (
        50.0 + np.random.default_rng(1).standard_normal(time.size),
        40.0 + 1e-3 * time,
        50.0 + 0.0 * time,
    ):
        made = replace(prepared(simulate(STICKS, 0.2)), record=record(pv, op=100.0 - pv))
        kept = indices_of(made, detect(made.record, CONFIG.oscillation))
        assert not VALVES & kept.keys()
        assert all(np.isfinite(x).all() for x in kept.values())


def test_each_index_has_its_own_conditions(worn):
    """Each index is computed only under its own conditions.

    Compressed trends have no waveform indices; a level has no odd correlation and is no flow; an unstated type counts
    as a flow. Without an integral time, or without OP, the indices that need them are missing.
    """
    made, found = worn
    assert indices_of(made, found).keys() == VALVES | {"hagglund", "idle"}
    assert indices_of(made, found, kind="level").keys() == {"he", "choudhury", "ellipse", "hagglund", "idle"}
    assert indices_of(made, found, kind="pressure").keys() >= {"horch"}
    assert not indices_of(made, found, kind="pressure").keys() & {"kano", "yamashita"}
    assert indices_of(made, found, None).keys() == VALVES
    assert indices_of(made, found, Pid(0.0, 40.0)).keys() == VALVES
    assert indices_of(replace(made, op_known=False), found).keys() == {"hagglund"}
    r = made.record
    door = prepared(simulate(STICKS))
    straight = replace(r, pv=swinging_door(r.pv, 0.5, 600), op=swinging_door(r.op, 0.5, 600))
    assert not VALVES & indices_of(replace(door, record=straight, compressed_share=0.9), found).keys()


def test_a_direct_acting_loop_has_the_same_indices(worn):
    """With OP and the sign of the controller reversed, each index is the same."""
    made, found = worn
    turned = replace(made, record=replace(made.record, op=100.0 - made.record.op))
    assert indices_of(turned, found, replace(STICKS.controller, kp=-STICKS.kp)) == indices_of(made, found)


def test_a_hole_is_not_bridged(worn):
    """Only the longest stretch without a hole is used: values before it change nothing."""
    made, found = worn
    r = made.record
    bad = r.bad.copy()
    bad[3000:3010] = True
    wild = np.where(np.arange(len(r)) < 3000, 99.0, r.pv)
    cut = replace(made, record=replace(r, bad=bad, pv=wild))
    assert indices_of(cut, found) == indices_of(replace(made, record=r.span(3010, len(r))), found)


def test_page_and_json_show_the_conclusion_of_a_publication():
    """The values of a row are on the page with the conclusion of the publication and of this program, and in the
    JSON.

    A row of a night before the column existed has neither.
    """
    kept = json.dumps({"horch": [0.9, 0.5], "he": [0.5], "hagglund": [3.0], "ellipse": [2.5]})
    known = {"loop": "FIC1", "night": "2026-03-02", "field_indices": kept, "harris_index": 0.4}
    known |= {"status": "ok", "valve_fault": "backlash", "backlash_pct": 2.1, "oscillating_pct": 90.0}
    row = row_of(known, (*NIGHTS, *BELIEVED))
    finds = {x["index"]: x["finds"] for x in as_data(row)["field_indices"]}
    assert finds == {"harris": None, "hagglund": False, "horch": True, "ellipse": None, "he": None}
    page = loop_page([row], None)
    (section,) = (s for s in page.sections if s.title == "Indices of the literature")
    cells = {r[0].text.split("(")[-1]: [c.text for c in r[1:]] for r in section.blocks[0].rows}
    assert cells["Horch 1999)"] == ["0.9, 0.5", "the valve sticks", "backlash"]
    assert cells["Hägglund 1995)"] == ["3", "does not oscillate", "90 % of the time"]
    assert cells["He 2007)"][1] == "undecided"
    assert cells["Choudhury 2006)"][2] == "2.1 %"
    assert indices(dict(row) | {"field_indices": None, "harris_index": None}) == []


def test_a_night_keeps_them_and_pages_show_them(run_plant: RunPlant, tmp_path: Path):
    """The page of an oscillating loop of a night has the table."""
    out = tmp_path / "p"
    done = CliRunner().invoke(
        main, ["pages", str(run_plant.store), "--out", str(out), "--top", "3", "--format", "markdown"]
    )
    assert done.exit_code == 0, done.output
    assert any("Indices of the literature" in p.read_text("utf-8") for p in out.glob("*.md"))
