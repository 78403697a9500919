"""Columns of the store as columns of a page, with the titles and units that they are declared with."""

from __future__ import annotations

from analyzer.columns import BY_NAME
from reports.pages import Column


def heading(name: str, wide: bool = False) -> Column:
    """The heading of a column of the store; `wide` ones may wrap."""
    declared = BY_NAME[name]
    return Column(name, declared.heading, declared.is_number, declared.hint, wide)


def headings(*names: str) -> tuple[Column, ...]:
    """The headings of several columns."""
    return tuple(heading(name) for name in names)


def titled(name: str, text: str) -> tuple[str, str]:
    """A figure as a fact: the column's title, and a text with the column's unit."""
    declared = BY_NAME[name]
    return declared.title, f"{text} {declared.unit}".strip()
