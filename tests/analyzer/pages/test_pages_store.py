"""Pages show the content of the store, with a limited size and in limited time."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from analyzer.belief.nights import recompute_beliefs
from analyzer.columns import row_of
from analyzer.config import Config
from analyzer.loops.changes import TuningChange
from analyzer.pages import before_after, loop, morning, night
from analyzer.pages.before_after import wear_texts
from analyzer.pages.change_cases import change_cases, detected
from analyzer.pages.loop_pictures import autocorrelation, rhythm_plots, turn_panels
from analyzer.pages.morning import score
from analyzer.pages.reading import read_hours, read_night, read_trends
from analyzer.pages.words import PvScale
from analyzer.store.store import Store
from identification.errors import InputError
from reports import html
from reports.folder import write_csv, write_html, write_markdown
from reports.html import render
from reports.pages import Beside, Page, Plot, Table, Text
from tests.reports.small_store import NASTY, START_S, small_store

CHANGED_S = START_S + 7 * 86400.0


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """Two weeks of 30 invented loops."""
    return small_store(tmp_path_factory.mktemp("store"))


def table(page: Page, name: str) -> Table:
    """A table of a page by name."""
    return next(t for t in page.tables() if t.name == name)


def column(found: Table, key: str) -> list[float | None]:
    """Numbers of a column."""
    at = [c.key for c in found.columns].index(key)
    return [row[at].number for row in found.rows]


def test_ranking_holds_the_nights_numbers(store: Store) -> None:
    """Each number of the ranking equals that of the store exactly."""
    found = table(morning.morning_page(read_night(store, None, 5)), "ranking")
    rows = {r["loop"]: r for r in store.read("nights", store.require()).to_pylist()}
    tags = [row[0].text for row in found.rows]
    assert sorted(tags) == sorted(rows)
    for key in (c.key for c in found.columns if c.numeric):
        assert column(found, key) == [rows[t][key] for t in tags]


def test_before_after_means_are_the_hours(store: Store) -> None:
    """Means before and after equal the means of the store's hours, without the hours of the change."""
    loop = NASTY[0]
    (case,), missing = change_cases(store, [TuningChange(loop, CHANGED_S)])
    assert missing == []
    hours = read_hours(store, [loop], store.nights())[loop]
    at, name = hours["hour_s"], "average_absolute_error_pct"
    change = next(c for c in case.found.changes if c.measure.name == name)
    assert change.found.before == pytest.approx(hours[name][at < CHANGED_S].mean())
    assert change.found.after == pytest.approx(hours[name][at >= CHANGED_S + 3600].mean())
    assert change.verdict == "better"
    assert change.value_pct == pytest.approx(-50, abs=2)


def test_loops_that_the_store_lacks_are_named(store: Store) -> None:
    """A change of a loop that the store does not have is named with the reason; the others are evaluated."""
    found, missing = change_cases(store, [TuningChange("GONE", CHANGED_S), TuningChange(NASTY[1], CHANGED_S)])
    assert [c.found.loop for c in found] == [NASTY[1]]
    assert [m[0] for m in missing] == ["GONE"]
    assert "GONE" in render(before_after.changes_page(found, missing, ""))


def test_morning_page_names_every_loop_once(tmp_path: Path) -> None:
    """Loops that are not assessed are listed with their reason, and changes are listed under New and Better."""
    store = small_store(tmp_path)
    recompute_beliefs(store, Config())
    view = read_night(store, "2026-03-09", 50)
    page = morning.morning_page(view)
    lost = table(page, "not-assessed")
    assert [row[0].text for row in lost.rows] == sorted(r["loop"] for r in view.rows if r["status"] != "ok")
    assert all("needs a PV" in row[2].text for row in lost.rows)
    news = {t.name: [row[1].text for row in t.rows] for t in page.tables() if t.name in ("new", "better")}
    assert "began to oscillate" in news["new"]
    assert "stopped oscillating" in news["better"]


def test_first_night_has_nothing_before(store: Store) -> None:
    """The page of the first night says that it is the first night."""
    page = morning.morning_page(read_night(store, "2026-03-02", 3))
    texts = [b.paragraphs[0] for s in page.sections for b in s.blocks if isinstance(b, Text)]
    assert "This is the first night in the store." in texts


def test_unknown_night_is_an_error(store: Store) -> None:
    """A night that the store does not have is refused with the nights that it has."""
    with pytest.raises(InputError, match="2026-03-15"):
        list(night.pages_of_night(store, "1999-01-01"))


def test_trends_keep_extremes_and_gaps(store: Store) -> None:
    """Further thinning keeps minimum and maximum; a gap between nights is a gap in the trend."""
    nights = store.nights()
    loop = NASTY[2]
    thin = read_trends(store, [loop], [nights[0], nights[2]])[loop]
    coarse = thin.coarser(100)
    assert coarse.time_s.size == 100
    assert coarse.extremes["pv_max"].max() == thin.extremes["pv_max"].max()
    assert coarse.extremes["pv_min"].min() == thin.extremes["pv_min"].min()
    inside = (thin.time_s > START_S + 86400.0) & (thin.time_s < START_S + 2 * 86400.0)
    assert thin.gap[inside].all() or not inside.any()
    jump = int(np.argmax(np.diff(thin.time_s)))
    assert thin.gap[jump] or thin.gap[jump + 1]


def test_rhythm_shows_the_period(store: Store) -> None:
    """Autocorrelation and spectrum of a cycle of 400 s have their peaks at the mark."""
    loop = NASTY[0]
    thin = read_trends(store, [loop], store.nights()[:1])[loop]
    correlation, spectrum = rhythm_plots(thin, 400.0)
    assert isinstance(correlation, Plot)
    assert isinstance(spectrum, Plot)
    lag, height = correlation.lines[0].x, correlation.lines[0].y
    around = (lag > 4) & (lag < 10)
    assert lag[around][np.argmax(height[around])] == pytest.approx(400 / 60, abs=1.3)
    line = spectrum.lines[0]
    assert line.x[np.argmax(line.y)] == pytest.approx(9.0, abs=0.3)
    assert spectrum.marks[0].x == pytest.approx(9.0)


def test_short_periods_are_not_drawn_from_coarse_trends(store: Store) -> None:
    """A period that the stored trend cannot show is stated and not drawn."""
    loop = NASTY[0]
    thin = read_trends(store, [loop], store.nights()[:1])[loop]
    (found,) = rhythm_plots(thin, 30.0)
    assert isinstance(found, Text)
    assert "72 s" in found.paragraphs[0]


def test_autocorrelation_equals_its_definition() -> None:
    """The autocorrelation by Fourier transform equals the sum of products."""
    x = np.random.default_rng(0).normal(size=50)
    slow = [float((x[: 50 - k] * x[k:]).sum() / (x * x).sum()) for k in range(25)]
    np.testing.assert_allclose(autocorrelation(x), slow, atol=1e-12)


def test_area_score_weighs_importance() -> None:
    """The score is the share of loops without fault, weighted by importance; without an assessed loop there is no
    score.
    """
    row = {"status": "ok", "importance": 3.0, "cause": "none", "action": "none"}
    bad = {**row, "importance": 1.0, "cause": "valve"}
    frozen = {**row, "importance": 1.0, "action": "check measurement"}
    assert score([row, bad]) == score([row, frozen]) == 75.0
    assert score([{**row, "status": "failed"}]) is None


def test_wear_is_only_computed_from_stated_numbers(store: Store) -> None:
    """Valve life and cost are shown only if the plant states its numbers, and are computed from them."""
    (case,), _ = change_cases(store, [TuningChange(NASTY[0], CHANGED_S)])
    assert wear_texts(case.found, {}) == ()
    assert wear_texts(case.found, {"extra": '{"valve_life_travel_pct": "nonsense"}'}) == ()
    stated = '{"valve_life_travel_pct": "8760", "cost_per_error_pct_h": "2", "cost_unit": "EUR"}'
    life, cost = wear_texts(case.found, {"extra": stated})
    assert life.startswith("Valve life at this travel: 1.0")
    assert "2 years after" in life or "1.9" in life
    assert "EUR a year" in cost


def test_everything_is_written(store: Store, tmp_path: Path) -> None:
    """HTML, Markdown with its pictures, and a CSV of each table are written inside the folder."""
    pages = list(night.pages_of_night(store, None, 3))
    html, text = write_html(pages, tmp_path / "h"), write_markdown(pages, tmp_path / "m")
    tables = [p for page in pages for p in write_csv(page, tmp_path / "c")]
    assert len(html) == len(text) == 7
    assert len(tables) == sum(len(p.tables()) for p in pages)
    named = list((tmp_path / "m").rglob("*.svg"))
    assert len(named) == sum(t.read_text("utf-8").count("![") for t in text)
    assert all(p.resolve().is_relative_to(tmp_path) for p in (*html, *text, *tables))
    assert not list(tmp_path.rglob("*.tmp"))


def test_behaviour_changes_are_found(tmp_path: Path) -> None:
    """A loop whose valve moves four times as much for the same error is found as changed, at the right hour."""
    found = small_store(tmp_path, loops=6)
    for path in sorted((tmp_path / "hours").glob("*.parquet"))[7:]:
        rows = pq.read_table(path)
        at = rows.column_names.index("valve_travel_pct_per_h")
        more = np.where(np.array(rows["loop"]) == NASTY[4], 4.0, 1.0)
        moved = more * rows["valve_travel_pct_per_h"].to_numpy()
        pq.write_table(rows.set_column(at, "valve_travel_pct_per_h", [moved]), path)
    offered = detected(found, None, Config())
    assert [c.loop for c in offered] == [NASTY[4]]
    assert offered[0].time_s == pytest.approx(CHANGED_S, abs=3600)
    assert "4 times" in offered[0].seen


def test_a_big_plant_is_small(tmp_path: Path) -> None:
    """The morning page of 1,500 loops is under 1 MB without its assets; 50 loop pages with a week are under 1.5 MB
    each.
    """
    big = small_store(tmp_path / "store", loops=1500, nights=7, hours=False)
    written = write_html(night.pages_of_night(big, None, 50), tmp_path / "out", single_file=True)
    assert len(written) == 54
    assets = sum(len(html.asset(name)) for name in html.ASSETS)
    assert written[0].stat().st_size - assets < 1e6
    assert max(p.stat().st_size for p in written[1:]) < 1.5e6


def test_half_cycles_are_drawn_in_the_loops_unit() -> None:
    """Stored half-cycles become three pictures in the unit of the loop: falling ones are mirrored, sticking parts
    marked.
    """
    up = {
        "start_s": 0.0,
        "op": [10, 12, 14, 16],
        "pv": [50, 50, 50, 52],
        "late": [50, 50, 52, 54],
        "stuck": [0, 3],
    }
    down = {**up, "op": [16, 14, 12, 10], "pv": [52, 52, 52, 50], "late": [52, 52, 50, 48]}
    row = {"turns": json.dumps({"step_s": 6.0, "dead_s": 6.0, "halves": [up, down]}), "cause": "valve"}
    drawn = turn_panels(row, PvScale(0.0, 200.0, "m3/h"))
    assert drawn is not None
    over_op, over_pv, plane = drawn.plots
    assert [line.y.tolist() for line in over_op.lines if line.kind == "pv"] == [[0, 2, 4, 6]] * 2
    assert [line.y.tolist() for line in over_pv.lines if line.kind == "pv"] == [[0, 0, 0, 4]] * 2
    assert [line.y.tolist() for line in over_pv.lines if line.kind == "stuck"] == [[0, 0, 0, 4]] * 2
    assert [line.x.tolist() for line in plane.lines if line.kind == "stuck"] == [
        [10, 12, 14, 16],
        [16, 14, 12, 10],
    ]
    assert "m3/h" in plane.y_label
    assert turn_panels({"turns": None, "cause": "valve"}, PvScale(0.0, 1.0, "")) is None


def test_a_follower_is_linked_with_its_source() -> None:
    """The page of a loop that follows another one links to both on one time axis, for any characters in their
    names.
    """
    known = {"loop": "A 1", "night": "2026-03-02", "status": "ok", "source_loop": "B,2"}
    row = row_of(known)
    links = loop.loop_page([row | dict.fromkeys(set(loop.COLUMNS) - set(row))], None).links
    assert ("Compare with B,2", "side-by-side.html#B%2C2,A%201") in links


def test_loops_side_by_side_have_their_own_units(tmp_path: Path) -> None:
    """Next to other loops, the trend of a loop has the unit and the values of its own page."""
    store = small_store(tmp_path / "store")
    file = store.file("nights", store.require())
    whole = pq.read_table(file)
    for name, value in {"pv_lo": -40.0, "pv_hi": 160.0, "pv_unit": "degC"}.items():
        at = whole.column_names.index(name)
        whole = whole.set_column(at, whole.schema.field(name), [[value] * whole.num_rows])
    pq.write_table(whole, file)
    (neighbours,) = night.side_by_side(store, read_night(store, None, 1)).sections[0].blocks
    assert isinstance(neighbours, Beside)
    (shown,) = neighbours.trends
    thin = read_trends(store, [shown.title], [store.require()])[shown.title]
    assert shown.panels[0] == "SP, PV [degC]"
    assert shown.bands[0].low.min() == pytest.approx(-40.0 + 2.0 * thin.extremes["pv_min"].min())


def test_beliefs_without_a_column_of_this_version_are_read(tmp_path: Path) -> None:
    """A column that is missing from beliefs of an earlier version is unknown, and the others are unchanged."""
    old = small_store(tmp_path / "store")
    recompute_beliefs(old, Config())
    night = old.require()
    whole = old.rows("nights", night, ["loop", "growing", "worn_pct"])
    file = old.file("beliefs", night)
    pq.write_table(pq.read_table(file).drop_columns(["growing"]), file)
    assert old.rows("nights", night, ["loop", "growing", "worn_pct"]) == [
        {**r, "growing": None} for r in whole
    ]
