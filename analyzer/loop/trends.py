"""Trends thinned for the pages: least and greatest of each bucket, so that no spike is lost; ten periods fine."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from analyzer.loop.oscillation import Oscillations
from identification.record import Floats, LoopRecord

BUCKETS = 1200
"""Buckets a day: 72 s each, about a pixel of a screen's width."""
FINE_BUCKETS = 6000
"""Buckets a day of a loop that oscillates, so that its cycle can be zoomed into."""
PERIODS = 10.0
"""Periods of the close view that a page opens on."""
CLOSE_BUCKETS = 600
"""Buckets of the close view at most, 60 a period; fewer where the record has fewer samples."""


def close_view(record: LoopRecord, found: Oscillations) -> tuple[int, int] | None:
    """First and last sample (excluded) of the last ten periods of the oscillation; None where there is none."""
    if found.first is None or found.active is None or not found.active.any():
        return None
    skipped = len(record) * record.dt_s - found.active.size * found.active_dt_s
    end_s = skipped + (int(np.flatnonzero(found.active)[-1]) + 1) * found.active_dt_s
    last = min(round(end_s / record.dt_s), len(record))
    first = max(last - round(PERIODS * found.first.period_s / record.dt_s), 0)
    return (first, last) if last - first > 2 else None


def _extremes(x: Floats, edges: np.ndarray) -> tuple[Floats, Floats]:
    return np.minimum.reduceat(x, edges), np.maximum.reduceat(x, edges)


def _edges(n: int, buckets: int, close: tuple[int, int] | None) -> np.ndarray:
    """First samples of the buckets, shape (b,): even, but finer within the close view."""
    even = (np.arange(buckets) * n) // buckets
    if close is None:
        return even
    first, last = close
    step = max(-(-(last - first) // CLOSE_BUCKETS), 1)
    if step >= n / buckets:
        return even
    return np.unique(
        np.concatenate((even[even < first], np.arange(first, last, step), even[even >= last], [0]))
    )


def thinned(
    record: LoopRecord, a_day: int = BUCKETS, close: tuple[int, int] | None = None
) -> Mapping[str, np.ndarray]:
    """Columns time_s and, for SP, PV and OP, least and greatest of each bucket [% of span], shape (b,).

    Buckets are the record's own samples where there are fewer of these, and finer between the samples of `close`.
    """
    n = len(record)
    buckets = min(n, max(round(a_day * record.duration_s / 86400.0), 400))
    edges = _edges(n, buckets, close)
    out: dict[str, np.ndarray] = {"time_s": record.start_s + edges * record.dt_s}
    for name in ("sp", "pv", "op"):
        low, high = _extremes(getattr(record, name), edges)
        out[f"{name}_min"], out[f"{name}_max"] = low.astype(np.float32), high.astype(np.float32)
    out["bad"] = np.logical_and.reduceat(record.bad, edges)
    return out
