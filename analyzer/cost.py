"""What a loop costs, by which a night's loops are compared: one figure for all of them, never two kinds mixed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Row = Mapping[str, Any]
LOSS = "loss"
SIGNIFICANCE = "oscillation_significance"


def loss(error_pct: float | None, importance: float | None) -> float | None:
    """Average absolute error [% of span] times importance, 1 where none is stated; None without an error."""
    if error_pct is None:
        return None
    return error_pct * (1.0 if importance is None else importance)


def cost_column(rows: Sequence[Row]) -> str:
    """The column that compares these loops: loss where loops.csv states any importance, else significance."""
    return LOSS if any(r["importance"] is not None for r in rows) else SIGNIFICANCE


def cost(row: Row, column: str) -> float:
    """What a loop costs by that column; nothing where that is not known."""
    return float(row[column] or 0.0)
