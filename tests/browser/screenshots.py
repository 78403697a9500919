"""Pictures of every kind of page for the documentation: python -m tests.browser.screenshots WEEK WEEKS [--out
DIR]

Each small picture shows one page at three widths and in print, side by side. The program needs chromium, its
driver and two stores of the sample mill: one of the first week (README, first command), and one of both weeks
for the before-and-after page.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import tempfile
import time
from pathlib import Path
from typing import Any

from PIL import Image
from selenium import webdriver

from analyzer.cli import main as triage
from tests.browser.test_pages import A4_PX, CHROMIUM, DRIVER, OPTIONS

WIDTHS = (390, 1280, 1920)
HEIGHT = 1700
"""Height of a picture before it is reduced [px]. Longer pages are cut."""
SMALL = 0.4
"""Factor by which pictures are reduced."""
GAP = 12


def shot(browser: Any, page: Path, width: int, media: str) -> Image.Image:
    """One page as the browser shows it."""
    size = {"width": width, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media})
    browser.get(page.as_uri())
    time.sleep(1.0)
    return Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB")


def sheet(browser: Any, page: Path) -> Image.Image:
    """All views of a page side by side, reduced."""
    views = [*((w, "screen") for w in WIDTHS), (A4_PX, "print")]
    drawn = [shot(browser, page, width, media) for width, media in views]
    small = [im.resize((round(im.width * SMALL), round(im.height * SMALL)), Image.LANCZOS) for im in drawn]
    out = Image.new("RGB", (sum(im.width + GAP for im in small) - GAP, small[0].height), "#8a949a")
    left = 0
    for im in small:
        out.paste(im, (left, 0))
        left += im.width + GAP
    return out.quantize(96)


def run(arguments: list[str]) -> None:
    """Run a command of triage in this process. A command may end with a status."""
    with contextlib.suppress(SystemExit):
        triage(arguments, standalone_mode=False)


def written(store: Path, weeks: Path, out: Path) -> dict[str, Path]:
    """One page of each kind, by the name of its picture."""
    changes = Path("sample_data/changes.csv")
    run(["pages", str(store), "--out", str(out)])
    run(["report", str(weeks), "--changes", str(changes), "--out", str(out)])
    settings = next(out.glob("LIC2107-*-settings.html"))
    loop = out / settings.name.replace("-settings", "")
    kinds = {"morning": out / "index.html", "maintenance": out / "maintenance.html", "loop": loop}
    kinds |= {"settings": settings, "group": out / "group-1.html", "before-after": out / "before-after.html"}
    return {name: path for name, path in kinds.items() if path.exists()}


def main() -> None:
    """Draw and save the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("week", type=Path)
    parser.add_argument("weeks", type=Path)
    parser.add_argument("--out", type=Path, default=Path("docs/images"))
    options = parser.parse_args()
    chrome = webdriver.ChromeOptions()
    chrome.binary_location = str(CHROMIUM)
    for option in OPTIONS:
        chrome.add_argument(option)
    browser = webdriver.Chrome(chrome, webdriver.ChromeService(str(DRIVER)))
    try:
        with tempfile.TemporaryDirectory() as folder:
            for name, page in written(options.week, options.weeks, Path(folder)).items():
                path = options.out / f"{name}-page.png"
                sheet(browser, page).save(path, optimize=True)
                print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
    finally:
        browser.quit()


if __name__ == "__main__":
    main()
