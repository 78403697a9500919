"""Accessibility: axe-core finds nothing serious on any kind of page, in light mode, in dark mode and on a
phone."""

from __future__ import annotations

from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from tests.browser.test_explanations import explained
from tests.browser.test_pages import browser, folder, opened, pytestmark, wait
from tests.browser.test_settings_page import settings

__all__ = ["browser", "explained", "folder", "pytestmark", "settings"]
slow = partial(pytest.param, marks=pytest.mark.slow)
axe = pytest.importorskip("axe_core_python", reason="needs axe-core-python, of the test extra")
SCRIPT = (files("axe_core_python") / "axe.min.js").read_text(encoding="utf-8")
RUN = """const done = arguments[arguments.length - 1];
  axe.run(document, {resultTypes: ['violations']}).then((r) => done(r.violations
    .filter((v) => v.impact === 'serious' || v.impact === 'critical')
    .map((v) => v.id + ': ' + v.nodes.length + ' of ' + v.nodes[0].html.slice(0, 160))));"""


def kinds(folder: Path) -> list[Path]:
    """One page of each kind: morning, maintenance, side by side, work list, before and after, and one loop's
    page."""
    here = folder / "folder"
    loop = next(p for p in sorted(here.glob("FIC*.html")))
    names = ("index", "maintenance", "side-by-side", "work", "before-after")
    return [*(here / f"{name}.html" for name in names), loop]


@pytest.mark.parametrize(
    ("width", "scheme"), [(390, "light"), (1280, "dark"), slow(390, "dark"), slow(1280, "light")]
)
def test_nothing_serious(browser: Any, folder: Path, scheme: str, width: int) -> None:
    """No page has a serious or critical violation."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    try:
        for page in kinds(folder):
            opened(browser, page)
            wait(
                browser,
                "return Array.from(document.querySelectorAll('.trend')).every((t) => t.dataset.ready)",
            )
            browser.execute_cdp_cmd("Runtime.evaluate", {"expression": SCRIPT})
            assert browser.execute_async_script(RUN) == [], page.name
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_nothing_serious_in_an_explanation(browser: Any, explained: list[Path]) -> None:
    """The page of an explanation has no serious or critical violation."""
    opened(browser, explained[0])
    wait(browser, "return Array.from(document.querySelectorAll('.trend')).every((t) => t.dataset.ready)")
    browser.execute_cdp_cmd("Runtime.evaluate", {"expression": SCRIPT})
    assert browser.execute_async_script(RUN) == []


@pytest.mark.parametrize(
    ("width", "scheme"), [(390, "dark"), (1280, "light"), slow(390, "light"), slow(1280, "dark")]
)
def test_nothing_serious_on_the_settings_page(browser: Any, settings: Path, scheme: str, width: int) -> None:
    """The page with sliders has no serious or critical violation, on a phone, in light and in dark mode.
    Nothing is wider than the screen."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    )
    try:
        opened(browser, settings / "backlash.html")
        wait(browser, "return document.querySelector('.whatif').dataset.ready === 'yes'")
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        browser.execute_cdp_cmd("Runtime.evaluate", {"expression": SCRIPT})
        assert browser.execute_async_script(RUN) == []
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
