"""Thinned trends as blocks of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.pages.engineering import PLAIN, Scale
from analyzer.pages.reading import Thinned
from reports.pages import Band, Mark, Sparkline, Trend

SPARK_BUCKETS = 100
"""Buckets of a sparkline: a pixel and a fifth each."""
CAPTION = (
    "Least and greatest of each bucket of {step}. Drag, or the wheel with Ctrl, zooms; shift-drag or arrows move; "
    "two fingers do both; double click shows all."
)
LEAST_PCT = 2.0
"""Height of an axis at least [% of span]; ours: less would show noise as if it were a swing."""


def close_span(row: Mapping[str, Any], thin: Thinned) -> tuple[float, float] | None:
    """First and last time [s] of the ten periods that a page opens on; None where the night names none."""
    first, last = row.get("close_first_s"), row.get("close_last_s")
    if first is None or last is None or thin.between(first, last).time_s.size < 3:
        return None
    return first, last


def trend_block(
    name: str,
    title: str,
    thin: Thinned,
    marks: Sequence[Mark] = (),
    scale: Scale = PLAIN,
    opening: tuple[float, float] | None = None,
) -> Trend:
    """SP, PV over OP on linked axes, in the loop's own unit, opened on a span of time where one is named."""
    bands = tuple(
        Band(
            s.upper(),
            s,
            int(s == "op"),
            *(
                x if s == "op" else scale.of(x)
                for x in (thin.extremes[f"{s}_{end}"] for end in ("min", "max"))
            ),
        )
        for s in ("pv", "sp", "op")
    )
    step = (thin.time_s[-1] - thin.time_s[0]) / max(thin.time_s.size - 1, 1)
    panels = (f"SP, PV [{scale.label}]", "OP [%]")
    caption = CAPTION.format(step=f"{step:.3g} s")
    least = (LEAST_PCT * scale.span / 100.0, LEAST_PCT)
    return Trend(
        name, title, thin.time_s, thin.gap, bands, panels, tuple(marks), caption, opening=opening, least=least
    )


def sparkline(thin: Thinned, span: tuple[float, float] | None = None) -> Sparkline:
    """The PV as a cell's picture, of a span of time where one is named; gaps are closed."""
    first, last = span or (float("-inf"), float("inf"))
    known = thin.between(first, last).coarser(SPARK_BUCKETS)
    shown = ~known.gap
    return Sparkline(known.extremes["pv_min"][shown], known.extremes["pv_max"][shown])
