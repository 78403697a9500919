"""Proofs and benchmarks can still be run: each can be imported, and each command that is told of exists."""

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
TOLD = "\n".join(
    path.read_text("utf-8")
    for pattern in ("*.md", "docs/*.md", "proofs/**/*.md", "benchmarks/*.md")
    for path in ROOT.glob(pattern)
)


@pytest.mark.parametrize("name", MODULES)
def test_each_module_can_be_imported(name: str) -> None:
    """What a proof takes from the packages is still there, so that a rename cannot break it unseen."""
    assert import_module(name)


@pytest.mark.parametrize("name", sorted(set(re.findall(r"python -m ((?:proofs|benchmarks)[\w.]*)", TOLD))))
def test_each_command_told_of_exists(name: str) -> None:
    """Every `python -m` that a page names is a module."""
    assert find_spec(name) is not None


@pytest.mark.parametrize(
    "path", sorted(set(re.findall(r"\b(?:proofs|benchmarks)/[\w/]+\.(?:py|md)\b", TOLD)))
)
def test_each_file_told_of_exists(path: str) -> None:
    """Every script and table that a page names is there, from the repository's root or beside the docs."""
    assert (ROOT / path).exists() or (ROOT / "tests" / path).exists()
