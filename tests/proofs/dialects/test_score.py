"""Exports of other makes are read right or refused; none is wrong without a word."""

from __future__ import annotations

from collections import Counter

import pytest

from proofs.dialects.score import Outcome, outcomes

ENOUGH = 176
"""Plain exports of 181 that are right, as score.md has it."""


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> list[Outcome]:
    """All cases."""
    return outcomes(tmp_path_factory.mktemp("dialects"))


def test_no_export_is_wrong(found: list[Outcome]) -> None:
    """Of exports that can be read none has a sample missing, invented, of another value, or bad and called good."""
    assert [(o.case, o.detail) for o in found if o.kind == "plain" and o.said == "wrong"] == []


def test_most_exports_are_right(found: list[Outcome]) -> None:
    """The rest is refused: as many are right as the committed score says."""
    assert Counter(o.said for o in found if o.kind == "plain")["right"] >= ENOUGH


def test_what_is_no_export_is_refused(found: list[Outcome]) -> None:
    """PDFs, login pages, empty and cut files, alarm lists end in one line that names the file."""
    assert [o.case for o in found if o.kind == "refuse" and o.said != "refused"] == []
    assert all("\n" not in o.detail for o in found if o.said == "refused")


def test_what_cannot_be_known_is_told(found: list[Outcome]) -> None:
    """Of dates and hours that read two ways each is right, refused, or read with a word on what is not known."""
    silent = [o for o in found if o.kind == "unknowable" and o.said == "wrong" and not o.warned]
    assert [o.case for o in silent] == []
