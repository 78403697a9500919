"""The column that each lane is ranked by; apart from the rules, so that a list imports no analysis."""

from __future__ import annotations

from collections.abc import Mapping

from analyzer.decisions import Lane

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
