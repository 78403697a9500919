"""Each mistake of a new user gives one line of explanation, or a list that states what the trends can show."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofs.first_hour.__main__ import answered
from proofs.first_hour.cases import LISTED, MISTAKES, Mistake

PAGE = Path(__file__).resolve().parents[3] / "docs" / "first-hour.md"


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda m: m.what)
def test_each_mistake_is_answered(mistake: Mistake, tmp_path: Path) -> None:
    """Exit status, message and, if a night was written, action and reason agree with the page."""
    status, message, action, reason = answered(mistake, tmp_path)
    assert status == mistake.status, message
    assert mistake.message in message
    assert "Traceback" not in message
    if mistake.what in LISTED:
        wanted, part = LISTED[mistake.what]
        assert action == wanted
        assert part in reason


def test_the_page_names_them_all() -> None:
    """docs/first-hour.md has a row for each mistake."""
    text = PAGE.read_text("utf-8")
    assert len(MISTAKES) >= 20
    assert all(f"| {m.what} |" in text for m in MISTAKES)
