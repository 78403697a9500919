"""Thinned trends as blocks of a page."""

from __future__ import annotations

from collections.abc import Sequence

from analyzer.pages.reading import Thinned
from reports.pages import Band, Mark, Sparkline, Trend

SPARK_BUCKETS = 60
"""Buckets of a sparkline: two pixels each."""
CAPTION = (
    "Least and greatest of each bucket of {step}; percent of span, UTC. Wheel or drag zooms, shift-drag or "
    "arrows move, double click shows all."
)


def trend_block(name: str, title: str, thin: Thinned, marks: Sequence[Mark] = ()) -> Trend:
    """SP, PV over OP on linked axes."""
    bands = tuple(
        Band(s.upper(), s, int(s == "op"), thin.extremes[f"{s}_min"], thin.extremes[f"{s}_max"])
        for s in ("pv", "sp", "op")
    )
    step = (thin.time_s[-1] - thin.time_s[0]) / max(thin.time_s.size - 1, 1)
    panels = ("SP, PV [% of span]", "OP [%]")
    caption = CAPTION.format(step=f"{step:.3g} s")
    return Trend(name, title, thin.time_s, thin.gap, bands, panels, tuple(marks), caption)


def sparkline(thin: Thinned) -> Sparkline:
    """The PV as a cell's picture; gaps are closed."""
    known = thin.between(float("-inf"), float("inf")).coarser(SPARK_BUCKETS)
    shown = ~known.gap
    return Sparkline(known.extremes["pv_min"][shown], known.extremes["pv_max"][shown])
