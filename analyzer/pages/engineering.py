"""Percent of span in the plant's own unit, where the night says what percent means."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from analyzer.pages.words import number
from reports.pages import Floats

PERCENT = "% of span"


@dataclass(frozen=True, slots=True)
class Scale:
    """What percent of span means for a loop: PV at 0 %, the span, and the unit; '' for one that is not stated."""

    low: float
    span: float
    unit: str

    @property
    def label(self) -> str:
        """The unit on an axis."""
        return self.unit or "own unit"

    def of(self, percent: Floats) -> Floats:
        """PV or SP in its own unit."""
        return self.low + percent * (self.span / 100.0)


PLAIN = Scale(0.0, 100.0, PERCENT)
"""Percent as it is, where the night does not say what it means."""


def scale_of(row: Mapping[str, Any]) -> Scale:
    """What percent means in a row of the night."""
    low, high = row.get("pv_lo"), row.get("pv_hi")
    if low is None or high is None or not high > low:
        return PLAIN
    return Scale(low, high - low, row["pv_unit"] or "")


def beside(name_unit: str, value: float | None, scale: Scale) -> str:
    """A figure in % of span in the loop's own unit too, in brackets; '' where that says nothing new."""
    if value is None or name_unit != PERCENT or not scale.unit or scale is PLAIN:
        return ""
    if scale.unit == "%" and scale.span == 100.0:
        return ""
    return f" ({number(value * scale.span / 100.0)} {scale.unit})"
