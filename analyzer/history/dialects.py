"""The layouts that are known, tried in this order.

A further dialect is one file with one function of the same signature: it answers None for a table that is not
its own. The last entry takes every table and says what is missing, so others stand before it.
"""

from __future__ import annotations

from collections.abc import Callable

from analyzer.history.long import open_long
from analyzer.history.options import ReadOptions
from analyzer.history.pairs import open_pairs
from analyzer.history.table import Source, Table
from analyzer.history.wide import open_wide

Dialect = Callable[[Table, ReadOptions], Source | None]

DIALECTS: tuple[Dialect, ...] = (open_long, open_pairs, open_wide)


def source_of(table: Table, options: ReadOptions) -> Source:
    """The table, understood by the first dialect that knows it; InputError where none does."""
    sources = (dialect(table, options) for dialect in DIALECTS)
    return next(source for source in sources if source is not None)
