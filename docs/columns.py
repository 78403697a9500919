"""The page of all columns of the results: python docs/columns.py > docs/columns.md"""

from collections.abc import Sequence

from analyzer.columns import TABLES, Column, Kind

HEAD = """# Columns of the results

Every column is declared once, in `analyzer/columns.toml`; rows, the store's types, lists and pages come from
there, and so does this page (`python docs/columns.py > docs/columns.md`).

Numbers are 64-bit floats; an empty cell is an unknown value. Percent of span is of PV's range, percent of OP of
OP's. Columns marked h are also in the table of hours.
"""
PARTS = {
    "ranking": "The ranking: `triage rank`, names and order a contract",
    "listed": "Further columns of `triage rank --format csv` and `json`",
    "noted": "Notes, last in `triage rank --format csv` and `json`",
    "stored": "Further columns of the store: `nights/*.parquet`, a row per loop",
    "hour": "Only for hours: `hours/*.parquet`, a row per loop and hour",
    "group": "Groups that share an oscillation: `groups/*.parquet`, a row per loop and group",
    "group_list": "Groups as listed: `triage rank --groups --format csv` and `json`, a row a group",
    "compared": "Settings compared: `compared/*.parquet`, a row per loop with a comparison, newest night",
    "believed": "Beliefs: `beliefs/*.parquet`, a row per loop and night, with the ranking by all nights",
    "explanation": "Explanations: `explained/*.parquet`, a row per loop that was explained",
}
TITLES = ("column", "holds", "title", "unit", "from", "h", "meaning")


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _part(title: str, columns: Sequence[Column]) -> str:
    holds = {kind: "JSON as text" if kind is Kind.JSON else kind for kind in Kind}
    lines = [
        _line((f"`{c.name}`", holds[c.kind], c.title, c.unit, c.source, "h" if c.hourly else "", c.meaning))
        for c in columns
    ]
    return "\n".join([f"## {title}", "", _line(TITLES), _line(["---"] * len(TITLES)), *lines])


def columns_document() -> str:
    """All columns as a page in Markdown."""
    return "\n".join([HEAD, *(_part(title, TABLES[table]) + "\n" for table, title in PARTS.items())])


if __name__ == "__main__":
    print(columns_document(), end="")
