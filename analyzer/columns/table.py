"""The tables of results as tuples of columns, and rows made by them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.columns.column import Column
from analyzer.columns.other_tables import COMPARED, EXPLANATION, GROUP, HOUR
from analyzer.columns.ranking import LISTED, RANKING
from analyzer.columns.stored import STORED

NIGHTS = (*RANKING, *LISTED, *STORED)
"""Of the table of nights: a row a loop."""
BY_NAME: Mapping[str, Column] = {c.name: c for c in NIGHTS}
HOURS = (BY_NAME["loop"], BY_NAME["night"], HOUR, *(c for c in NIGHTS if c.hourly))
"""Of the table of hours: a row a loop and hour."""
EXPLAINED = (BY_NAME["loop"], BY_NAME["night"], *EXPLANATION)
"""Of the table of explanations: a row a loop that was explained."""
SETTINGS = (BY_NAME["loop"], BY_NAME["night"], *COMPARED)
"""Of the table of settings compared: a row a loop."""
GROUPS = (BY_NAME["loop"], BY_NAME["night"], *GROUP)
"""Of the table of groups: a row a loop and group."""


def names(columns: Sequence[Column]) -> tuple[str, ...]:
    """The names of columns in their order."""
    return tuple(c.name for c in columns)


def require_declared(row: Mapping[str, Any], columns: Sequence[Column]) -> None:
    """Raise ValueError for a cell of a row whose column is declared nowhere."""
    unknown = sorted(row.keys() - {c.name for c in columns})
    if unknown:
        raise ValueError(f"no such column: {', '.join(unknown)}; declare it in analyzer/columns")


def row_of(values: Mapping[str, Any], columns: Sequence[Column] = NIGHTS) -> dict[str, Any]:
    """A row with every column of a table, None where nothing is known.

    Raises
    ------
    ValueError
        For a value whose column is declared nowhere.
    """
    require_declared(values, columns)
    return {c.name: values.get(c.name) for c in columns}
