"""Reasons consist of clauses and sentences, and are read as one text."""

from __future__ import annotations

import math
import re

from hypothesis import given
from hypothesis import strategies as st

from analyzer.words.reason import joined
from tuning.reasons import WHY, robustness


@given(st.lists(st.one_of(st.none(), st.from_regex(r"[a-z ]{0,9}\.?", fullmatch=True)), max_size=5))
def test_no_sentence_ends_before_a_semicolon(clauses: list[str | None]) -> None:
    """In any combination there is no full stop or blank before a semicolon, and no empty clause."""
    found = joined(*clauses)
    assert not re.search(r"[.\s];|;\s*;|^;|;$", found)
    words = [w for c in clauses if c for w in re.findall("[a-z]+", c)]
    assert re.findall("[a-z]+", found) == words


def test_an_ellipsis_is_kept() -> None:
    """An ellipsis at the end of a clause is kept and is no full stop."""
    assert joined("it moves A, B ...", "", "OP is at its limit.") == "it moves A, B ...; OP is at its limit"


def test_no_maximum_sensitivity_is_reported_for_an_unstable_loop() -> None:
    """A loop without a maximum sensitivity is reported as unstable, and no reason says that Ms is infinite."""
    assert (robustness(1.7), robustness(math.inf)) == ("Ms 1.70", "unstable")
    assert "inf" not in WHY["robust"].format(ms=robustness(math.inf))
