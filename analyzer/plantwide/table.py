"""Waves as a table of the pieces of a night, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from analyzer.plantwide.wave import Wave

SCALARS = (
    *("loop", "period_s", "harmonic", "own", "start_s", "duration_s", "first"),
    *("prominence", "share", "nonlinearity", "step_s", "trend_first"),
)


def waves_table(waves: Sequence[Wave]) -> pa.Table:
    """A row a wave."""
    columns = {name: [getattr(w, name) for w in waves] for name in SCALARS}
    real = [w.lines.real.astype(np.float32) for w in waves]
    imag = [w.lines.imag.astype(np.float32) for w in waves]
    trend = [w.trend.astype(np.float32) for w in waves]
    return pa.table({**columns, "real": real, "imag": imag, "trend": trend})


def waves_in(table: pa.Table | None) -> list[Wave]:
    """The waves of a table, none without one."""
    if table is None or not table.num_rows:
        return []
    known = table.select(SCALARS).to_pylist()
    real, imag, trend = (_stretches(table.column(name)) for name in ("real", "imag", "trend"))
    return [Wave(**s, lines=x + 1j * y, trend=t) for s, x, y, t in zip(known, real, imag, trend, strict=True)]


def _stretches(column: pa.ChunkedArray) -> list[np.ndarray]:
    """The lists of a column as arrays, without a Python object for each number."""
    out = []
    for chunk in column.chunks:
        flat = chunk.flatten().to_numpy(zero_copy_only=False)
        ends = np.cumsum(chunk.value_lengths().to_numpy(zero_copy_only=False))
        out += np.split(flat, ends[:-1]) if ends.size else []
    return out
