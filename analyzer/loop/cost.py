"""What a loop costs, by which a night's loops are compared: one figure for all of them, never two kinds mixed."""

from __future__ import annotations

from collections.abc import Sequence

from analyzer.columns import Row

LOSS = "loss"
SIGNIFICANCE = "oscillation_significance"
STATED, RECORDED = "stated", "recorded"
"""What percent of a loop's PV means: of the range in loops.csv, or of that which was recorded."""
OF_RANGE = frozenset(
    (SIGNIFICANCE, "average_absolute_error_pct", "variability_pct", "lasting_error_pct", "pv_amplitude_pct")
)
"""Columns in percent of that range, or that count it, which compare between loops only where it is stated."""
MARK = "*"
OF_RECORDED = "percent of the recorded range, loops.csv states none: not comparable with other loops"
"""What the mark means."""


def compares(row: Row, column: str) -> bool:
    """Whether a figure is known and compares with those of loops whose range is stated."""
    return row[column] not in (None, "") and not (column in OF_RANGE and row.get("percent_of") == RECORDED)


def mark(row: Row, column: str) -> str:
    """What stands behind a figure that compares with no other loop's; '' behind others."""
    return "" if not row[column] or compares(row, column) else MARK


def loss(error_pct: float | None, importance: float | None, stated: bool) -> float | None:
    """Average absolute error [% of span] times importance, 1 where none is stated; None without an error, or where
    no span is `stated`: percent of what was recorded compares with no other loop."""
    if error_pct is None or not stated:
        return None
    return error_pct * (1.0 if importance is None else importance)


def cost_column(rows: Sequence[Row]) -> str:
    """The column that compares these loops: loss where loops.csv states any importance, else significance."""
    return LOSS if any(r["importance"] is not None for r in rows) else SIGNIFICANCE


def cost(row: Row, column: str) -> float:
    """What a loop costs by that column; nothing where that is not known."""
    return float(row[column] or 0.0)
