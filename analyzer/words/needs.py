"""What a record needs for an answer and what it has instead, or the error that ended a loop."""

from __future__ import annotations

from analyzer.loop.decisions import Needs
from analyzer.words import sentences

SAYS = sentences("needs")
"""What is said of each need, of its figures."""


def said(needs: Needs) -> str:
    """What is needed, in words."""
    return SAYS[needs.need].format(*needs.figures)
