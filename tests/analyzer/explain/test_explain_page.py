"""The page and the text of an explanation show the content of the answer."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from analyzer.explain import page as pages
from analyzer.explain.drawings import close_part, drawn_trends, simulations
from analyzer.explain.explained import abstained
from analyzer.explain.text import answer_lines, lined_up
from analyzer.explain.words import change, interval_text, parameters
from reports.folder import write_markdown
from reports.html import render
from reports.markdown import render as as_markdown
from reports.pages import Page, Panels, Plot, Trend
from tests.analyzer.explain.explained import N, explanation

KINDS = ("backlash", "none", "quantization", "controller-settings", "unexplained")


def blocks(page: Page) -> list:
    """All blocks of a page."""
    return [b for s in page.sections for b in s.blocks]


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_answer_has_a_whole_page(kind: str) -> None:
    """For each verdict the page has its sentence, the recording, the place of the misfit and the fit."""
    e = explanation(kind)
    assert e.said.verdict == kind
    page = pages.explanation_page(e)
    titles = [s.title for s in page.sections]
    assert titles[:2] == ["What it is", "Recording and simulation"]
    assert {"Where the misfit is", "How well it fits"} <= set(titles)
    assert any(isinstance(b, Trend) for b in blocks(page))
    assert any(isinstance(b, Panels) for b in blocks(page))
    text = render(page, True)
    assert e.data["reason"].split(":")[0].replace("'", "&#39;") in text
    assert "<b>feed" not in text
    assert len(text) < 600_000


@pytest.mark.parametrize("kind", ["backlash", "quantization", "controller-settings"])
def test_findings_have_a_picture(kind: str) -> None:
    """Backlash, a coarse sensor and other settings each have a plot."""
    page = pages.explanation_page(explanation(kind))
    section = next(s for s in page.sections if s.title == "What was found")
    plot = next(b for b in section.blocks if isinstance(b, Plot))
    assert all(np.isfinite(line.y).all() for line in plot.lines)


def test_page_of_backlash_shows_both_models_and_the_user_model(tmp_path: Path) -> None:
    """Baseline, improved and user's model are in trend and table, and the improved model is nearest to the
    recording.
    """
    e = explanation("backlash")
    page = pages.explanation_page(e)
    whole = next(b for b in blocks(page) if isinstance(b, Trend))
    assert {"recorded", "baseline", "model", "brought"} <= {b.kind for b in whole.bands}
    size = {k: float(np.std(e.case.recording.pv - x)) for k, x in simulations(e).items()}
    assert size["model"] < size["baseline"] < size["brought"]
    fit = next(t for t in page.tables() if t.name == "fit")
    assert [row[0].text for row in fit.rows] == ["baseline model", "improved model", "your model"]
    assert "100 times off" in render(page, True)
    written = write_markdown([page], tmp_path)
    assert written[0].read_text().count("![") == len(list((tmp_path / f"{page.name}-pictures").iterdir()))


def test_marked_spans_and_close_look_lie_in_the_recording() -> None:
    """The marked spans of the misfit lie within the recording, and the close view is a part of it."""
    e = explanation("backlash")
    whole, closer = drawn_trends(e)
    first, last = whole.time_s[0], whole.time_s[0] + N
    assert whole.spans
    assert all(first <= a < b <= last for a, b in whole.spans)
    part = close_part(e)
    assert 0 <= part.start < part.stop <= N
    assert closer.time_s.size == part.stop - part.start


def test_where_has_the_features_of_backlash() -> None:
    """For backlash the answer contains features and the keys of the contract, and it is valid JSON."""
    where = explanation("backlash").data["where"]
    assert {"signals", "spans", "pv_range", "op_range", "direction", "band_s"} <= set(where)
    assert {f["name"] for f in where["features"]} >= {"pv_level", "op_level", "after_reversals"}
    assert json.loads(json.dumps(where)) == where


def test_none_shows_the_held_out_misfit() -> None:
    """If no effect was found, the baseline model still has its own held-out misfit, below 1 %."""
    fit = explanation("none").data["fit"]["baseline"]
    assert fit["held_out"]["rmse"] != fit["fitted"]["rmse"]
    assert fit["held_out"]["rmse"] < 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_text_is_narrow_and_without_raw_floats(kind: str) -> None:
    """The text has at most 112 columns and no number of more than six digits."""
    text = answer_lines(explanation(kind).data)
    assert max(len(line) for line in text) <= 112
    assert not any(len(word.strip(".,;()").replace(".", "")) > 6 for line in text for word in line.split()
                   if word.strip(".,;()").replace(".", "").isdigit())  # fmt: skip


def test_narrow_intervals_keep_their_width() -> None:
    """The two ends of an interval are shown with enough digits to differ; an exact value is shown as a dash."""
    assert interval_text({"low": 1.0691, "high": 1.0704}) == "1.069 … 1.07"
    assert interval_text({"low": 1.0, "high": 2.0}) == "1 … 2"
    assert interval_text({"low": 3.0, "high": 3.0}) == "–"


def test_a_number_hidden_for_one_effect_is_shown_for_another() -> None:
    """The flow at rest of a supply is shown, although another effect hides a number of that name."""
    numbers = {
        name: {"value": 8.0, "low": 6.0, "high": 10.0, "unit": "% OP"}
        for name in ("flow_at_rest_pct", "head_1")
    }
    supply = {"effects": [{"name": "supply-variation", "parameters": numbers}]}
    assert [row[1].text for row in parameters(supply).rows] == ["Flow at rest"]


@pytest.mark.parametrize(
    ("after", "expected"), [(1.001, "0 %"), (0.999, "0 %"), (1.5, "+50 %"), (0.5, "-50 %")]
)
def test_changes_have_a_sign_unless_none(after: float, expected: str) -> None:
    """A change is given in whole percent with its sign; zero has no sign."""
    assert change(1.0, after) == expected


def test_columns_are_aligned() -> None:
    """Numbers end at the same column in each row, and texts begin at the same column."""
    rows = lined_up([("a", "1.5", "short"), ("longer", "10", "words " * 40)], (1,))
    assert rows[0].index("short") == rows[1].index("words")
    assert rows[0].index("1.5") + 3 == rows[1].index("10") + 2
    assert all(len(r) <= 112 for r in rows)


def test_abstention_has_a_page() -> None:
    """If no explanation is possible, the page states what is missing, in HTML and in Markdown."""
    page = pages.abstention(abstained("A", "A: needs OP, has none"))
    assert "needs OP, has none" in render(page, True)
    assert "needs OP, has none" in as_markdown(page, "")
