"""Columns of the store's tables; the ranking's are a contract."""

from __future__ import annotations

RANK_COLUMNS = (
    "loop",
    "type",
    "status",
    "oscillation_significance",
    "oscillating_pct",
    "osc_valve_pct",
    "osc_tuning_pct",
    "osc_load_pct",
    "cause",
    "valve_fault",
    "source_loop",
    "period_s",
    "pv_amplitude_pct",
    "average_absolute_error_pct",
    "valve_travel_pct_per_h",
    "variability_pct",
    "gain",
    "time_constant_s",
    "slope_pct_per_s",
    "dead_time_s",
    "backlash_pct",
    "stickband_pct",
    "slip_jump_pct",
    "kp",
    "ti",
    "kp_new",
    "ti_new",
    "action",
    "reason",
)
"""The ranking's columns in their order; contract."""
TEXT_COLUMNS = frozenset(
    ("loop", "type", "status", "cause", "valve_fault", "source_loop", "action", "reason")
    + ("night", "area", "description", "pv_unit", "signs", "periods", "notes", "form", "gain_unit", "ti_unit")
)
"""Columns that hold text; all others hold numbers."""
OTHER_COLUMNS = (
    "night",
    "area",
    "description",
    "pv_unit",
    "importance",
    "start_s",
    "duration_s",
    "usable_h",
    "regularity",
    "prominence",
    "correlation",
    "evidence",
    "valve_size",
    "amplification",
    "harris_index",
    "settling_time_s",
    "reversals_per_h",
    "pv_variability_pct",
    "crossings_per_h",
    "noise_band_pct",
    "normal_pct",
    "at_limits_pct",
    "service_pct",
    "sp_mean_pct",
    "pv_mean_pct",
    "op_mean_pct",
    "sp_travel_pct",
    "form",
    "gain_unit",
    "ti_unit",
    "periods",
    "signs",
    "notes",
)
ALL_COLUMNS = RANK_COLUMNS + OTHER_COLUMNS
