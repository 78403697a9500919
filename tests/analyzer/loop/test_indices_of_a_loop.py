"""The literature's indices of a loop: beside the verdict, on its page and in its JSON, and in no decision."""

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
    """Three hours of a loop whose valve sticks, and what oscillates in it."""
    made = prepared(simulate(STICKS))
    return made, detect(made.record, CONFIG.oscillation)


def told(made, found, controller: Pid | None = STICKS.controller, kind: str = "") -> dict[str, list[float]]:
    """The indices that are kept."""
    return json.loads(field_indices(made, found, controller, kind, CONFIG))


def test_where_nothing_cycles_no_index_of_a_valve_is_kept():
    """Noise, a drift and a constant have no cycle: nothing of a valve is said, and no number that is not finite."""
    time = np.arange(10_000.0)
    for pv in (
        50.0 + np.random.default_rng(1).standard_normal(time.size),
        40.0 + 1e-3 * time,
        50.0 + 0.0 * time,
    ):
        made = replace(prepared(simulate(STICKS, 0.2)), record=record(pv, op=100.0 - pv))
        kept = told(made, detect(made.record, CONFIG.oscillation))
        assert not VALVES & kept.keys()
        assert all(np.isfinite(x).all() for x in kept.values())


def test_each_index_keeps_to_its_own_conditions(worn):
    """Compressed trends have no shape; a level has no odd correlation and is no flow; what is not stated counts as
    a flow; without an integral time, or OP, nothing that needs them."""
    made, found = worn
    assert told(made, found).keys() == VALVES | {"hagglund", "idle"}
    assert told(made, found, kind="level").keys() == {"he", "choudhury", "ellipse", "hagglund", "idle"}
    assert told(made, found, kind="pressure").keys() >= {"horch"}
    assert not told(made, found, kind="pressure").keys() & {"kano", "yamashita"}
    assert told(made, found, None).keys() == VALVES
    assert told(made, found, Pid(0.0, 40.0)).keys() == VALVES
    assert told(replace(made, op_known=False), found).keys() == {"hagglund"}
    r = made.record
    door = prepared(simulate(STICKS))
    straight = replace(r, pv=swinging_door(r.pv, 0.5, 600), op=swinging_door(r.op, 0.5, 600))
    assert not VALVES & told(replace(door, record=straight, compressed_share=0.9), found).keys()


def test_a_direct_acting_loop_has_the_same_indices(worn):
    """OP and the controller's sign turned leave every index: so much is in no publication's sign."""
    made, found = worn
    turned = replace(made, record=replace(made.record, op=100.0 - made.record.op))
    assert told(turned, found, replace(STICKS.controller, kp=-STICKS.kp)) == told(made, found)


def test_a_hole_is_not_bridged(worn):
    """The longest stretch without a hole is what is looked at: what stands before it changes nothing."""
    made, found = worn
    r = made.record
    bad = r.bad.copy()
    bad[3000:3010] = True
    wild = np.where(np.arange(len(r)) < 3000, 99.0, r.pv)
    cut = replace(made, record=replace(r, bad=bad, pv=wild))
    assert told(cut, found) == told(replace(made, record=r.span(3010, len(r))), found)


def test_page_and_json_tell_what_a_publication_concludes():
    """A row's values stand on the page with the publication's conclusion and ours beside it, and in the JSON of a
    decision; a row of a night before the column was kept has neither."""
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
    """The page of a loop of a night that swings has the table."""
    out = tmp_path / "p"
    done = CliRunner().invoke(
        main, ["pages", str(run_plant.store), "--out", str(out), "--top", "3", "--format", "markdown"]
    )
    assert done.exit_code == 0, done.output
    assert any("Indices of the literature" in p.read_text("utf-8") for p in out.glob("*.md"))
