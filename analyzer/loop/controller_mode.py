"""When a controller is in manual: by its mode, else by an output that stands while the error moves."""

from __future__ import annotations

import numpy as np

from analyzer.config import QualityLimits
from analyzer.history.series import Series
from analyzer.loop.sample_clock import constant_stretches
from identification.record import Floats, Mask

MANUAL_TEXTS = ("man", "iman", "lo", "manual", "hand", "local", "rout", "0", "off", "oos", "init")
"""Mode texts, lower case, that mean that the controller does not move OP."""
AUTOMATIC_TEXTS = (
    "aut",
    "auto",
    "automatic",
    "cas",
    "casc",
    "cascade",
    "rcas",
    "rsp",
    "remote",
    "spc",
    "1",
    "on",
)
"""Mode texts, lower case, that mean that it does."""


def manual_mask(
    mode: Series | None, clock: Floats, dt_s: float, op: Floats, error: Floats, q: QualityLimits
) -> Mask:
    """True where the controller is in manual: by its mode, else where OP stands still while the error moves."""
    if mode is not None:
        found = _mode_mask(mode, clock)
        if found is not None:
            return found
    still = constant_stretches(op, dt_s, q.manual_s, q.manual_samples)
    if not still.any() or float(np.std(error[still])) <= 1e-9:
        return np.zeros(op.size, dtype=bool)
    return still


def _mode_mask(mode: Series, clock: Floats) -> Mask | None:
    at = np.clip(np.searchsorted(mode.stamp_s, clock, side="right") - 1, 0, None)
    if mode.text is not None:
        texts = np.array([str(t).strip().lower() for t in mode.text], dtype=object)
        known = np.isin(texts, MANUAL_TEXTS) | np.isin(texts, AUTOMATIC_TEXTS)
        return np.isin(texts, MANUAL_TEXTS)[at] if known.any() else None
    if mode.bad.all():
        return None
    return (mode.value == 0)[at] & ~mode.bad[at]
