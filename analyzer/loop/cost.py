"""Cost of a loop, for comparing a night's loops: one figure for all of them, never two kinds mixed."""

from __future__ import annotations

from collections.abc import Sequence

from analyzer.columns import Row

LOSS = "loss"
SIGNIFICANCE = "oscillation_significance"
STATED, RECORDED = "stated", "recorded"
"""Basis of a loop's percent of PV: the range in loops.csv, or the recorded range."""
OF_RANGE = frozenset(
    (SIGNIFICANCE, "average_absolute_error_pct", "variability_pct", "lasting_error_pct", "pv_amplitude_pct")
)
"""Columns in percent of that range, or based on it, comparable between loops only if it is stated."""
MARK = "*"
OF_RECORDED = "percent of the recorded range, loops.csv states none: not comparable with other loops"
"""Meaning of the mark."""


def compares(row: Row, column: str) -> bool:
    """Whether a figure is known and comparable with those of loops with a stated range."""
    return row[column] not in (None, "") and not (column in OF_RANGE and row.get("percent_of") == RECORDED)


def mark(row: Row, column: str) -> str:
    """Mark of a figure that is not comparable with other loops; '' for others."""
    return "" if not row[column] or compares(row, column) else MARK


def loss(error_pct: float | None, importance: float | None, stated: bool) -> float | None:
    """Average absolute error [% of span] times importance, 1 if none is stated; None without an error, or if no span
    is `stated`: percent of the recorded range is not comparable with other loops."""
    if error_pct is None or not stated:
        return None
    return error_pct * (1.0 if importance is None else importance)


def cost_column(rows: Sequence[Row]) -> str:
    """The column that compares these loops: loss if loops.csv states any importance, else significance."""
    return LOSS if any(r["importance"] is not None for r in rows) else SIGNIFICANCE


def cost(row: Row, column: str) -> float:
    """Cost of a loop by that column; zero if unknown."""
    return float(row[column] or 0.0)
