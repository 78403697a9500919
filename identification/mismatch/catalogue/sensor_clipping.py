"""A transmitter whose range ends before the process does."""

from __future__ import annotations

import numpy as np

from identification.mismatch import recording_faults
from identification.mismatch.curves.drawn import Shape
from identification.mismatch.curves.recorder import clip
from identification.mismatch.effect import Block, Fault, exact
from identification.mismatch.recording import Finding, Recording
from identification.models import Estimate
from identification.record import Floats


def find(s: Recording) -> Finding | None:
    """PV standing at exactly its highest or lowest value far more often than at those next to it."""
    return recording_faults.clipped(s.pv, s.limits.recorder)


def numbers(found: Finding, s: Recording) -> dict[str, Estimate]:
    """The end of the range [% PV], known to a step of the recording."""
    step = float(np.median(np.diff(np.unique(s.pv))))
    return {"clip_pct": exact(found.values["clip_pct"], "% PV", step)}


def drawn(found: Finding, s: Recording, free: Floats) -> Shape:
    """The longest stand at the end, with the model that goes on."""
    return clip(found.name, s.pv, found.values["clip_pct"], s.dt_s, found.where, free)


EFFECT = Fault(
    name="sensor-clipping",
    block=Block.SENSOR,
    sentence="PV stops at {clip_pct} while OP goes on: the transmitter's range ends there.",
    check="Widen the transmitter's range, or keep SP inside it.",
    caption="PV stands at the end of its range while the model goes on beyond it.",
    order=3,
    find=find,
    censors=True,
    numbers=numbers,
    drawn=drawn,
    titles={"clip_pct": "Range ends at"},
)
