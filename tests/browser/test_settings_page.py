"""The settings page simulates as the analysis does, in the units of the plant's controller."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.advice.settings_side_by_side import compared
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import controller
from analyzer.pages.compared import settings_page
from identification.models import Backlash, Fopdt, Form, Loop, Motion, Stiction
from reports.folder import write_html
from reports.pages import as_held
from tests.browser.test_pages import CHROMIUM, DRIVER, browser, opened, wait
from tuning.forecast import tried

pytestmark = pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and chromedriver")
__all__ = ["browser"]
SPAN = 250.0
BAND = LoopSpec(
    "FIC1",
    kp=120.0,
    ti=0.4,
    gain_unit="band",
    ti_unit="min",
    pv_unit="m3/h",
    pv_lo=0.0,
    pv_hi=SPAN,
    scan_s=1.0,
)
PARALLEL = replace(BAND, loop="FIC2", kp=0.5, ti=40.0, gain_unit="percent", ti_unit="s", form=Form.PARALLEL)
ENGINEERING = replace(BAND, loop="FIC3", kp=0.3, ti=2.5, gain_unit="engineering", ti_unit="repeats/min")
ALONE = replace(BAND, loop="FIC4", kp=0.5, ti=0.0, gain_unit="percent", ti_unit="s")
CASES = {
    "backlash": (BAND, Backlash(3.0)),
    "stick-slip": (PARALLEL, Stiction(4.0, 2.0, Motion.RESTS)),
    "dry friction": (ENGINEERING, Stiction(3.0, 1.0, Motion.HALTS)),
    "free": (BAND, None),
    "gain alone": (ALONE, Backlash(3.0)),
}


def loop_of(name: str) -> Loop:
    """The loop of a case, with the controller that its row of loops.csv states."""
    spec, valve = CASES[name]
    stated = controller(spec, SPAN)
    assert stated is not None
    return Loop(Fopdt(1.2, 30.0, 3.0), stated, valve)


def load() -> np.ndarray:
    """A slowly varying load with noise [% PV]."""
    rng = np.random.default_rng(5)
    return 0.3 * np.sin(np.arange(9000) / 700.0) + 0.05 * rng.standard_normal(9000)


@pytest.fixture(scope="module")
def settings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of every case, in one file each."""
    out = tmp_path_factory.mktemp("settings")
    for name, (spec, _) in CASES.items():
        new = replace(loop_of(name).controller, kp=0.4, ti_s=60.0)
        found = compared(loop_of(name), load(), new, 120.0, SPAN, Config().tuning)
        assert found is not None
        write_html(
            [replace(settings_page(spec.loop, "2026-03-08", found, spec), name=name)], out, single_file=True
        )
    return out


def shown(browser: Any) -> tuple[float, float]:
    """Travel [%/h] and error [own unit] that the page shows."""
    script = (
        "const f = document.querySelector('.whatif').dataset; return [Number(f.travel), Number(f.error)];"
    )
    travel, error = browser.execute_script(script)
    return float(travel), float(error)


@pytest.mark.parametrize("name", CASES)
def test_page_simulates_as_the_analysis_does(browser: Any, settings: Path, name: str) -> None:
    """With the recommended settings the page shows the travel and error of the analysis, to nine digits."""
    opened(browser, settings / f"{name}.html")
    wait(browser, "return document.querySelector('.whatif').dataset.ready === 'yes'")
    assert [e for e in browser.get_log("browser") if e["level"] == "SEVERE"] == []
    loop = loop_of(name)
    (ours,) = tried(loop, as_held(load()), {"x": replace(loop.controller, kp=0.4, ti_s=60.0)})
    travel, error = shown(browser)
    assert travel == pytest.approx(ours.stem_travel, rel=1e-9)
    assert error == pytest.approx(ours.error * SPAN / 100.0, rel=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_settings_typed_in_are_those_of_the_controller(browser: Any, settings: Path, name: str) -> None:
    """If the user types the settings of loops.csv, the page shows the present loop again, for every form and
    unit of the controller."""
    opened(browser, settings / f"{name}.html")
    wait(browser, "return document.querySelector('.whatif').dataset.ready === 'yes'")
    spec = CASES[name][0]
    browser.execute_script(
        """const f = document.querySelector('.whatif');
        const box = (of) => f.querySelector('input[type="number"][data-of="' + of + '"]');
        box('kp').value = arguments[0]; box('ti').value = arguments[1];
        delete f.dataset.travel; box('ti').dispatchEvent(new Event('change'));""",
        spec.kp,
        spec.ti,
    )
    wait(browser, "return document.querySelector('.whatif').dataset.travel !== undefined")
    cells = browser.execute_script(
        "return Array.from(document.querySelectorAll('.whatif td'), (c) => c.textContent)"
    )
    assert cells[0] == cells[1]
    assert cells[2] in ("0 %", "–")


def test_sliders_change_the_simulation(browser: Any, settings: Path) -> None:
    """A longer Ti by the slider reduces the travel of a loop with backlash. The page also states this as text
    for screen readers."""
    opened(browser, settings / "backlash.html")
    wait(browser, "return document.querySelector('.whatif').dataset.ready === 'yes'")
    browser.execute_script("Array.from(document.querySelectorAll('.choices button'))[0].click()")
    wait(browser, "return document.querySelectorAll('.whatif td')[2].textContent === '0 %'")
    before, _ = shown(browser)
    browser.execute_script(
        """const s = document.querySelector('.whatif input[type="range"][data-of="ti"]');
        s.value = 900; s.dispatchEvent(new Event('input'));"""
    )
    wait(browser, "return document.querySelectorAll('.whatif td')[2].textContent !== '0 %'")
    after, _ = shown(browser)
    assert after < 0.7 * before
    assert "travel" in browser.execute_script("return document.querySelector('.whatif output').textContent")


@pytest.mark.parametrize(
    ("of", "typed", "why"),
    [
        ("kp", "0", "Kp needs a number above 0"),
        ("kp", "-3", "Kp needs a number above 0"),
        ("kp", "", "Kp needs a number"),
        ("kp", "1e9", "times from the present one"),
        ("ti", "-1", "Ti needs a number above 0"),
    ],
)
def test_an_invalid_number_is_refused_next_to_its_field(
    browser: Any, settings: Path, of: str, typed: str, why: str
) -> None:
    """The page states the allowed numbers and keeps the last simulation. A valid number removes the message."""
    opened(browser, settings / "stick-slip.html")
    wait(browser, "return document.querySelector('.whatif').dataset.ready === 'yes'")
    before = shown(browser)
    type_in(browser, of, typed)
    assert why in refused(browser, of)
    assert shown(browser) == before
    type_in(browser, of, "0.5" if of == "kp" else "40")
    assert refused(browser, of) == ""


def test_an_unstable_loop_is_reported_as_unstable(browser: Any, settings: Path) -> None:
    """At twenty times the gain the page reports an unstable loop instead of a change in percent."""
    opened(browser, settings / "free.html")
    wait(browser, "return document.querySelector('.whatif').dataset.ready === 'yes'")
    type_in(browser, "kp", "1")
    wait(browser, "return document.querySelector('.whatif output').textContent.startsWith('Unstable')")
    cells = browser.execute_script(
        "return Array.from(document.querySelectorAll('.whatif td.n'), (c) => c.textContent)"
    )
    assert cells[1::3] == ["unstable"] * 3


def type_in(browser: Any, of: str, text: str) -> None:
    """Type into a field and leave it."""
    browser.execute_script(
        """const box = document.querySelector('.whatif input[type="number"][data-of="' + arguments[0] + '"]');
        box.value = arguments[1]; box.dispatchEvent(new Event('change'));""",
        of,
        text,
    )


def refused(browser: Any, of: str) -> str:
    """The message next to a field."""
    return str(
        browser.execute_script(
            "return document.querySelector('.refused[data-of=' + arguments[0] + ']').textContent", of
        )
    )
