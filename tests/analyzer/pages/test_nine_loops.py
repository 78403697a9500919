"""Nine loops of known truth with each command: each loop is reported correctly, and no two commands differ."""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.explain.text import answer_lines
from analyzer.pages.morning import score
from analyzer.pages.night import pages_of_night
from analyzer.store.store import Store
from reports.markdown import render
from reports.pages import Page, TreeMap, Trend
from tests.analyzer.pages.nine_loops import (
    BACKLASH_ON_LEVEL,
    FROZEN,
    FROZEN_FROM,
    HOURS,
    LIMITED,
    LOOPS,
    MANUAL,
    MANUAL_FROM,
    NO_FAULT,
    SINE,
    SLUGGISH,
    START_US,
    TIGHT,
    WIDTHS,
    WORN,
    written,
)

CELLS = (
    *("status", "cause", "valve_fault", "backlash_pct", "stickband_pct", "source_loop"),
    *("action", "kp_new", "ti_new", "reason"),
)
EXPLAINED = tuple(LOOPS) if os.environ.get("TRIAGE_WALK") == "all" else (SINE, LIMITED, BACKLASH_ON_LEVEL)
"""Loops that are explained here: with TRIAGE_WALK=all, all of them."""
START_S = START_US / 1e6


def answered(*words: str, status: int = 0) -> str:
    """The output of a command on stdout."""
    result = CliRunner().invoke(main, words)
    assert result.exit_code == status, result.output
    return result.stdout


@dataclass(frozen=True)
class Results:
    """The results of each command for the night.

    These are the rows of `rank` by loop, the text of `summary`, the data of `tune` by loop, and the pages by title.
    """

    arguments: tuple[str, ...]
    rows: dict[str, dict[str, Any]]
    summary: str
    tuned: dict[str, dict[str, Any]]
    pages: dict[str, Page]

    def page(self, loop: str) -> str:
        """The page of a loop as text."""
        return render(self.pages[loop], "")

    def do(self, loop: str) -> str:
        """The action on the page of a loop."""
        return re.search(r"\*\*Do:\*\* (.*)", self.page(loop))[1]  # type: ignore[index]

    def trend(self, loop: str) -> Trend:
        """The trend on the page of a loop."""
        blocks = self.pages[loop].sections[0].blocks
        return next(b for b in blocks if isinstance(b, Trend))


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The plant, with its night assessed once, and the results of the commands."""
    folder = tmp_path_factory.mktemp("nine")
    export, loops = written(folder)
    store, arguments = str(folder / "store"), (str(export), "--loops", str(loops))
    answered("run", *arguments, "--store", store, "--jobs", "1")
    rows = {r["loop"]: r for r in json.loads(answered("rank", store, "--format", "json"))}
    assessed = [loop for loop in LOOPS if rows[loop]["status"] == "ok"]
    tuned = {
        loop: json.loads(answered("tune", *arguments, "--loop", loop, "--store", store, "--format", "json"))
        for loop in assessed
    }
    pages = {page.title: page for page in pages_of_night(Store(Path(store)))}
    return Results((*arguments, "--store", store), rows, answered("summary", store), tuned, pages)


def same(row: dict[str, Any]) -> dict[str, Any]:
    """The cells in which commands must agree, with numbers to six digits."""
    return {k: float(f"{row[k]:.6g}") if isinstance(row[k], float) else row[k] for k in CELLS}


def flat(text: str) -> str:
    """A text on one line."""
    return " ".join(text.split())


def test_list_and_tune_agree_cell_by_cell(results: Results) -> None:
    """Cause, fault, widths, action, settings and reason of `tune` equal those of `rank` for each assessed loop."""
    assert len(results.tuned) == len(LOOPS) - 1
    for loop, answer in results.tuned.items():
        assert same(answer["decision"]) == same(results.rows[loop])


def test_the_action_is_one_sentence_everywhere(results: Results) -> None:
    """The page, `tune` and, except for settings, the summary state the action in the same words."""
    for loop, answer in results.tuned.items():
        row = results.rows[loop]
        if row["action"] == "none":
            assert answer["decision"]["do"] == ""
            continue
        assert results.do(loop) == answer["decision"]["do"]
        if row["action"] != "retune":
            assert answer["decision"]["do"] in flat(results.summary)


def test_no_known_cause_has_an_undecided_action(results: Results) -> None:
    """An action 'undecided' has no known cause, and an action 'needs data' names the data."""
    for row in results.rows.values():
        assert row["action"] != "undecided" or row["cause"] in ("undecided", None)
        if row["action"] == "needs data":
            assert results.do(row["loop"]) != "provide the missing data"


def test_a_frozen_transmitter_is_frozen_everywhere(results: Results) -> None:
    """Each command gives a check of the transmitter, and no model is based on its PV.

    The constant span is drawn and shaded, and the score of the area counts it.
    """
    row, shown = results.rows[FROZEN], results.trend(FROZEN)
    assert (row["action"], row["cause"]) == ("check measurement", "none")
    assert "frozen" in row["reason"]
    assert "look at the transmitter" in results.do(FROZEN)
    text = "\n".join(results.tuned[FROZEN]["text"])
    assert "No fault found" not in text
    assert results.tuned[FROZEN]["estimates"] == {}
    ((first, last),) = shown.spans
    assert first == pytest.approx(START_S + FROZEN_FROM * HOURS * 3600, abs=120)
    assert last == pytest.approx(START_S + HOURS * 3600, abs=120)
    assert not shown.gap[shown.time_s >= first].any()
    assert score([{**row, "importance": 1.0}]) == 0.0


def test_the_sluggish_loop_with_the_largest_loss_comes_first(results: Results) -> None:
    """The loop with the largest loss is in the first row, in the first sentence and a rectangle with an action.

    It is sluggish, and its next step is a step test or new settings.
    """
    row = results.rows[SLUGGISH]
    assert (
        max(results.rows, key=lambda k: results.rows[k]["loss"] or 0.0)
        == SLUGGISH
        == next(iter(results.rows))
    )
    assert row["action"] in ("retune", "needs data")
    assert "sluggish" in row["reason"]
    assert SLUGGISH in results.summary.split("- ")[1]
    assert "No fault found" not in "\n".join(results.tuned[SLUGGISH]["text"])
    assert re.search("test-plan|type in", results.do(SLUGGISH))
    index = next(p for p in results.pages.values() if p.name == "index")
    tiles = next(b for s in index.sections for b in s.blocks if isinstance(b, TreeMap)).groups
    largest = max((t for _, group in tiles for t in group), key=lambda t: t.size)
    assert (largest.name, largest.kind) == (SLUGGISH, "unclear")


def test_a_loop_too_tight_gets_settings_or_the_missing_data(results: Results) -> None:
    """The cause is the tuning.

    Without settings the action is to halve the gain and make a step test, and never to provide more hours or set
    point moves.
    """
    row = results.rows[TIGHT]
    assert row["cause"] == "tuning"
    assert row["action"] in ("retune", "needs data")
    if row["action"] == "needs data":
        assert "halve the controller's gain" in results.do(TIGHT)
        assert "step test" in results.do(TIGHT)
    assert "longer record" not in row["reason"] + results.page(TIGHT)


def test_a_sine_load_is_searched_for_upstream(results: Results) -> None:
    """The cycle is external with the true period, and the process is not identified from it.

    An earlier version reported a dead time of 104 s instead of 8 s.
    """
    row = results.rows[SINE]
    assert (row["cause"], row["action"]) == ("load", "find disturbance")
    assert row["period_s"] == pytest.approx(840.0, rel=0.02)
    assert results.do(SINE).startswith("look upstream for a cycle of 14 min")
    assert results.tuned[SINE]["estimates"] == {}
    assert not re.search(r"the loop amplifies a load at the period \d\d", results.page(SINE))


def test_backlash_on_a_level_is_reported_consistently(results: Results) -> None:
    """The width is the true one, settings or a repair are advised and not both, and no change has four digits of
    percent.
    """
    row, text = results.rows[BACKLASH_ON_LEVEL], "\n".join(results.tuned[BACKLASH_ON_LEVEL]["text"])
    assert (row["cause"], row["valve_fault"]) == ("valve", "backlash")
    assert row["backlash_pct"] == pytest.approx(WIDTHS[BACKLASH_ON_LEVEL], rel=0.1)
    assert row["action"] == "retune"
    assert "no pair" not in text
    assert not re.search(r"[+−-]\d{4,} %", text + results.page(BACKLASH_ON_LEVEL))
    assert "next shutdown" not in results.page(BACKLASH_ON_LEVEL)


def test_op_at_its_limit_is_an_action(results: Results) -> None:
    """Each command gives a search for the reason why OP is at its limit, and 'undecided' is not shown."""
    row = results.rows[LIMITED]
    assert (row["cause"], row["action"]) == ("none", "check limit")
    assert f"Find out why OP of {LIMITED} is at its limit" in flat(results.summary)
    assert "OP is at its limit" in results.do(LIMITED)
    assert "undecided" not in results.page(LIMITED) + "\n".join(results.tuned[LIMITED]["text"])


def test_a_loop_without_fault_gets_no_action(results: Results) -> None:
    """No action is advised, and the probability of a worn valve is called a probability."""
    row, page = results.rows[NO_FAULT], results.page(NO_FAULT)
    assert (row["cause"], row["valve_fault"], row["action"]) == ("none", "none", "none")
    assert NO_FAULT not in results.summary
    assert "Worn valve" not in page
    assert "Probability of a worn valve" in page


def test_one_width_on_a_page(results: Results) -> None:
    """Backlash is named in reason and advice, and its widths on one page are within 3 % of each other and 10 % of the
    truth.
    """
    row, page = results.rows[WORN], results.page(WORN)
    assert (row["cause"], row["valve_fault"]) == ("valve", "backlash")
    assert "stick-slip" not in "\n".join(results.tuned[WORN]["text"]) + page
    matches = re.findall(r"(?:backlash of|backlash|all nights: ?)\D{0,3}([\d.]+) %", page)
    widths = [float(x) for x in matches]
    assert len(widths) >= 2
    assert max(widths) <= 1.03 * min(widths)
    assert widths[0] == pytest.approx(WIDTHS[WORN], rel=0.1)


def test_a_loop_in_manual_is_reported_with_its_trend(results: Results) -> None:
    """The action is to put the loop back in automatic; its span in manual is shaded, and the start is given."""
    row, shown = results.rows[MANUAL], results.trend(MANUAL)
    assert (row["status"], row["action"]) == ("not assessed", "needs data")
    assert "put it back in automatic" in results.do(MANUAL)
    ((first, _),) = shown.spans
    assert first == pytest.approx(START_S + MANUAL_FROM * HOURS * 3600, abs=120)
    assert "In manual since" in results.page(MANUAL)
    assert "2026-03-02 02:30" in results.page(MANUAL)


@pytest.mark.slow
@pytest.mark.parametrize("loop", EXPLAINED)
def test_an_explanation_adds_to_the_night(loop: str, results: Results) -> None:
    """`explain` begins with the cells of the night, and a model that is no better on held-out data is not claimed.

    A loop that the night cannot assess is not explained.
    """
    row = results.rows[loop]
    unfit = loop == LIMITED
    status = 2 if unfit else 0
    answer = json.loads(
        answered("explain", *results.arguments, "--loop", loop, "--format", "json", status=status)
    )
    assert same(answer["night"]) == same(row)
    if unfit:
        assert "within its limits" in answer["reason"]
        return
    text = "\n".join(answer_lines(answer))
    assert text.startswith(f"The night of 2026-03-02 found: cause {row['cause'] or 'not reported'}")
    fit, banded = answer["fit"], answer["fit"].get("in_band")
    held = [(banded[k] if banded else fit[k]["held_out"])["rmse"] for k in ("baseline", "explained")]
    if answer["moved"] and held[1] >= held[0]:
        assert "no improvement of the model is claimed" in flat(text)
        assert "improved model" not in text
        assert "Changed constants" not in text
    if row["cause"] != "valve":
        assert answer["block"] != "valve"
