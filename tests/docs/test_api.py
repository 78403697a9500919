"""The Python API does what its examples say."""

from __future__ import annotations

import doctest
import re
from pathlib import Path
from typing import Any

import pytest

from analyzer import api

ROOT = Path(__file__).resolve().parents[2]


def test_examples_of_the_api(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every example in the API's docstrings gives what it shows, from the project's folder."""
    monkeypatch.chdir(ROOT)
    found = doctest.testmod(api)
    assert found.attempted >= 12
    assert found.failed == 0


def test_page_on_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """The lines of the page run as they stand, and their results hold what the comments say."""
    monkeypatch.chdir(ROOT)
    code = re.search(r"```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(), re.S)
    assert code is not None
    names: dict[str, Any] = {}
    exec(code.group(1), names)
    assert names["found"].verdict.cause == "valve"
    assert names["model"].estimates["backlash_pct"].value > 1.0
    assert names["plan"].model.controller == names["loop"].controller
    assert names["why"].data["loop"] == "TIC2106"
