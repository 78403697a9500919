"""Clauses put together to one reason."""

from __future__ import annotations


def joined(*clauses: str | None) -> str:
    """Clauses with a semicolon between, those that say nothing left out; a full stop at the end of one goes."""
    return "; ".join(filter(None, map(_open, clauses)))


def _open(clause: str | None) -> str:
    """A clause to which another one may be added."""
    text = (clause or "").strip()
    return text if text[-2:] == ".." else text.removesuffix(".").strip()
