"""HTML pages are self-contained and carry their numbers."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from html import unescape

import numpy as np
import pytest
from jinja2 import UndefinedError

from reports import html
from reports.pages import Band, Cell, Column, Page, Section, Table, Trend, as_held
from reports.plain import as_csv
from reports.svg import nice_ticks


def trend(n: int, rng: np.random.Generator) -> Trend:
    """A trend of n buckets with noise."""
    low = rng.normal(50, 5, (3, n))
    bands = tuple(
        Band(s.upper(), s, int(s == "op"), x, x + 1) for s, x in zip(("sp", "pv", "op"), low, strict=True)
    )
    return Trend("trend", "trend", 1.7e9 + 72.0 * np.arange(n), np.arange(n) % 100 == 0, bands, ("PV", "OP"))


def decoded(coded: dict[str, float | str]) -> np.ndarray:
    """The values that the page's script reads."""
    level = np.frombuffer(base64.b64decode(str(coded["data"])), "<u2").astype(float)
    return np.where(level == html.MISSING, np.nan, float(coded["low"]) + level * float(coded["step"]))


def test_trend_data_come_back() -> None:
    """The decoded levels of a trend differ by at most a 65,000th of their range. Gaps stay gaps, and times are
    exact."""
    t = trend(2000, np.random.default_rng(1))
    data = json.loads(str(html.trend_data(t)))
    offset = np.frombuffer(base64.b64decode(data["time"]), "<u4")
    np.testing.assert_array_equal(data["start"] + offset, t.time_s)
    for coded, band in zip(data["bands"], t.bands, strict=True):
        back = decoded(coded["low"])
        np.testing.assert_array_equal(np.isnan(back), t.gap)
        np.testing.assert_allclose(back[~t.gap], band.low[~t.gap], atol=np.ptp(band.low) / 65000)


def test_week_of_buckets_is_small() -> None:
    """A page with a week of 1,200 buckets a day is smaller than 0.5 MB in one file; with 6,000 a day it is
    smaller than 1.5 MB."""
    for buckets, most in ((8400, 0.5e6), (42000, 1.5e6)):
        page = Page("p", "p", "", (Section("s", (trend(buckets, np.random.default_rng(2)),)),))
        assert len(html.render(page, single_file=True)) < most


def test_single_file_requests_nothing() -> None:
    """A page in one file requests no address, and its policy lists the digest of every script and style."""
    page = Page("p", "p", "", (Section("s", (trend(10, np.random.default_rng(3)),)),))
    text = html.render(page, single_file=True)
    assert not re.search(r"<(?:link|img|iframe|script[^>]*\ssrc)", text)
    policy = unescape(re.search(r'Security-Policy" content="([^"]*)"', text)[1])  # type: ignore[index]
    assert policy.startswith("default-src 'none'")
    scripts = re.findall(r"<script>(.*?)</script>", text, re.S) + re.findall(
        r"<style>(.*?)</style>", text, re.S
    )
    assert len(scripts) == 5
    for body in scripts:
        assert base64.b64encode(hashlib.sha256(body.encode()).digest()).decode() in policy


def test_folder_pages_request_only_their_assets() -> None:
    """A page of a folder requests files in its assets folder and nothing else."""
    text = html.render(Page("p", "p", "", ()))
    requested = re.findall(r'(?:src|href)="([^"#]+)"', text)
    assert requested
    assert all(re.fullmatch(r"assets/[\w.]+", a) for a in requested)


def test_no_asset_uses_a_network() -> None:
    """No script or style sheet of this project requests anything."""
    for name in ("page.css", "page.js", "uPlot.min.css"):
        assert not re.search(r"https?://|fetch\(|XMLHttpRequest|@import|url\(", html.asset(name))


def test_undefined_names_are_errors() -> None:
    """A template that uses a name that the page lacks fails instead of leaving a blank."""
    with pytest.raises(UndefinedError):
        html._environment().from_string("{{ page.nothing.at_all }}").render(page=Page("p", "p", "", ()))


def test_cells_sort_by_full_numbers() -> None:
    """The cell of a number carries all its digits for sorting. The cell of an unknown number carries none."""
    table = Table("t", "", (Column("x", "x", True),), ((Cell("1.23", 1.2345678),), (Cell(""),)))
    text = html.render(Page("p", "p", "", (Section("s", (table,)),)))
    assert 'data-sort="1.2345678"' in text
    assert text.count("data-sort") == 1


@pytest.mark.parametrize(("low", "high"), [(0, 1), (-97, 12), (0.001, 0.0013), (-1e6, 3e6)])
def test_ticks_are_round_and_inside(low: float, high: float) -> None:
    """Ticks are inside the axis, evenly spaced, at one, two or five times a power of ten."""
    ticks = nice_ticks(low, high)
    steps = np.diff(ticks)
    assert 2 <= len(ticks) <= 8
    assert min(ticks) >= low - 1e-9 * abs(low)
    assert max(ticks) <= high + 1e-9 * abs(high)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-6)
    mantissa = steps[0] / 10 ** np.floor(np.log10(steps[0]) + 1e-9)
    assert min(abs(mantissa - m) for m in (1, 2, 5, 10)) < 1e-6


def test_a_long_table_shows_its_first_rows_and_their_number() -> None:
    """Of ten thousand rows a page shows the first three thousand and states the total number. The CSV file has
    all rows."""
    rows = tuple((Cell(f"L{k:05d}"),) for k in range(10_000))
    table = Table("all", "All", (Column("loop", "Loop"),), rows)
    text = html.render(Page("p", "P", "", (Section("S", (table,)),)), single_file=True)
    assert text.count("<td") == 3000
    assert "L02999" in text
    assert "L03000" not in text
    assert "The first 3,000 of 10,000 rows; its CSV holds all." in text
    assert as_csv(table).count("\n") == 10_001


def test_a_quantized_signal_is_quantized_again_without_loss() -> None:
    """Quantized levels of any signal differ by at most a 32,500th of its range. A second quantization and
    single precision change nothing."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        size, place = 10.0 ** rng.uniform(-6, 6), rng.uniform(-100, 100)
        x = size * (rng.normal(0.0, 1.0, 300) + place)
        held = as_held(x)
        assert np.abs(held - x).max() <= np.ptp(x) / 32500.0
        assert np.array_equal(as_held(held), held)
        assert np.array_equal(held.astype(np.float32).astype(float), held)
    assert np.array_equal(as_held(np.full(5, 0.1)), np.full(5, 0.1))
