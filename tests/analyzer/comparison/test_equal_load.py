"""Before and after on equal load: the part of the change is separated from the part of the load."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyzer.comparison.before_after import Reference, grade, parts_of, reference
from analyzer.comparison.equal_load import FIGURES, NO_RATIO, EqualLoad, LogRatio, Weeks
from analyzer.comparison.loop_night import LoopNight, pid_of
from analyzer.comparison.measures import Change, Grade, Span
from analyzer.history.export import open_export
from analyzer.loop.oscillation.figures import travel_of
from analyzer.loops.changes import TuningChange
from analyzer.loops.spec import LoopSpec, controller_columns
from analyzer.loops.tags import controller, match
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.pages.before_after import changes_page, outcome
from analyzer.pages.change_cases import ChangeCase, _evidence, change_cases
from analyzer.store.store import Store
from identification.models import ErrorForm, Form, Pid
from proofs.before_after_plant import LOADS, changed, truth
from proofs.plant import CONFIG, START_S, Sketch, Trends, simulate, spec, write_export
from reports.markdown import render

DAYS, DAY_S = 4, 86400.0
PIPE = Sketch("none", (1.2, 120.0, 15.0), 1.6, 90.0, noise=0.03, load_std=0.6, load_s=300.0)
WORN = replace(PIPE, backlash=3.0, process=(1.2, 200.0, 12.0), kp=2.5, ti=60.0, load_std=0.2)
AFTER = {
    "DOUBLED": (PIPE, replace(PIPE, load_std=1.2)),
    "SLOWED": (PIPE, replace(PIPE, kp=0.6, load_std=1.2)),
    "RETUNED": (WORN, replace(WORN, ti=400.0)),
}


def days(sketch: Sketch, seed: int) -> Trends:
    """Four days of a sketch, every tenth second."""
    made = simulate(sketch, 24.0 * DAYS, seed)
    return Trends(*(getattr(made, name)[::10] for name in ("sp", "pv", "op", "stem")))


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ChangeCase]:
    """Three loops, four days before and after: only the load doubled; slowed under twice the load; worn valve and
    retuned.
    """
    folder = tmp_path_factory.mktemp("equal")
    trends = {}
    for seed, (name, (before, after)) in enumerate(AFTER.items()):
        pair = days(before, seed), days(after, 100 + seed)
        trends[name] = Trends(
            *(np.concatenate([getattr(t, x) for t in pair]) for x in ("sp", "pv", "op", "stem"))
        )
    export = open_export([write_export(folder / "x.parquet", trends, dt_s=10.0)])
    specs = [spec(name, kp=a.kp, ti=a.ti, scan_s=1.0) for name, (a, _) in AFTER.items()]
    at_s = START_S + DAYS * DAY_S
    changes = [TuningChange(name, at_s, a.kp, a.ti, b.kp, b.ti) for name, (a, b) in AFTER.items()]
    changes[0] = TuningChange("DOUBLED", at_s)
    store = Store(folder / "store")
    batch.run(Plant(export, match(specs, export.tags)[0], CONFIG, changes=changes), store)
    found, missing = change_cases(store, changes, DAYS)
    assert missing == []
    return {c.found.loop: c for c in found}


def figure(case: ChangeCase, name: str) -> Change:
    """The primary change of a figure of a loop."""
    return next(c for c in case.found.primary if c.measure.name == name)


def true_error(before: Sketch, after: Sketch) -> float:
    """Logarithm of the ratio of the errors of two loops under the same load."""
    sizes = []
    for sketch in (before, after):
        made = simulate(replace(sketch, load_std=before.load_std), 24.0, 7)
        sizes.append(float(np.mean(np.abs(made.sp - made.pv))))
    return math.log(sizes[1] / sizes[0])


def test_a_load_that_doubles_is_not_an_effect_of_the_change(cases: dict[str, ChangeCase]) -> None:
    """If only the load doubled, the change has no effect on the error, and the load is named as the reason."""
    case = cases["DOUBLED"]
    assert grade(case.found) is Grade.SAME
    error = figure(case, "average_absolute_error_pct")
    assert error.value_pct is not None
    assert error.value_pct > 50
    assert error.parts is not None
    assert error.parts.change == NO_RATIO
    assert error.parts.load.value == pytest.approx(math.log(2.0), abs=0.25)
    assert "different load" in outcome(case.found)


def test_the_part_of_new_settings_is_reported_under_another_load(cases: dict[str, ChangeCase]) -> None:
    """A loop is slowed under twice the load: its travel is better and its error worse by the part of the change.

    The interval of that part contains the truth, and the error that was traded for travel is not red.
    """
    case = cases["SLOWED"]
    error, travel = (figure(case, n) for n in ("average_absolute_error_pct", "valve_travel_pct_per_h"))
    assert any("different load" in reason for reason in case.found.reasons)
    assert error.parts is not None
    assert travel.parts is not None
    low, high = error.parts.change.interval(1.96)
    assert low < true_error(*AFTER["SLOWED"]) < high
    assert error.parts.load.value == pytest.approx(math.log(2.0), abs=0.35)
    assert grade(case.found) is Grade.TRADED
    page = changes_page([case], [], "test")
    kinds = {
        cell.kind
        for block in page.sections
        for table in block.blocks
        if hasattr(table, "rows")
        for row in table.rows
        for cell in row
        if cell.text in ("worse", "better")
    }
    assert kinds == {"better", "unclear"}


def test_travel_of_a_worn_valve_is_that_of_the_stem(cases: dict[str, ChangeCase]) -> None:
    """With backlash, the travel of the stem is compared and its interval contains the truth; the travel of OP is also
    listed.
    """
    case = cases["RETUNED"]
    stem = figure(case, "valve_travel_pct_per_h")
    assert "stem" in stem.measure.title
    assert next(c.measure.title for c in case.found.changes if not c.measure.primary) == "Travel of OP"
    use, band = np.ones(round(DAYS * 8640), dtype=bool), CONFIG.figures.travel_deadband_pct
    stems = [days(s, seed).stem.copy() for s, seed in zip(AFTER["RETUNED"], (2, 102), strict=True)]
    moved = [travel_of(x, use, 1, band)[0] for x in stems]
    assert stem.parts is not None
    low, high = stem.parts.change.interval(1.96)
    assert low < math.log(moved[1] / moved[0]) < high
    assert stem.parts.promised.value == pytest.approx(stem.parts.change.value, abs=1.0)


def test_remarks_are_written_once(cases: dict[str, ChangeCase]) -> None:
    """The reason why two weeks differ is written once in the table of figures, and not in each row."""
    text = render(changes_page([cases["SLOWED"]], [], "test"))
    table = text.partition("## Figures before and after")[2]
    assert table.count("different load") == 1


def simulated(value: float, deviation: float) -> EqualLoad:
    """A simulated change of every figure by `value`, without an effect of the load."""
    of = dict.fromkeys(FIGURES, LogRatio(value, deviation))
    return EqualLoad(of, dict.fromkeys(FIGURES, NO_RATIO), of, NO_RATIO)


def test_measured_and_simulated_changes_are_weighted() -> None:
    """In comparable weeks a precise measurement outweighs the simulation; if they contradict each other, the interval
    contains both.
    """
    limits = CONFIG.before_after
    found = parts_of(LogRatio(-0.5, 0.05), simulated(-0.4, 0.05), FIGURES[0], True, limits)
    assert found.change.value == pytest.approx(-0.5, abs=0.03)
    apart = parts_of(LogRatio(1.0, 0.02), simulated(0.0, 0.02), FIGURES[0], True, limits)
    low, high = apart.change.interval(1.96)
    assert low < 0.02
    assert high > 0.98
    other = parts_of(LogRatio(1.0, 0.02), simulated(-0.3, 0.02), FIGURES[0], False, limits)
    assert other.change == LogRatio(-0.3, 0.02)
    assert other.left.value == pytest.approx(1.3)


def test_changes_of_unchanged_loops_are_a_reference() -> None:
    """Six unchanged loops whose errors all rose by half give the common change; four loops give none."""
    rng = np.random.default_rng(3)
    hours = []
    for _ in range(6):
        later = np.arange(336) >= 168
        error = np.where(later, 1.5, 1.0) * (1 + 0.05 * rng.standard_normal(336))
        names = (
            "average_absolute_error_pct",
            "valve_travel_pct_per_h",
            "oscillation_significance",
            "variability_pct",
        )
        column = dict.fromkeys(names, error)
        hours.append({"hour_s": 3600.0 * np.arange(336), "usable_h": np.ones(336), **column})
    spans = Span(0.0, 168 * 3600.0), Span(168 * 3600.0, 336 * 3600.0)
    found = reference(hours, *spans)
    assert isinstance(found, Reference)
    assert found.of["average_absolute_error_pct"].value == pytest.approx(math.log(1.5), abs=0.02)
    assert reference(hours[:4], *spans) is None


@pytest.mark.parametrize(("before", "count"), [("none", 1), ("check settings", 0)])
def test_settings_that_were_never_typed_in_are_reported(before: str, count: int) -> None:
    """If OP follows other settings only on the nights after a change, the report says that the change was not typed
    in.

    If OP follows other settings before the change too, the stated settings are wrong, and this does not prevent a
    comparison.
    """
    known = {"duration_s": DAY_S, "kp": None, "travel_of": "OP"}
    rows = [
        {**known, "start_s": DAY_S * k, "action": before if k < DAYS else "check settings"}
        for k in range(2 * DAYS)
    ]
    spans = Span(0.0, DAYS * DAY_S), Span(DAYS * DAY_S, 2 * DAYS * DAY_S)
    found = _evidence(rows, {}, TuningChange("L", DAYS * DAY_S), spans, CONFIG.before_after)
    assert len(found.reasons) == count
    assert found.simulated is None


def test_the_loops_of_the_proof_change_as_stated() -> None:
    """In the proof, one loop in three changes in load only: its part due to the change is small, and its part due to
    the load large.
    """
    found = changed(3, 6)
    assert [c.what in LOADS for c in found] == [False, True, False] * 2
    own = truth(found[1])["average_absolute_error_pct"]
    assert abs(own[0]) < 0.05 < abs(own[1])


def test_reports_are_written_as_text(cases: dict[str, ChangeCase], tmp_path: Path) -> None:
    """The page of all three loops names both parts in its table."""
    text = render(changes_page(list(cases.values()), [], "test"))
    assert "Due to the change %" in text
    assert "Due to load and set point %" in text


def night(worn: bool, cycles: bool) -> LoopNight:
    """A night of a loop with or without backlash of the valve and with or without a cycle."""
    flat = np.zeros(8)
    return LoopNight(
        None, 1.0, 2.0, 0.0, True, worn, 0.0, flat, flat, 86400.0, 0.1, 10.0, 0.0, 0.0, False, cycles
    )


@pytest.mark.parametrize(("cycles", "repaired"), [(False, True), (True, False)])
def test_a_repair_is_found_if_the_cycle_ended(cycles: bool, repaired: bool) -> None:
    """A backlash that is no longer seen is repaired if the oscillation ended.

    If an external disturbance continues the oscillation and hides the backlash, a repair is not proven.
    """
    before, after = (night(True, True),) * 7, (night(False, cycles),) * 7
    assert Weeks(before, after, Pid(1.0, 60.0), Pid(1.0, 60.0)).fault_removed is repaired


@pytest.mark.parametrize(
    ("stated", "share"),
    [
        (LoopSpec("L", pv_lo=0.0, pv_hi=50.0, kp=2.0, ti=1.0, ti_unit="min", td=0.1, td_filter=10.0), 1.0),
        (
            LoopSpec("L", pv_lo=0.0, pv_hi=50.0, kp=2.0, ti=60.0, td=9.0, form=Form.SERIES, pv_filter_s=4.0),
            1.0,
        ),
        (LoopSpec("L", pv_lo=0.0, pv_hi=50.0, kp=2.0, ti=60.0, gap=1.0, error_form=ErrorForm.SQUARED), 1.0),
        (LoopSpec("L", pv_lo=0.0, pv_hi=50.0, kp=2.0, ti=60.0, gain_unit="engineering", op_hi=20.0), 1.0),
        (LoopSpec("L", pv_lo=0.0, pv_hi=50.0, kp=2.0, ti=60.0), 0.4),
    ],
)
def test_a_night_is_simulated_with_its_whole_controller(stated: LoopSpec, share: float) -> None:
    """A night is simulated with the derivative, filter, gap, range of OP and gain in force of loops.csv, not with a
    PI alone.
    """
    terms = controller_columns(stated) | ({} if share == 1.0 else {"gain_share": share})
    names = ("loop", "pv_lo", "pv_hi", "kp", "ti", "form", "gain_unit", "ti_unit")
    row = {name: getattr(stated, name) for name in names}
    row["controller"] = json.dumps(terms) if terms else None
    found = pid_of(row)
    assert found == controller(stated, 50.0, share)
    assert found is not None
    assert found.error_form is stated.error_form  # the simulation needs the enum member, not its text
