"""Pages as one small HTML mail: no scripts, no pictures, nothing asked of any network, styles on the elements."""

from __future__ import annotations

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from reports.pages import Page
from reports.visible import visible_parts


@cache
def _environment() -> Environment:
    env = Environment(
        loader=PackageLoader("reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    env.filters["block"] = lambda block: type(block).__name__
    return env


def render(page: Page) -> str:
    """A page's texts, lists and tables as a mail's HTML."""
    return _environment().get_template("mail.html.j2").render(page=visible_parts(page))
