"""A change of a controller with what came of it, and its outcome in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from analyzer.comparison.before_after import Change, Grade, LoopComparison, Verdict, grade
from analyzer.loops.changes import TuningChange
from analyzer.pages.engineering import PLAIN, Scale
from analyzer.pages.reading import Thinned


@dataclass(frozen=True, slots=True)
class Case:
    """A change with what came of it."""

    change: TuningChange
    found: LoopComparison
    description: str
    units: str
    trend: Thinned | None
    wear: tuple[str, ...] = ()
    scale: Scale = PLAIN


GRADES = {
    Grade.CLEAR: "improved clearly in all four",
    Grade.MODEST: "improved modestly",
    Grade.MIXED: "in part better, in part worse",
    Grade.WORSE: "worse",
    Grade.NONE: "no clear change",
    Grade.INCOMPARABLE: "not comparable",
}


TONES = {
    Grade.CLEAR: "better",
    Grade.MODEST: "better",
    Grade.PARTIAL: "unclear",
    Grade.NONE: "unclear",
    Grade.MIXED: "worse",
    Grade.WORSE: "worse",
    Grade.INCOMPARABLE: "incomparable",
}
"""Colours of outcomes."""


def named(changes: Sequence[Change]) -> str:
    """Names of assessments in a sentence."""
    names = [c.measure.short_title.lower() for c in changes]
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]


def outcome(found: LoopComparison) -> str:
    """A loop's outcome in one phrase."""
    kind = grade(found)
    if kind is Grade.PARTIAL:
        text = f"improved only in {named([c for c in found.primary if c.verdict is Verdict.BETTER])}"
    elif kind is Grade.INCOMPARABLE:
        text = "not comparable: " + ("; ".join(found.reasons) or "no hourly figures on both sides")
    else:
        text = GRADES[kind]
    if found.source_loop:
        text += f"; the cause lies in the neighbour {found.source_loop}, whose oscillation it follows"
    return text
