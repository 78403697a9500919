"""What is told in sentences: results in, text out; those that need no rule stand in texts.toml."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files


@cache
def texts(subject: str) -> dict[str, str]:
    """What texts.toml says of a subject."""
    found: dict[str, str] = tomllib.loads((files("analyzer.words") / "texts.toml").read_text("utf-8"))[
        subject
    ]
    return found
