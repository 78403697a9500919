"""The Python API behaves as its examples show."""

from __future__ import annotations

import doctest
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import analyzer
from analyzer import api

ROOT = Path(__file__).resolve().parents[2]


def test_examples_of_the_api(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every example in the API's docstrings gives the result that it shows, run from the project's folder."""
    monkeypatch.chdir(ROOT)
    found = doctest.testmod(api)
    assert found.attempted >= 12
    assert found.failed == 0


def test_the_package_gives_the_functions_of_the_page() -> None:
    """`import analyzer as triage` has every function that the page lists, and no other public name."""
    page = (ROOT / "docs" / "python.md").read_text()
    assert sorted(re.findall(r"^\| `(\w+)\(", page, re.M)) == sorted(analyzer.__all__)
    assert all(callable(getattr(analyzer, name)) for name in analyzer.__all__)
    assert set(analyzer.__all__) < set(dir(analyzer))
    with pytest.raises(AttributeError, match="'asses'"):
        analyzer.asses  # noqa: B018


def test_a_command_does_not_import_the_api() -> None:
    """`triage rank` imports neither pandas nor the API. The name `analyzer.explain` is callable also after an
    import of the package with this name."""
    script = (
        "import sys, analyzer.cli, analyzer; assert 'analyzer.api' not in sys.modules;"
        "assert not {'pandas', 'scipy', 'numba'} & set(sys.modules);"
        "import analyzer.explain; assert callable(analyzer.explain)"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_page_on_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """The code of the page runs unchanged, and its results agree with the comments."""
    monkeypatch.chdir(ROOT)
    code = re.search(r"```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(), re.S)
    assert code is not None
    names: dict[str, Any] = {}
    exec(code.group(1), names)
    assert names["found"].verdict.cause == "valve"
    assert names["model"].estimates["backlash_pct"].value > 1.0
    assert names["plan"].model.controller == names["loop"].controller
    assert names["why"].data["loop"] == "TIC2106"
