"""The results of the sample mill's two weeks agree with those of the study, from the store only, without the
truth.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from analyzer.comparison.before_after import grade
from analyzer.comparison.measures import ChangeVerdict
from analyzer.config import Config
from analyzer.history.export import ReadOptions, open_export
from analyzer.loops.changes import read_changes
from analyzer.loops.tags import match, read_loops
from analyzer.pages import before_after
from analyzer.pages.change_cases import ChangeCase, change_cases, detected
from analyzer.store.store import Store
from reports.markdown import render

pytestmark = pytest.mark.slow

MILL = Path(__file__).parents[3] / "sample_data"
RETUNED = ("LIC2101", "LIC2102", "LIC2103", "TIC2104", "LIC2105", "TIC2106", "LIC2107")
OTHERS = ("FIC2110", "FIC2113", "PIC2116")


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """The fourteen nights of the mill, for the retuned loops and some others."""
    from analyzer.night import batch
    from analyzer.night.nights import Plant

    export = open_export([MILL / "mill.parquet"], ReadOptions())
    specs, _ = match(read_loops(MILL / "loops.csv"), export.tags)
    kept = Store(tmp_path_factory.mktemp("mill"))
    wanted = [s for s in specs if s.loop in (*RETUNED, *OTHERS)]
    batch.run(Plant(export, wanted, Config()), kept)
    return kept


@pytest.fixture(scope="module")
def found(store: Store) -> dict[str, ChangeCase]:
    """The result of each change."""
    known, missing = change_cases(store, read_changes(MILL / "changes.csv"))
    assert missing == []
    return {c.found.loop: c for c in known}


def test_five_loops_improve_clearly(found: dict[str, ChangeCase]) -> None:
    """Five of the seven retuned loops improve clearly in all four figures, as in the study."""
    clear = [loop for loop, c in found.items() if grade(c.found) == "clear"]
    assert clear == ["LIC2102", "TIC2104", "LIC2105", "TIC2106", "LIC2107"]


def test_loop_1_improves_modestly(found: dict[str, ChangeCase]) -> None:
    """Loop 1 improves modestly, as in the study."""
    assert grade(found["LIC2101"].found) == "modest"


def test_loop_3_improves_only_in_travel(found: dict[str, ChangeCase]) -> None:
    """Loop 3 improves only in valve travel, and its neighbour is named as the cause, as in the study."""
    case = found["LIC2103"].found
    better = [c.measure.name for c in case.primary if c.verdict is ChangeVerdict.BETTER]
    assert better == ["valve_travel_pct_per_h"]
    assert case.source_loop == "FIC2110"
    assert "FIC2110" in before_after.outcome(case)


def test_untouched_loops_do_not_change(store: Store) -> None:
    """Loops without a change are called neither better nor worse at the same moment."""
    moment = read_changes(MILL / "changes.csv")[0]
    known, _ = change_cases(store, [replace(moment, loop=loop) for loop in OTHERS])
    calls = {c.found.loop: {x.verdict for x in c.found.primary} for c in known}
    assert len(calls) == len(OTHERS)
    assert all(v <= {ChangeVerdict.UNCLEAR, ChangeVerdict.INCOMPARABLE} for v in calls.values())


def test_changes_are_found_for_retuned_loops(store: Store) -> None:
    """Changes of behaviour are found for retuned loops only, within six hours of the truth, and for at least five of
    them.
    """
    truth = {c.loop: c.time_s for c in read_changes(MILL / "changes.csv")}
    offered = {c.loop: c.time_s for c in detected(store, None, Config())}
    assert set(offered) <= set(truth)
    assert len(offered) >= 5
    assert all(abs(t - truth[loop]) < 6 * 3600 for loop, t in offered.items())


def kept_part(text: str) -> str:
    """The part that a change of the analysis should not alter: outcomes and verdicts, without their digits."""
    short, _, rest = text.partition("## In pictures")
    table = rest.partition("## Figures before and after")[2].partition("## ")[0]
    loops = [line.split(" | ") for line in short.splitlines() if line.startswith("| ")]
    rows = [line.split(" | ") for line in table.splitlines() if line.startswith("| ")]
    head = short.partition("\n| ")[0]
    kept = [(r[0], r[-1]) for r in loops] + [(*r[:2], *r[-2:]) for r in rows]
    return head + "\n" + "\n".join(map(" | ".join, kept)) + "\n"


def test_markdown_equals_the_stored_text(found: dict[str, ChangeCase]) -> None:
    """The report's summary and verdicts in Markdown equal those stored with this test."""
    text = render(
        before_after.changes_page(list(found.values()), [], "7 days before against after the change.")
    )
    assert kept_part(text) == (Path(__file__).parent / "test_pages_mill.md").read_text("utf-8")
