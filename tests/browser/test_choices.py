"""Readers choose loops side by side, rows by area and action, and another night. Followers stay below their
source."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

from tests.browser.test_pages import browser, column, folder, head, opened, pytestmark, wait

__all__ = ["browser", "folder", "pytestmark"]


def test_loops_chosen_in_the_table_are_shown_on_one_time_axis(browser: Any, folder: Path) -> None:
    """Two boxes and a button lead to both trends. A zoom of one trend zooms the other, and a seventh loop
    cannot be chosen."""
    opened(browser, folder / "folder" / "index.html")
    for box in browser.find_elements(By.CSS_SELECTOR, "#worst tbody input[type=checkbox]")[:2]:
        box.click()
    button = browser.find_element(By.CSS_SELECTOR, ".tools[data-for=worst] button")
    assert button.text == "Show 2 side by side"
    button.click()
    wait(
        browser,
        "return !!document.querySelector('.beside') && !!document.querySelector('.beside').dataset.ready",
    )
    figures = browser.find_elements(By.CSS_SELECTOR, ".together figure.trend")
    assert len(figures) == 2
    figures[0].find_element(By.CSS_SELECTOR, "button[aria-label='Zoom in']").click()
    ends = [(f.get_attribute("data-from"), f.get_attribute("data-to")) for f in figures]
    assert ends[0] == ends[1]
    boxes = browser.find_elements(By.CSS_SELECTOR, ".choice input[type=checkbox]")
    for box in boxes:
        if box.is_enabled() and not box.is_selected():
            box.click()
    assert sum(b.is_selected() for b in boxes) == 6
    assert not any(b.is_enabled() for b in boxes if not b.is_selected())
    browser.refresh()
    wait(browser, "return !!document.querySelector('.beside').dataset.ready")
    assert len(browser.find_elements(By.CSS_SELECTOR, ".together figure.trend")) == 6


def test_rows_are_filtered_by_area_and_action_together(browser: Any, folder: Path) -> None:
    """Only rows with both the chosen area and the chosen action remain."""
    opened(browser, folder / "folder" / "index.html")
    for key, value in (("area", "Area 1"), ("action", "retune")):
        Select(
            browser.find_element(By.CSS_SELECTOR, f".tools[data-for=ranking] select[data-facet={key}]")
        ).select_by_visible_text(value)
    assert set(column(browser, "ranking", "area")) == {"Area 1"}
    assert set(column(browser, "ranking", "action")) == {"retune"}


def test_another_night_is_picked(browser: Any, folder: Path) -> None:
    """The list has all nights, and the page of the chosen night opens."""
    opened(browser, folder / "folder" / "index.html")
    picker = Select(browser.find_element(By.CSS_SELECTOR, "select.nights"))
    names = [o.text for o in picker.options]
    assert names == sorted(names, reverse=True)
    assert len(names) > 1
    assert picker.first_selected_option.text == names[0]
    assert picker.options[1].get_attribute("value").startswith("morning-")


def test_followers_stay_under_their_source_when_sorted(browser: Any, folder: Path) -> None:
    """A row that follows its source in the table stays below it after sorting."""
    opened(browser, folder / "folder" / "index.html")
    browser.execute_script(
        "const r = document.querySelector('#worst tbody').rows[2]; r.cells[0].querySelector('a').prepend('\u2514 ');"
    )
    name = browser.execute_script(
        "return document.querySelector('#worst tbody').rows[1].cells[0].textContent"
    )
    head(browser, "worst", "loop").click()
    rows = browser.execute_script(
        "return Array.from(document.querySelector('#worst tbody').rows, (r) => r.cells[0].textContent)"
    )
    at = rows.index(name)
    assert "\u2514" in rows[at + 1]
