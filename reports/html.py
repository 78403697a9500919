"""Pages as HTML: self-contained or with shared assets, without network requests.

Templates place prepared values and compute nothing. Every text is escaped by jinja2; texts marked as safe are drawn
by reports.pictures, which escapes them itself.
"""

from __future__ import annotations

import base64
import hashlib
import json
from dataclasses import asdict
from functools import cache

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from reports import svg
from reports.pages import MOST_LEVEL, Cell, Floats, Page, Trend, WhatIf, levels
from reports.pictures import asset, drawings, keys
from reports.texts import visible_parts

ASSETS = ("page.css", "uPlot.min.css", "uPlot.iife.min.js", "page.js", "what_if.js")
LICENCE = "uPlot.LICENSE.txt"
FINE_S = 1e-3
"""Resolution of times that are not whole seconds [s]."""
MISSING = MOST_LEVEL + 1
"""Code of a bucket without a value."""


def _coded(values: Floats, gap: np.ndarray) -> dict[str, object]:
    """A signal as 16-bit levels between its ends, base64: 2.7 bytes a value, exact to 1/32500 of its
    range or better."""
    known = np.isfinite(values) & ~gap
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 1.0)
    low, step = levels(low, high)
    level = np.where(known, np.round((np.where(known, values, low) - low) / step), MISSING)
    return {"low": low, "step": step, "data": base64.b64encode(level.astype("<u2").tobytes()).decode()}


def trend_data(trend: Trend) -> Markup:
    """A trend as JSON for the page's script; '<' is escaped, so that no text can end the script."""
    start = float(trend.time_s[0]) if trend.time_s.size else 0.0
    passed = trend.time_s - start
    tick = 1.0 if np.abs(passed - np.round(passed)).max(initial=0.0) < FINE_S else FINE_S
    offset = np.round(passed / tick).astype("<u4")
    bands = [
        {"label": b.label, "kind": b.kind, "panel": b.panel}
        | {"low": _coded(b.low, trend.gap), "high": _coded(b.high, trend.gap)}
        for b in trend.bands
    ]
    data = {
        "start": start,
        "tick": tick,
        "time": base64.b64encode(offset.tobytes()).decode(),
        "bands": bands,
        "panels": trend.panels,
        "marks": list(map(asdict, trend.marks)),
        "spans": trend.spans,
        "opening": trend.opening,
        "least": trend.least,
    }
    return _for_script(data)


def what_if_data(block: WhatIf) -> Markup:
    """Model and load as JSON for the page's script, escaped as trends are."""
    data = {**json.loads(block.model), "load": _coded(block.load, np.zeros(block.load.size, dtype=bool))}
    return _for_script(data)


def _for_script(data: dict[str, object]) -> Markup:
    """JSON in which no text can end the script."""
    return Markup(json.dumps(data).replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))


def sort_key(cell: Cell) -> str:
    """Sort key of a cell: the full number; '' where the text itself is the key."""
    return "" if cell.number is None else f"{cell.number:.10g}"


@cache
def _environment() -> Environment:
    env = Environment(loader=PackageLoader("reports"), autoescape=True, undefined=StrictUndefined)
    env.trim_blocks = env.lstrip_blocks = True
    env.filters.update(sparkline=svg.sparkline, sort_key=sort_key, keys=keys, trend_data=trend_data)
    env.filters.update(what_if_data=what_if_data, block=lambda block: type(block).__name__)
    env.filters["drawn"] = lambda block: Markup("").join(drawn for _, drawn in drawings(block))
    return env


def policy(single_file: bool) -> str:
    """The content security policy: no external resources, no inline code except that of this page."""
    scripts = styles = "'self' file:"
    if single_file:
        digests = {name: hashlib.sha256(asset(name).encode()).digest() for name in ASSETS}
        allowed = {name: f"'sha256-{base64.b64encode(digest).decode()}'" for name, digest in digests.items()}
        scripts, styles = (" ".join(allowed[a] for a in ASSETS if a.endswith(end)) for end in (".js", ".css"))
    parts = ("default-src 'none'", f"script-src {scripts}", f"style-src {styles}", "img-src data:")
    return "; ".join((*parts, "base-uri 'none'", "form-action 'none'"))


def render(page: Page, single_file: bool = False) -> str:
    """A page as HTML; style and scripts are included in a `single_file`, otherwise loaded from assets/."""
    inlined = {a: Markup(asset(a)) for a in ASSETS} if single_file else {}
    parts = {"policy": Markup(policy(single_file)), "single_file": single_file, "inlined": inlined}
    return _environment().get_template("page.html.j2").render(page=visible_parts(page), **parts)


def mail(page: Page) -> str:
    """A page's texts, lists and tables as one small mail: no scripts, no pictures, no network requests."""
    return _environment().get_template("mail.html.j2").render(page=visible_parts(page))
