"""Nine loops of known truth through every command: each is told as it is, and no two commands tell it differently."""

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
    FROZEN,
    FROZEN_FROM,
    HEALTHY,
    HOURS,
    LIMITED,
    LOOPS,
    MANUAL,
    MANUAL_FROM,
    PLAY,
    PLAY_ON_LEVEL,
    SINE,
    SLUGGISH,
    START_US,
    TIGHT,
    WORN,
    written,
)

CELLS = (
    *("status", "cause", "valve_fault", "backlash_pct", "stickband_pct", "source_loop"),
    *("action", "kp_new", "ti_new", "reason"),
)
EXPLAINED = tuple(LOOPS) if os.environ.get("TRIAGE_WALK") == "all" else (SINE, LIMITED, PLAY_ON_LEVEL)
"""Loops that are explained here: TRIAGE_WALK=all explains all of them."""
START_S = START_US / 1e6


def answered(*words: str, status: int = 0) -> str:
    """What a command prints on stdout."""
    result = CliRunner().invoke(main, words)
    assert result.exit_code == status, result.output
    return result.stdout


@dataclass(frozen=True)
class Walked:
    """What each command tells of the night: rows of `rank` by loop, the text of `summary`, `tune` as data by loop,
    and the pages by title."""

    asked: tuple[str, ...]
    rows: dict[str, dict[str, Any]]
    summary: str
    tuned: dict[str, dict[str, Any]]
    pages: dict[str, Page]

    def page(self, loop: str) -> str:
        """A loop's page as text."""
        return render(self.pages[loop], "")

    def do(self, loop: str) -> str:
        """What a loop's page says to do."""
        return re.search(r"\*\*Do:\*\* (.*)", self.page(loop))[1]  # type: ignore[index]

    def trend(self, loop: str) -> Trend:
        """The trend on a loop's page."""
        blocks = self.pages[loop].sections[0].blocks
        return next(b for b in blocks if isinstance(b, Trend))


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Walked:
    """The plant, its night assessed once, and what is told of it."""
    folder = tmp_path_factory.mktemp("nine")
    export, loops = written(folder)
    store, asked = str(folder / "store"), (str(export), "--loops", str(loops))
    answered("run", *asked, "--store", store, "--jobs", "1")
    rows = {r["loop"]: r for r in json.loads(answered("rank", store, "--format", "json"))}
    assessed = [loop for loop in LOOPS if rows[loop]["status"] == "ok"]
    tuned = {
        loop: json.loads(answered("tune", *asked, "--loop", loop, "--store", store, "--format", "json"))
        for loop in assessed
    }
    pages = {page.title: page for page in pages_of_night(Store(Path(store)))}
    return Walked((*asked, "--store", store), rows, answered("summary", store), tuned, pages)


def same(row: dict[str, Any]) -> dict[str, Any]:
    """The cells in which commands must agree, numbers to six digits."""
    return {k: float(f"{row[k]:.6g}") if isinstance(row[k], float) else row[k] for k in CELLS}


def flat(text: str) -> str:
    """A text on one line."""
    return " ".join(text.split())


def test_list_and_tune_agree_cell_by_cell(walked: Walked) -> None:
    """Cause, fault, widths, action, settings and reason of `tune` are those of `rank`, of every loop assessed."""
    assert len(walked.tuned) == len(LOOPS) - 1
    for loop, told in walked.tuned.items():
        assert same(told["decision"]) == same(walked.rows[loop])


def test_what_to_do_is_one_sentence_everywhere(walked: Walked) -> None:
    """The page, `tune` and, but for settings, the summary say what to do in the same words."""
    for loop, told in walked.tuned.items():
        row = walked.rows[loop]
        if row["action"] == "none":
            assert told["decision"]["do"] == ""
            continue
        assert walked.do(loop) == told["decision"]["do"]
        if row["action"] != "retune":
            assert told["decision"]["do"] in flat(walked.summary)


def test_no_known_cause_stands_beside_undecided(walked: Walked) -> None:
    """An action 'undecided' has no cause, and what needs data says which."""
    for row in walked.rows.values():
        assert row["action"] != "undecided" or row["cause"] in ("undecided", None)
        if row["action"] == "needs data":
            assert walked.do(row["loop"]) != "provide the missing data"


def test_a_frozen_transmitter_is_frozen_everywhere(walked: Walked) -> None:
    """The transmitter is to be looked at in every command, no model rests on its PV, its span is drawn and shaded,
    and the area's score counts it."""
    row, shown = walked.rows[FROZEN], walked.trend(FROZEN)
    assert (row["action"], row["cause"]) == ("check measurement", "none")
    assert "frozen" in row["reason"]
    assert "look at the transmitter" in walked.do(FROZEN)
    text = "\n".join(walked.tuned[FROZEN]["text"])
    assert "No fault found" not in text
    assert walked.tuned[FROZEN]["estimates"] == {}
    ((first, last),) = shown.spans
    assert first == pytest.approx(START_S + FROZEN_FROM * HOURS * 3600, abs=120)
    assert last == pytest.approx(START_S + HOURS * 3600, abs=120)
    assert not shown.gap[shown.time_s >= first].any()
    assert score([{**row, "importance": 1.0}]) == 0.0


def test_the_sluggish_loop_that_costs_most_comes_first(walked: Walked) -> None:
    """The largest loss of the plant is the first row, the first sentence and a rectangle of something to do; it is
    sluggish, and its next step is a step test or new settings."""
    row = walked.rows[SLUGGISH]
    assert (
        max(walked.rows, key=lambda k: walked.rows[k]["loss"] or 0.0) == SLUGGISH == next(iter(walked.rows))
    )
    assert row["action"] in ("retune", "needs data")
    assert "sluggish" in row["reason"]
    assert SLUGGISH in walked.summary.split("- ")[1]
    assert "No fault found" not in "\n".join(walked.tuned[SLUGGISH]["text"])
    assert re.search("test-plan|type in", walked.do(SLUGGISH))
    index = next(p for p in walked.pages.values() if p.name == "index")
    tiles = next(b for s in index.sections for b in s.blocks if isinstance(b, TreeMap)).groups
    largest = max((t for _, group in tiles for t in group), key=lambda t: t.size)
    assert (largest.name, largest.kind) == (SLUGGISH, "unclear")


def test_a_loop_too_tight_gets_settings_or_the_data_that_it_lacks(walked: Walked) -> None:
    """Its cause is its tuning; without settings it is told to halve the gain and to make a step test, and never to
    give hours or moves of the set point."""
    row = walked.rows[TIGHT]
    assert row["cause"] == "tuning"
    assert row["action"] in ("retune", "needs data")
    if row["action"] == "needs data":
        assert "halve the controller's gain" in walked.do(TIGHT)
        assert "step test" in walked.do(TIGHT)
    assert "longer record" not in row["reason"] + walked.page(TIGHT)


def test_a_sine_load_is_looked_for_upstream(walked: Walked) -> None:
    """The cycle is from outside, of the true period, and the process is not identified from it: its dead time of 8 s
    was told as 104 s."""
    row = walked.rows[SINE]
    assert (row["cause"], row["action"]) == ("load", "find disturbance")
    assert row["period_s"] == pytest.approx(840.0, rel=0.02)
    assert walked.do(SINE).startswith("look upstream for a cycle of 14 min")
    assert walked.tuned[SINE]["estimates"] == {}
    assert not re.search(r"the loop amplifies a load at the period \d\d", walked.page(SINE))


def test_play_on_a_level_is_one_story(walked: Walked) -> None:
    """The width is the true one, settings are told or a repair and not both, and no change is told in thousands of
    percent."""
    row, text = walked.rows[PLAY_ON_LEVEL], "\n".join(walked.tuned[PLAY_ON_LEVEL]["text"])
    assert (row["cause"], row["valve_fault"]) == ("valve", "backlash")
    assert row["backlash_pct"] == pytest.approx(PLAY[PLAY_ON_LEVEL], rel=0.1)
    assert row["action"] == "retune"
    assert "no pair" not in text
    assert not re.search(r"[+−-]\d{4,} %", text + walked.page(PLAY_ON_LEVEL))
    assert "next shutdown" not in walked.page(PLAY_ON_LEVEL)


def test_op_at_its_limit_is_an_action(walked: Walked) -> None:
    """What holds OP is to be looked for, in every command, and 'undecided' stands nowhere."""
    row = walked.rows[LIMITED]
    assert (row["cause"], row["action"]) == ("none", "check limit")
    assert f"Find out why OP of {LIMITED} is at its limit" in flat(walked.summary)
    assert "OP is at its limit" in walked.do(LIMITED)
    assert "undecided" not in walked.page(LIMITED) + "\n".join(walked.tuned[LIMITED]["text"])


def test_a_healthy_loop_is_left_alone(walked: Walked) -> None:
    """Nothing is to be done, and a chance is called one."""
    row, page = walked.rows[HEALTHY], walked.page(HEALTHY)
    assert (row["cause"], row["valve_fault"], row["action"]) == ("none", "none", "none")
    assert HEALTHY not in walked.summary
    assert "Worn valve" not in page
    assert "Probability of a worn valve" in page


def test_one_width_on_a_page(walked: Walked) -> None:
    """Play is called play in reason and advice, and its widths on one page lie within 3 % of each other and 10 % of
    the truth."""
    row, page = walked.rows[WORN], walked.page(WORN)
    assert (row["cause"], row["valve_fault"]) == ("valve", "backlash")
    assert "stick-slip" not in "\n".join(walked.tuned[WORN]["text"]) + page
    told = re.findall(r"(?:backlash of|backlash|all nights: ?)\D{0,3}([\d.]+) %", page)
    widths = [float(x) for x in told]
    assert len(widths) >= 2
    assert max(widths) <= 1.03 * min(widths)
    assert widths[0] == pytest.approx(PLAY[WORN], rel=0.1)


def test_a_loop_in_manual_is_told_so_with_its_trend(walked: Walked) -> None:
    """It is to be put back in automatic, its span in manual is shaded, and it is told since when."""
    row, shown = walked.rows[MANUAL], walked.trend(MANUAL)
    assert (row["status"], row["action"]) == ("not assessed", "needs data")
    assert "put it back in automatic" in walked.do(MANUAL)
    ((first, _),) = shown.spans
    assert first == pytest.approx(START_S + MANUAL_FROM * HOURS * 3600, abs=120)
    assert "In manual since" in walked.page(MANUAL)
    assert "2026-03-02 02:30" in walked.page(MANUAL)


@pytest.mark.slow
@pytest.mark.parametrize("loop", EXPLAINED)
def test_an_explanation_adds_to_the_night(loop: str, walked: Walked) -> None:
    """`explain` begins with the night's cells; a model that is no better on held-out data claims nothing, and what
    the night cannot judge is not explained."""
    row = walked.rows[loop]
    unfit = loop == LIMITED
    status = 2 if unfit else 0
    told = json.loads(answered("explain", *walked.asked, "--loop", loop, "--format", "json", status=status))
    assert same(told["night"]) == same(row)
    if unfit:
        assert "within its limits" in told["reason"]
        return
    text = "\n".join(answer_lines(told))
    assert text.startswith(f"The night of 2026-03-02 found: cause {row['cause'] or 'not reported'}")
    fit, banded = told["fit"], told["fit"].get("in_band")
    held = [(banded[k] if banded else fit[k]["held_out"])["rmse"] for k in ("baseline", "explained")]
    if told["moved"] and held[1] >= held[0]:
        assert "no improvement of the model is claimed" in flat(text)
        assert "improved model" not in text
        assert "Changed constants" not in text
    if row["cause"] != "valve":
        assert told["block"] != "valve"
