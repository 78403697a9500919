"""Exports of other systems are read correctly or refused; no export is read wrongly without a message."""

from __future__ import annotations

from collections import Counter

import pytest

from proofs.dialects.score import Outcome, outcomes

ENOUGH = 176
"""Number of the 181 readable exports that are read correctly, as in score.md."""


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> list[Outcome]:
    """The outcomes of all cases."""
    return outcomes(tmp_path_factory.mktemp("dialects"))


def test_no_export_is_wrong(found: list[Outcome]) -> None:
    """No readable export has a sample that is missing, invented, changed, or bad but marked as good."""
    assert [(o.case, o.detail) for o in found if o.kind == "plain" and o.verdict == "wrong"] == []


def test_most_exports_are_right(found: list[Outcome]) -> None:
    """The number of correctly read exports is at least the committed score; the other readable exports are
    refused."""
    assert Counter(o.verdict for o in found if o.kind == "plain")["right"] >= ENOUGH


def test_files_that_are_no_exports_are_refused(found: list[Outcome]) -> None:
    """PDFs, login pages, empty and cut files, and alarm lists give one line that names the file."""
    assert [o.case for o in found if o.kind == "refuse" and o.verdict != "refused"] == []
    assert all("\n" not in o.detail for o in found if o.verdict == "refused")


def test_ambiguous_dates_are_reported(found: list[Outcome]) -> None:
    """An ambiguous date or hour is read correctly, refused, or read with a warning about the ambiguity."""
    silent = [o for o in found if o.kind == "unknowable" and o.verdict == "wrong" and not o.warned]
    assert [o.case for o in silent] == []
