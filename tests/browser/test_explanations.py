"""The page of an explanation works in a real browser: from disk, at every width, with all plots, and in print."""

from __future__ import annotations

import base64
import re
from pathlib import Path
from typing import Any

import pytest

from analyzer.explain import page as pages
from reports.folder import write_html
from tests.analyzer.explain.explained import explanation
from tests.browser.test_pages import browser, opened, pytestmark, wait

__all__ = ["browser", "pytestmark"]
KINDS = ("backlash", "none", "quantization", "controller-settings", "unexplained")


@pytest.fixture(scope="module")
def explained(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A page in one file for each kind of verdict."""
    out = tmp_path_factory.mktemp("explained")
    return [write_html([pages.explanation_page(explanation(k))], out / k, True)[0] for k in KINDS]


def test_explanations_load_without_errors(browser: Any, explained: list[Path]) -> None:
    """No page has an error in the console or requests a resource, and all its trends and panels are drawn."""
    for path in explained:
        opened(browser, path)
        wait(browser, "return Array.from(document.querySelectorAll('.trend')).every((t) => t.dataset.ready)")
        assert [e for e in browser.get_log("browser") if e["level"] == "SEVERE"] == [], path
        assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0
        empty = "return Array.from(document.querySelectorAll('.panel')).filter((p) => !p.firstChild).length"
        assert browser.execute_script(empty) == 0
        assert (
            browser.execute_script("return document.querySelectorAll('.panels svg.plot .line').length") >= 4
        )


@pytest.mark.parametrize("width", [390, 768, 1920])
def test_explanations_fit_each_width(browser: Any, explained: list[Path], width: int) -> None:
    """No page is wider than a phone, a tablet or a wide screen."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    for path in explained:
        opened(browser, path)
        over = "return document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert browser.execute_script(over) <= 0, path
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_spans_are_shaded(browser: Any, explained: list[Path]) -> None:
    """The background of a trend has another colour inside a marked span than outside."""
    opened(browser, explained[0])
    wait(browser, "return Array.from(document.querySelectorAll('.trend')).every((t) => t.dataset.ready)")
    colours = browser.execute_script(
        """const c = document.querySelector('#recording canvas'), seen = new Set();
        const row = c.getContext('2d').getImageData(0, Math.round(c.height * 0.12), c.width, 1).data;
        for (let i = 0; i < row.length; i += 4) seen.add(row.slice(i, i + 4).join());
        return Array.from(seen);"""
    )
    shaded = [c for c in colours if c.split(",")[3] not in ("0", "255")]
    assert shaded


def test_explanation_prints(browser: Any, explained: list[Path]) -> None:
    """A printed explanation has 2 to 8 sheets, its closed parts included."""
    opened(browser, explained[0])
    pdf = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    sheets = len(re.findall(rb"/Type ?/Page[^s]", pdf))
    assert 2 <= sheets <= 8
