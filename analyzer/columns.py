"""The columns of the results: declared once in columns.toml; rows, the store's types, lists and pages come from here.

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
    """What a column's cells hold; an empty cell is what is not known."""

    TEXT = "text"
    NUMBER = "number"
    JSON = "JSON"


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
        """Whether its cells hold numbers."""
        return self.kind is Kind.NUMBER

    @property
    def hint(self) -> str:
        """What the column is, for who points at its heading."""
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
"""All that are declared, by the name of what they are of."""
RANKING = TABLES["ranking"]
"""The contract's columns in its order."""
LISTED = TABLES["listed"]
"""Columns that follow in CSV and JSON: facts of the plant, the units that settings stand in, the advice in full."""
NOTED = TABLES["noted"]
"""What `triage note` keeps, joined when a night is listed."""
GROUP_LIST = TABLES["group_list"]
"""Of a group, as `triage rank --groups` lists it."""
NIGHTS = (*RANKING, *LISTED, *TABLES["stored"])
"""Of the table of nights: a row a loop."""
BELIEVED = TABLES["believed"]
"""Of a belief alone."""
BY_NAME: Mapping[str, Column] = {c.name: c for c in (*NIGHTS, *BELIEVED)}
"""What a loop's row may hold, with what beliefs add to it."""
_KEYS = (BY_NAME["loop"], BY_NAME["night"])
HOURS = (*_KEYS, *TABLES["hour"], *(c for c in NIGHTS if c.hourly))
"""Of the table of hours: a row a loop and hour."""
EXPLAINED = (*_KEYS, *TABLES["explanation"])
"""Of the table of explanations: a row a loop that was explained."""
SETTINGS = (*_KEYS, *TABLES["compared"])
"""Of the table of settings compared: a row a loop."""
GROUPS = (*_KEYS, *TABLES["group"])
"""Of the table of groups: a row a loop and group."""
RESTING = tuple(
    BY_NAME[name]
    for name in (
        *("osc_valve_pct", "osc_tuning_pct", "osc_load_pct", "cause", "valve_fault", "source_loop"),
        *("backlash_pct", "stickband_pct", "slip_jump_pct", "action", "due", "kp_new", "ti_new"),
        *("advice", "expected_period_s", "expected_pv_amplitude_pct", "reason", "lanes"),
    )
)
"""Columns of a night's row that rest on all nights: a belief states them anew."""
BELIEFS = (*_KEYS, *RESTING, *BELIEVED)
"""Of the table of beliefs: a row a loop and night."""


def names(columns: Sequence[Column]) -> tuple[str, ...]:
    """The names of columns in their order."""
    return tuple(c.name for c in columns)


def row_of(values: Mapping[str, Any], columns: Sequence[Column] = NIGHTS) -> dict[str, Any]:
    """A row with every column of a table, None where nothing is known. Raises ValueError for a value whose column is
    declared nowhere."""
    empty: dict[str, Any] = dict.fromkeys(map(NAME, columns))
    unknown = sorted(values.keys() - empty.keys())
    if unknown:
        raise ValueError(f"no such column: {', '.join(unknown)}; declare it in analyzer/columns.toml")
    return {**empty, **values}
