"""Pages work in a real browser: from disk, without network, at every width, by mouse, keyboard and printer."""

from __future__ import annotations

import base64
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from analyzer.loops.changes import TuningChange
from analyzer.pages import before_after, night
from analyzer.pages.change_cases import change_cases
from reports.folder import write_html
from tests.reports.small_store import NASTY, START_S, small_store

selenium = pytest.importorskip("selenium", reason="needs selenium, of the test extra")
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and chromedriver")

OPTIONS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars"),
    *("--proxy-server=127.0.0.1:9", "--window-size=1280,900"),
)
A4_PX = 703
"""Width of an A4 sheet between its margins of 12 mm, in CSS pixels."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pages of a synthetic store: morning, loops, before and after; in a folder and in single files."""
    out = tmp_path_factory.mktemp("pages")
    store = small_store(out / "store", loops=40)
    changes = [TuningChange(tag, START_S + 7 * 86400.0, 1, 2, 3, 4, "<b>me</b>") for tag in NASTY[:3]]
    found, missing = change_cases(store, changes)
    report = before_after.changes_page(found, missing, "seven days")
    written = [*night.pages_of_night(store, None, 8), report]
    write_html(written, out / "folder")
    write_html(written, out / "single", single_file=True)
    return out


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A headless Chromium with a separate profile and without network."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for option in (*OPTIONS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(str(DRIVER)))
    yield driver
    driver.quit()


def opened(browser: Any, path: Path) -> None:
    """Open a page from disk and wait until it is ready."""
    browser.get(path.as_uri())
    wait(browser, "return document.readyState === 'complete'")


def wait(browser: Any, condition: str, tries: int = 2000) -> None:
    """Wait until a script returns true. The number of tries allows for a busy machine and does not change the
    result."""
    for _ in range(tries):
        if browser.execute_script(condition):
            return
        time.sleep(0.05)
    raise AssertionError(f"never true: {condition}")


def every_page(folder: Path) -> list[Path]:
    """All pages written, in both forms."""
    return sorted(p for kind in ("folder", "single") for p in (folder / kind).glob("*.html"))


def loop_page(folder: Path) -> Path:
    """A loop's page."""
    return next(p for p in sorted((folder / "folder").glob("FIC*.html")))


def column(browser: Any, table: str, key: str) -> list[str]:
    """Texts of a column's visible cells."""
    script = """const t = document.getElementById(arguments[0]);
      const at = Array.from(t.tHead.rows[0].cells).findIndex((h) => h.dataset.key === arguments[1]);
      return Array.from(t.tBodies[0].rows).filter((r) => !r.hidden).map((r) => r.cells[at].textContent.trim());"""
    return list(browser.execute_script(script, table, key))


def head(browser: Any, table: str, key: str) -> Any:
    """The button of a column's heading."""
    from selenium.webdriver.common.by import By

    return browser.find_element(By.CSS_SELECTOR, f"#{table} th[data-key='{key}'] button")


def test_pages_load_without_errors(browser: Any, folder: Path) -> None:
    """Every page loads from disk without an error in the console and without a request to a network."""
    paths = every_page(folder)
    assert len(paths) == 26
    for path in paths:
        opened(browser, path)
        assert [e for e in browser.get_log("browser") if e["level"] == "SEVERE"] == [], path.name
        requested = browser.execute_script(
            "return performance.getEntriesByType('resource').map((e) => e.name)"
        )
        assert all(name.startswith("file:") for name in requested)
        wait(browser, "return Array.from(document.querySelectorAll('.trend')).every((t) => t.dataset.ready)")


def test_plant_text_runs_no_script(browser: Any, folder: Path) -> None:
    """A tag that contains a script is shown as text in the table and in the title."""
    opened(browser, folder / "folder" / "index.html")
    assert NASTY[0] in column(browser, "ranking", "loop")
    assert browser.execute_script("return document.querySelectorAll('main script:not([type])').length") == 0


def test_sorting(browser: Any, folder: Path) -> None:
    """A heading sorts by number or name and reports the order; the second click reverses the order. Unknown
    cells stay last."""
    opened(browser, folder / "folder" / "index.html")
    key = "valve_travel_pct_per_h"
    head(browser, "ranking", key).click()
    found = [float(x) for x in column(browser, "ranking", key) if x]
    assert found == sorted(found, reverse=True)
    assert column(browser, "ranking", key)[-1] == ""
    th = "return document.querySelector('#ranking th[data-key=valve_travel_pct_per_h]').getAttribute('aria-sort')"
    assert browser.execute_script(th) == "descending"
    head(browser, "ranking", key).click()
    found = [float(x) for x in column(browser, "ranking", key) if x]
    assert found == sorted(found)
    assert column(browser, "ranking", key)[-1] == ""
    assert browser.execute_script(th) == "ascending"


def test_sorting_by_keyboard(browser: Any, folder: Path) -> None:
    """A heading that has the focus sorts when the user presses Enter."""
    from selenium.webdriver.common.keys import Keys

    opened(browser, folder / "folder" / "index.html")
    head(browser, "ranking", "area").send_keys(Keys.ENTER)
    areas = column(browser, "ranking", "area")
    assert areas == sorted(areas)


def test_filtering(browser: Any, folder: Path) -> None:
    """Text and cause filter the rows together, and the page shows the number of visible rows."""
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import Select

    opened(browser, folder / "folder" / "index.html")
    tools = browser.find_element(By.CSS_SELECTOR, ".tools[data-for=ranking]")
    Select(tools.find_element(By.CSS_SELECTOR, "select[data-facet=cause]")).select_by_value("valve")
    assert set(column(browser, "ranking", "cause")) == {"valve"}
    held = column(browser, "ranking", "loop")
    wanted = next(tag for tag in held if tag.startswith("FIC"))
    tools.find_element(By.TAG_NAME, "input").send_keys(wanted.lower())
    assert column(browser, "ranking", "loop") == [wanted] != held
    assert tools.find_element(By.TAG_NAME, "output").text == "1 of 40 rows"


def test_zooming(browser: Any, folder: Path) -> None:
    """Buttons, keys, wheel and drag zoom a trend on both axes at the same time. A double click shows the full
    trend again."""
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    opened(browser, loop_page(folder))
    figure = browser.find_element(By.CSS_SELECTOR, ".trend")
    over = figure.find_element(By.CSS_SELECTOR, ".u-over")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", figure)

    def width() -> float:
        return float(figure.get_attribute("data-to")) - float(figure.get_attribute("data-from"))

    whole = width()
    assert whole > 6.9 * 86400
    figure.find_element(By.CSS_SELECTOR, "button[aria-label='Zoom in']").click()
    assert width() == pytest.approx(whole / 2)
    first = float(figure.get_attribute("data-from"))
    figure.find_element(By.CSS_SELECTOR, "button[aria-label='Earlier']").click()
    assert float(figure.get_attribute("data-from")) == pytest.approx(first - whole / 8)
    browser.execute_script("arguments[0].focus()", figure)
    figure.send_keys("+")
    assert width() == pytest.approx(whole / 4)
    figure.send_keys("0")
    assert width() == pytest.approx(whole)
    wheel = """const sent = new WheelEvent('wheel',
        {deltaY: -100, clientX: 600, cancelable: true, ctrlKey: arguments[1]});
        arguments[0].dispatchEvent(sent); return sent.defaultPrevented;"""
    assert not browser.execute_script(wheel, over, False)  # without Ctrl the page scrolls
    assert width() == pytest.approx(whole)
    assert browser.execute_script(wheel, over, True)
    assert width() == pytest.approx(0.75 * whole)
    figure.send_keys("0")
    chain = ActionChains(browser).move_to_element_with_offset(over, -200, 0).click_and_hold()
    chain.move_by_offset(120, 0).release().perform()
    assert 0.05 * whole < width() < 0.3 * whole
    zoomed, before = width(), float(figure.get_attribute("data-from"))
    chain = (
        ActionChains(browser).key_down(Keys.SHIFT).move_to_element_with_offset(over, 0, 0).click_and_hold()
    )
    chain.move_by_offset(150, 0).release().key_up(Keys.SHIFT).perform()
    assert width() == pytest.approx(zoomed)
    assert float(figure.get_attribute("data-from")) < before
    ActionChains(browser).double_click(over).perform()
    assert width() == pytest.approx(whole)


@pytest.mark.parametrize("width", [390, pytest.param(1280, marks=pytest.mark.slow), 1920])
def test_nothing_overflows(browser: Any, folder: Path, width: int) -> None:
    """No page is wider than a phone, a laptop or a wide screen. Wide tables scroll in their own box."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    for path in every_page(folder):
        opened(browser, path)
        over = "return document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert browser.execute_script(over) <= 0, path.name
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def words(pdf: bytes, path: Path) -> list[str]:
    """Text of each sheet of a PDF."""
    path.write_bytes(pdf)
    found = subprocess.run(["pdftotext", "-layout", path, "-"], capture_output=True, text=True, check=True)
    return found.stdout.split("\f")


@pytest.mark.skipif(not shutil.which("pdftotext"), reason="needs pdftotext of poppler-utils")
def test_headings_are_printed_on_every_sheet(browser: Any, folder: Path, tmp_path: Path) -> None:
    """A table that needs several printed sheets has its headings on each of them."""
    opened(browser, folder / "folder" / "index.html")
    pdf = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    sheets = [s for s in words(pdf, tmp_path / "page.pdf") if re.search(r"\bflow\b", s)]
    assert len(sheets) >= 2
    assert all("Description" in s and "Action" in s for s in sheets)


def test_print_is_complete(browser: Any, folder: Path) -> None:
    """A page printed on A4 has several sheets. No table is wider than the sheet, and the style cuts no row."""
    opened(browser, folder / "folder" / "index.html")
    pdf = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    boxes = re.findall(rb"/MediaBox \[([\d. ]+)\]", pdf)
    assert len(boxes) >= 2
    assert {tuple(round(float(x)) for x in box.split()) for box in boxes} <= {
        (0, 0, 595, 842),
        (0, 0, 596, 842),
    }
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    style = "return getComputedStyle(document.querySelector(arguments[0]))[arguments[1]]"
    assert browser.execute_script(style, "thead", "display") == "table-header-group"
    assert browser.execute_script(style, "tbody tr", "breakInside") == "avoid"
    assert browser.execute_script(style, ".tools", "display") == "none"
    sheet = {"width": A4_PX, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", sheet)
    right = """return Math.max(...Array.from(document.querySelectorAll('table'),
      (t) => t.getBoundingClientRect().right))"""
    assert browser.execute_script(right) <= A4_PX
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def test_dark_follows_the_system(browser: Any, folder: Path) -> None:
    """If the system uses a dark mode, the page is dark and its text is light."""
    opened(browser, folder / "folder" / "index.html")
    shade = "return getComputedStyle(document.documentElement)[arguments[0]].match(/\\d+/g).slice(0, 3).map(Number)"
    for scheme, dark in (("dark", True), ("light", False)):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        paper, ink = (sum(browser.execute_script(shade, p)) for p in ("backgroundColor", "color"))
        assert (paper < ink) == dark


def test_structure_is_correct_for_screen_readers(browser: Any, folder: Path) -> None:
    """Each page has one main heading, a language and unique ids. All controls and all pictures except ornaments
    have names."""
    for path in every_page(folder):
        opened(browser, path)
        wrong = browser.execute_script(
            """const all = (q) => Array.from(document.querySelectorAll(q));
            const ids = all('[id]').map((e) => e.id);
            return [all('h1').length !== 1 && 'h1', !document.documentElement.lang && 'lang',
              all('svg:not([aria-hidden])').some((s) => !s.getAttribute('aria-label')) && 'svg',
              all('button').some((b) => !b.textContent.trim() && !b.getAttribute('aria-label')) && 'button',
              all('input, select').some((i) => !i.closest('label')) && 'label',
              all('th').some((h) => h.scope !== 'col') && 'th',
              new Set(ids).size !== ids.length && 'ids'].filter((x) => x)"""
        )
        assert wrong == [], path.name
