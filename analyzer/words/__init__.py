"""Results as sentences; those without a rule are in texts.toml."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def toml_of(room: str, name: str) -> dict[str, Any]:
    """A TOML file of a subpackage of the analyzer."""
    return tomllib.loads((files(room) / name).read_text("utf-8"))


def sentences(subject: str) -> dict[str, str]:
    """The texts of a subject in texts.toml."""
    found: dict[str, str] = toml_of("analyzer.words", "texts.toml")[subject]
    return found
