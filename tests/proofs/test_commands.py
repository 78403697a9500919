"""Proofs and benchmarks can be run: each module can be imported, and each command on a page exists."""

from __future__ import annotations

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODULES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for folder in ("proofs", "benchmarks")
    for path in (ROOT / folder).rglob("*.py")
    if path.name not in ("__init__.py", "__main__.py")
)
PAGES = "\n".join(
    path.read_text("utf-8")
    for pattern in ("*.md", "docs/*.md", "proofs/**/*.md", "benchmarks/*.md")
    for path in ROOT.glob(pattern)
)


@pytest.mark.parametrize("name", MODULES)
def test_each_module_can_be_imported(name: str) -> None:
    """Each module of the proofs and benchmarks can be imported after a rename in the packages."""
    assert import_module(name)


@pytest.mark.parametrize("name", sorted(set(re.findall(r"python -m ((?:proofs|benchmarks)[\w.]*)", PAGES))))
def test_each_command_on_a_page_exists(name: str) -> None:
    """Every `python -m` command that a page names is a module."""
    assert find_spec(name) is not None


@pytest.mark.parametrize(
    "path", sorted(set(re.findall(r"\b(?:proofs|benchmarks)/[\w/]+\.(?:py|md)\b", PAGES)))
)
def test_each_file_on_a_page_exists(path: str) -> None:
    """Every script and table that a page names exists in the repository's root or in tests."""
    assert (ROOT / path).exists() or (ROOT / "tests" / path).exists()
