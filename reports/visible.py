"""Texts of a plant as people may be shown them."""

from __future__ import annotations


def visible(text: str) -> str:
    """The text without characters that steer a terminal or turn the direction of writing."""
    return "".join(c if c.isprintable() else " " for c in text)
