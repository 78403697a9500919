"""What a column of results is."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """What a column's cells hold; an empty cell is what is not known."""

    TEXT = "text"
    NUMBER = "number"
    JSON = "JSON as text"


class Source(StrEnum):
    """What a column comes from."""

    LOOPS = "loops.csv"
    EXPORT = "export"
    RUN = "run"
    OSCILLATION = "oscillation"
    FIGURES = "assessments"
    CAUSE = "cause"
    MODEL = "model of the cause"
    PLANT = "plant-wide pass"
    ADVICE = "advice"
    EXPLAIN = "explain"
    NOTES = "triage note"


@dataclass(frozen=True, slots=True)
class Column:
    """One column of results.

    name : as in store, CSV and JSON; kind : what its cells hold; title, unit : for people, unit '' for none; source :
    what it comes from; meaning : one sentence; short : heading where there is little room, '' for the title itself;
    hourly : whether the table of hours has it too.
    """

    name: str
    kind: Kind
    title: str
    unit: str
    source: Source
    meaning: str
    short: str = ""
    hourly: bool = False

    @property
    def heading(self) -> str:
        """The heading of a narrow table."""
        return self.short or self.title

    @property
    def is_number(self) -> bool:
        """Whether its cells hold numbers."""
        return self.kind is Kind.NUMBER

    @property
    def hint(self) -> str:
        """What the column is, for who points at its heading."""
        unit = f" [{self.unit}]" if self.unit else ""
        return f"{self.title}{unit}: {self.meaning}"
