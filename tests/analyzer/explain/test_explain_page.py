"""The page and the text of an explanation say and show what the answer holds."""

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
    """Whatever the verdict, the page has its sentence, the recording, where the misfit lives and the fit."""
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
    """Play, a coarse sensor and other settings are each drawn."""
    page = pages.explanation_page(explanation(kind))
    section = next(s for s in page.sections if s.title == "What was found")
    plot = next(b for b in section.blocks if isinstance(b, Plot))
    assert all(np.isfinite(line.y).all() for line in plot.lines)


def test_page_of_play_shows_both_models_and_the_users(tmp_path: Path) -> None:
    """Plain, improved and brought simulation stand in trend and table, the improved one nearest to the recording."""
    e = explanation("backlash")
    page = pages.explanation_page(e)
    whole = next(b for b in blocks(page) if isinstance(b, Trend))
    assert {"recorded", "baseline", "model", "brought"} <= {b.kind for b in whole.bands}
    size = {k: float(np.std(e.case.subject.pv - x)) for k, x in simulations(e).items()}
    assert size["model"] < size["baseline"] < size["brought"]
    fit = next(t for t in page.tables() if t.name == "fit")
    assert [row[0].text for row in fit.rows] == ["baseline model", "improved model", "your model"]
    assert "100 times off" in render(page, True)
    written = write_markdown([page], tmp_path)
    assert written[0].read_text().count("![") == len(list((tmp_path / f"{page.name}-pictures").iterdir()))


def test_marked_spans_and_close_look_lie_in_the_recording() -> None:
    """Spans that carry the misfit lie within the recording, and the close look is a part of it."""
    e = explanation("backlash")
    whole, closer = drawn_trends(e)
    first, last = whole.time_s[0], whole.time_s[0] + N
    assert whole.spans
    assert all(first <= a < b <= last for a, b in whole.spans)
    part = close_part(e)
    assert 0 <= part.start < part.stop <= N
    assert closer.time_s.size == part.stop - part.start


def test_where_tells_what_carries_play() -> None:
    """Of play the answer tells features with their chances, and the keys of the contract are there."""
    where = explanation("backlash").data["where"]
    assert {"signals", "spans", "pv_range", "op_range", "direction", "band_s"} <= set(where)
    assert {f["name"] for f in where["features"]} >= {"pv_level", "op_level", "after_reversals"}
    assert json.loads(json.dumps(where)) == where


def test_none_shows_what_was_held_out() -> None:
    """Where nothing was found the plain loop still has a held-out misfit of its own, under 1 %."""
    fit = explanation("none").data["fit"]["baseline"]
    assert fit["held_out"]["rmse"] != fit["fitted"]["rmse"]
    assert fit["held_out"]["rmse"] < 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_text_is_narrow_and_without_raw_floats(kind: str) -> None:
    """Text keeps within 112 columns and shows no number of more than six digits."""
    text = answer_lines(explanation(kind).data)
    assert max(len(line) for line in text) <= 112
    assert not any(len(word.strip(".,;()").replace(".", "")) > 6 for line in text for word in line.split()
                   if word.strip(".,;()").replace(".", "").isdigit())  # fmt: skip


def test_narrow_intervals_keep_their_width() -> None:
    """Ends that agree in three digits are shown with as many as tell them apart, an exact value with a dash."""
    assert interval_text({"low": 1.0691, "high": 1.0704}) == "1.069 … 1.07"
    assert interval_text({"low": 1.0, "high": 2.0}) == "1 … 2"
    assert interval_text({"low": 3.0, "high": 3.0}) == "–"


def test_a_number_that_one_effect_hides_is_shown_of_another() -> None:
    """A supply's flow at rest is told as a number of its own, although physics of no name has one that is not."""
    numbers = {
        name: {"value": 8.0, "low": 6.0, "high": 10.0, "unit": "% OP"}
        for name in ("flow_at_rest_pct", "head_1")
    }
    supply = {"effects": [{"name": "supply-variation", "parameters": numbers}]}
    assert [row[1].text for row in parameters(supply).rows] == ["Flow at rest"]


@pytest.mark.parametrize(("after", "said"), [(1.001, "0 %"), (0.999, "0 %"), (1.5, "+50 %"), (0.5, "-50 %")])
def test_changes_have_a_sign_unless_none(after: float, said: str) -> None:
    """A change is in whole percent with its sign; nothing has none."""
    assert change(1.0, after) == said


def test_columns_line_up() -> None:
    """Numbers end, and texts begin, at the same place in each row."""
    rows = lined_up([("a", "1.5", "short"), ("longer", "10", "words " * 40)], (1,))
    assert rows[0].index("short") == rows[1].index("words")
    assert rows[0].index("1.5") + 3 == rows[1].index("10") + 2
    assert all(len(r) <= 112 for r in rows)


def test_abstention_has_a_page() -> None:
    """Where nothing can be said the page says what is missing, in HTML and in Markdown."""
    page = pages.abstention(abstained("A", "A: needs OP, has none"))
    assert "needs OP, has none" in render(page, True)
    assert "needs OP, has none" in as_markdown(page, "")
