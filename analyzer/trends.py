"""Trends thinned for the pages: least and greatest of each bucket, so that no spike is lost."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from identification.record import Floats, LoopRecord

BUCKETS = 1200
"""Buckets a day: 72 s each, about a pixel of a screen's width."""
FINE_BUCKETS = 6000
"""Buckets a day of a loop that oscillates, so that its cycle can be zoomed into."""


def _extremes(x: Floats, edges: np.ndarray) -> tuple[Floats, Floats]:
    return np.minimum.reduceat(x, edges), np.maximum.reduceat(x, edges)


def thinned(record: LoopRecord, a_day: int = BUCKETS) -> Mapping[str, np.ndarray]:
    """Columns time_s and, for SP, PV and OP, least and greatest of each bucket [% of span], shape (b,).

    Buckets are the record's own samples where there are fewer of these.
    """
    n = len(record)
    buckets = min(n, max(round(a_day * record.duration_s / 86400.0), 400))
    edges = (np.arange(buckets) * n) // buckets
    out: dict[str, np.ndarray] = {"time_s": record.start_s + edges * record.dt_s}
    for name in ("sp", "pv", "op"):
        low, high = _extremes(getattr(record, name), edges)
        out[f"{name}_min"], out[f"{name}_max"] = low.astype(np.float32), high.astype(np.float32)
    out["bad"] = np.logical_and.reduceat(record.bad, edges)
    return out
