"""The columns as a page of the documentation."""

from __future__ import annotations

from collections.abc import Sequence

from analyzer.columns.column import Column
from analyzer.columns.other_tables import COMPARED, EXPLANATION, GROUP, GROUP_LIST, HOUR, NOTED
from analyzer.columns.ranking import LISTED, RANKING
from analyzer.columns.stored import STORED

HEAD = """# Columns of the results

Every column is declared once, in `analyzer/columns`; rows, the store's types, lists and pages come from there, and so
does this page (`python -m analyzer.columns > docs/columns.md`).

Numbers are 64-bit floats; an empty cell is what is not known. Percent of span is of PV's range, percent of OP of
OP's. Columns marked h stand in the table of hours too.
"""
PARTS: tuple[tuple[str, Sequence[Column]], ...] = (
    ("The ranking: `triage rank`, names and order a contract", RANKING),
    ("Further columns of `triage rank --format csv` and `json`", LISTED),
    ("Notes, last in `triage rank --format csv` and `json`", NOTED),
    ("Further columns of the store: `nights/*.parquet`, a row a loop", STORED),
    ("Of the hours alone: `hours/*.parquet`, a row a loop and hour", (HOUR,)),
    ("Groups that share an oscillation: `groups/*.parquet`, a row a loop and group", GROUP),
    ("Groups as listed: `triage rank --groups --format csv` and `json`, a row a group", GROUP_LIST),
    (
        "Settings compared: `compared/*.parquet`, a row a loop for which they were sought, newest night",
        COMPARED,
    ),
    ("Explanations: `explained/*.parquet`, a row a loop that was explained", EXPLANATION),
)
TITLES = ("column", "holds", "title", "unit", "from", "h", "meaning")


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _part(title: str, columns: Sequence[Column]) -> str:
    lines = [
        _line((f"`{c.name}`", c.kind, c.title, c.unit, c.source, "h" if c.hourly else "", c.meaning))
        for c in columns
    ]
    return "\n".join([f"## {title}", "", _line(TITLES), _line(["---"] * len(TITLES)), *lines])


def document() -> str:
    """The page in Markdown."""
    return "\n".join([HEAD, *(_part(title, columns) + "\n" for title, columns in PARTS)])
