"""Words of the explanation's page: names of parameters and features, headings, figures with their units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from analyzer.pages.words import duration, number
from identification.mismatch.words import ALONG, CHECKS, place

PARAMETERS = {
    "backlash_pct": "Play, full width",
    "stickband_pct": "Stickband",
    "slip_jump_pct": "Slip jump",
    "rate_pct_per_s": "Fastest stem",
    "limit_pct": "Upper limit",
    "low_limit_pct": "Lower limit",
    "curve": "Curve",
    "positioner_lag_s": "Positioner lag",
    "damping": "Positioner damping",
    "deadband_pct": "Dead band",
    "split_pct": "Split point",
    "gain_ratio": "Gain above over below",
    "dead_zone_pct": "Dead zone",
    "second_valve_lag_s": "Lag of the second valve",
    "second_lag_s": "Second lag",
    "slow_share": "Slow share",
    "slow_time_constant_s": "Slow time constant",
    "opposing_share": "Opposing share",
    "opposing_time_constant_s": "Opposing time constant",
    "ratio_down_up": "Time constant down over up",
    "gain_slope": "Gain slope",
    "root": "Root",
    "cap_pct": "Overflow at",
    "flow_share": "Share of delay in flow",
    "gain_drift": "Gain drift",
    "step_pct": "Step of values",
    "clip_pct": "Range ends at",
    "straight_share": "Samples on straight lines",
    "shift_s": "PV late by",
    "jitter_samples": "Scatter of stamps",
    "kp": "Kp",
    "ti_s": "Ti",
    "gap_pct": "Gap",
    "share_pct": "Time outside the law",
    "size_1_pct": "First load step",
    "size_2_pct": "Second load step",
    "size_3_pct": "Third load step",
    "period_s": "Period",
    "amplitude_pct": "Amplitude",
    "coupling_gain": "Coupling gain",
    "coupling_lag_s": "Coupling lag",
    "flow_at_rest_pct": "Flow at rest",
}
"""Parameters as they are called on a page; others by their own name."""
HIDDEN = (
    "log_ratio_down_up",
    "sine_pct",
    "cosine_pct",
    "angular_frequency",
    *(f"head_{i}" for i in range(1, 13)),
)
"""Parameters whose meaning another one carries."""
MOVED = {
    "gain": ("Gain", "% PV/% OP"),
    "time_constant_s": ("Time constant", "s"),
    "dead_time_s": ("Dead time", "s"),
}
FEATURES = {
    "pv_level": "PV level",
    "op_level": "OP level",
    "op_direction": "Direction of OP",
    "op_rate": "Rate of OP",
    "after_reversals": "Time since OP turned",
    "time_in_record": "Time in the recording",
    "at_limits": "OP at a limit",
}
AXES = {
    "pv_level": "PV [%]",
    "op_level": "OP [%]",
    "op_direction": "down, still, up",
    "op_rate": "size of OP's rate [%/s]",
    "after_reversals": "time since OP turned [s]",
    "time_in_record": "time [s]",
    "at_limits": "no, yes",
}
TITLES = {"none": "the plain loop explains it", "unexplained": "no name for what is left"}
BROUGHT = "your model"
ROWS = {"baseline": "plain loop", "explained": "improved loop", "brought": BROUGHT}
CURVES = {
    "found": "found",
    "plain": "plain loop",
    "least": "interval",
    "most": "interval",
    "stated": "by the stated settings",
    "recorded": "recorded",
    "points": "samples on straight lines",
    "limit": "end of the range",
}
KINDS = {
    "found": "model",
    "plain": "baseline",
    "least": "edge",
    "most": "edge",
    "stated": "baseline",
    "limit": "sp",
}
SHAPES = {
    "loop": "Stem over OP for a slow sweep up and down; dotted: the ends of the interval.",
    "curve": "The curve found, with its interval, against the plain loop's.",
    "response": "After a step of OP; the band is the interval of what was added.",
    "course": "Over the recording, or the stretch where it shows most.",
}
CAPTIONS = {
    "quantization": "How often each value of PV was recorded: a coarse sensor leaves gaps between teeth.",
    "compression": "Straight segments between few stored points: what happened between them is not known.",
    "sampling": "Time between samples: a sound recorder has one narrow peak.",
    "controller-settings": "OP recorded, and OP rebuilt from SP and PV by the settings found and by those stated.",
    "controller-gap": "A plain controller moves OP at every error; under the gap it stands still.",
    "controller-logic": "OP recorded, and OP as the stated settings would have moved it from there.",
    "clock-offset": "OP recorded, and rebuilt with PV's clock set right (found) and as stamped.",
    "sensor-clipping": "PV stands at the end of its range while the model goes on beyond it.",
    "controller": "OP rebuilt from SP and PV by the stated settings lies on OP as recorded.",
}
"""What a picture shows, by effect where that says more than its kind."""


def title(verdict: str) -> str:
    """The verdict as a heading."""
    return TITLES.get(verdict, verdict.replace("-", " "))


def called(name: str) -> str:
    """A parameter's name on a page."""
    return PARAMETERS.get(name, name.replace("_", " "))


def figure(value: float | None, unit: str = "") -> str:
    """A number of three digits with its unit, a dash where it is not known."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{number(value)} {unit}".strip()


def interval(value: Mapping[str, Any]) -> str:
    """The ends of a parameter's interval, with as many digits as tell them apart; a dash where it has no width."""
    low, high = value["low"], value["high"]
    if low is None or high is None or low == high:
        return "–"
    if number(low) != number(high):
        return f"{number(low)} … {number(high)}"
    digits = next((d for d in range(4, 7) if f"{low:.{d}g}" != f"{high:.{d}g}"), 6)
    return f"{low:.{digits}g} … {high:.{digits}g}"


def change(before: float, after: float) -> str:
    """A change in whole percent."""
    if not before:
        return "–"
    pct = round(100 * (after / before - 1))
    return f"{pct:+d} %" if pct else "0 %"


def share(value: float | None) -> str:
    """A share of the held-out misfit in percent."""
    return "–" if value is None else f"{100 * value:.0f} %"


def rms(value: float) -> str:
    """A misfit."""
    return f"{value:.3g} %"


def chance(p: float) -> str:
    """A chance as engineers write it."""
    return "< 0.01" if p < 0.01 else f"{p:.2f}"


def carried_by(feature: Mapping[str, Any]) -> str:
    """Where a feature puts the misfit, and whether as bias or size; empty where it does not carry it."""
    if not feature["carries"]:
        return ""
    if feature["by"] == "sign" and feature["name"] in ALONG:
        return place(feature)
    how = "errors of one sign at" if feature["by"] == "sign" else "larger errors at"
    return f"{how} {place(feature)}"


def spans_said(spans: list[list[float]]) -> str:
    """Spans as times into the recording."""
    return ", ".join(f"{duration(a) or '0 s'} to {duration(b)}" for a, b in spans[:4]) + (
        " and more" if len(spans) > 4 else ""
    )


def check(verdict: str) -> str:
    """What to look at."""
    return CHECKS.get(verdict, CHECKS["unexplained"])
