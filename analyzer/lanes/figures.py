"""A row's lanes, and the column that each is ranked by; apart from the rules, so that a list imports no analysis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analyzer.loop.decisions import Lane

FIGURE: Mapping[Lane, str] = {
    Lane.OSCILLATION: "oscillation_significance",
    Lane.MANUAL: "manual_pct",
    Lane.AT_LIMIT: "at_limits_pct",
    Lane.LASTING_ERROR: "lasting_error_pct",
    Lane.FROZEN: "frozen_pct",
    Lane.SLUGGISH: "error_memory_ti",
    Lane.TRAVEL: "valve_travel_pct_per_h",
}
"""The column that each lane is ranked by, the largest first."""


def lanes_in(row: Mapping[str, Any]) -> tuple[str, ...]:
    """The lanes of a row, as its column `lanes` states them."""
    return tuple(name for name in (row["lanes"] or "").split(", ") if name)
