"""The columns of the results: declared once in columns.toml; rows, the store's types, lists and pages use them.

`python docs/columns.py > docs/columns.md` prints them as a page of the documentation.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from operator import attrgetter
from typing import Any

NAME = attrgetter("name")
Row = Mapping[str, Any]
"""A row of a table of results: its cells by column."""


class Kind(StrEnum):
    """Contents of a column's cells; an empty cell means unknown."""

    TEXT = "text"
    NUMBER = "number"
    JSON = "JSON"


@dataclass(frozen=True, slots=True)
class Column:
    """One column of results.

    name : as in store, CSV and JSON; kind : contents of its cells; title, unit : for people, unit '' for none; source
    : its origin; meaning : one sentence; short : heading if there is little space, '' for the title itself; hourly :
    whether the table of hours has it too.
    """

    name: str
    kind: Kind
    title: str
    unit: str
    source: str
    meaning: str
    short: str = ""
    hourly: bool = False

    @property
    def heading(self) -> str:
        """The heading of a narrow table."""
        return self.short or self.title

    @property
    def is_number(self) -> bool:
        """Whether its cells are numbers."""
        return self.kind is Kind.NUMBER

    @property
    def hint(self) -> str:
        """Tooltip of the column's heading."""
        unit = f" [{self.unit}]" if self.unit else ""
        return f"{self.title}{unit}: {self.meaning}"


Table = tuple[Column, ...]


def _declared() -> dict[str, Table]:
    stated = tomllib.loads((files("analyzer") / "columns.toml").read_text("utf-8"))
    return {
        table: tuple(Column(**{"unit": "", **c, "kind": Kind(c["kind"])}) for c in columns)
        for table, columns in stated.items()
    }


TABLES = _declared()
"""All declared columns, by the name of their table."""
RANKING = TABLES["ranking"]
"""The contract's columns in its order."""
LISTED = TABLES["listed"]
"""Further columns in CSV and JSON: facts of the plant, the units of settings, the full advice."""
NOTED = TABLES["noted"]
"""Columns from `triage note`, joined when a night is listed."""
GROUP_LIST = TABLES["group_list"]
"""Columns of a group in `triage rank --groups`."""
NIGHTS = (*RANKING, *LISTED, *TABLES["stored"])
"""Columns of the table of nights: one row per loop."""
BELIEVED = TABLES["believed"]
"""Columns only in a belief."""
BY_NAME: Mapping[str, Column] = {c.name: c for c in (*NIGHTS, *BELIEVED)}
"""Possible columns of a loop's row, including those of beliefs."""
_KEYS = (BY_NAME["loop"], BY_NAME["night"])
HOURS = (*_KEYS, *TABLES["hour"], *(c for c in NIGHTS if c.hourly))
"""Columns of the table of hours: one row per loop and hour."""
EXPLAINED = (*_KEYS, *TABLES["explanation"])
"""Columns of the table of explanations: one row per explained loop."""
SETTINGS = (*_KEYS, *TABLES["compared"])
"""Columns of the table of compared settings: one row per loop."""
GROUPS = (*_KEYS, *TABLES["group"])
"""Columns of the table of groups: one row per loop and group."""
REPLACED_BY_BELIEF = tuple(
    BY_NAME[name]
    for name in (
        *("osc_valve_pct", "osc_tuning_pct", "osc_load_pct", "cause", "valve_fault", "source_loop"),
        *("backlash_pct", "stickband_pct", "slip_jump_pct", "action", "due", "kp_new", "ti_new"),
        *("advice", "expected_period_s", "expected_pv_amplitude_pct", "reason", "lanes"),
    )
)
"""Columns of a night's row based on all nights: a belief replaces them."""
BELIEFS = (*_KEYS, *REPLACED_BY_BELIEF, *BELIEVED)
"""Columns of the table of beliefs: one row per loop and night."""


def names(columns: Sequence[Column]) -> tuple[str, ...]:
    """The names of columns in their order."""
    return tuple(c.name for c in columns)


def row_of(values: Mapping[str, Any], columns: Sequence[Column] = NIGHTS) -> dict[str, Any]:
    """A row with every column of a table, None if unknown. Raises ValueError for a value of an undeclared column."""
    empty: dict[str, Any] = dict.fromkeys(map(NAME, columns))
    unknown = sorted(values.keys() - empty.keys())
    if unknown:
        raise ValueError(f"no such column: {', '.join(unknown)}; declare it in analyzer/columns.toml")
    return {**empty, **values}
