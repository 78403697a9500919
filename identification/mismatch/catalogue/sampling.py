"""Polling that scatters: values stand at other times than their stamps say."""

from __future__ import annotations

from identification.mismatch import recording_faults
from identification.mismatch.curves.drawn import Shape
from identification.mismatch.curves.recorder import spacings
from identification.mismatch.effect import Block, Ends, Fault, exact
from identification.mismatch.recording import Finding, Recording
from identification.models import Estimate
from identification.record import Floats

SURE = 0.1
"""Half width of the interval, in the scatter found; ours."""


def find(s: Recording) -> Finding | None:
    """Stamps that scatter by more than logging does."""
    return recording_faults.sampling(s.stamp_s, s.dt_s, s.limits.recorder)


def numbers(found: Finding, _: Recording) -> dict[str, Estimate]:
    """Scatter of the stamps [samples]."""
    value = found.values["jitter_samples"]
    return {"jitter_samples": exact(value, "samples", SURE * value)}


def drawn(found: Finding, s: Recording, _: Floats) -> Shape:
    """How often each spacing of two stamps occurs."""
    return spacings(found.name, s.stamp_s, s.dt_s)


EFFECT = Fault(
    name="sampling",
    block=Block.RECORDER,
    sentence="The polling scatters by {jitter_samples} samples; do not trust fast motion of PV.",
    check="Poll at a fixed rate, or record at the controller.",
    caption="Time between samples: a sound recorder has one narrow peak.",
    order=1,
    find=find,
    ends=Ends.ALL,
    numbers=numbers,
    drawn=drawn,
    titles={"jitter_samples": "Scatter of stamps"},
)
