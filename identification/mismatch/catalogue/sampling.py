"""Polling that scatters: values stand at other times than their stamps say."""

import numpy as np

from identification.mismatch.effect import Block, Ends, Fault, Finding, Number, Recording
from identification.mismatch.fault_pictures import spacings


def scattered_stamps(s: Recording) -> Finding | None:
    """Stamps that scatter about a uniform clock by more than logging does, gaps left out."""
    spacing = np.diff(s.stamp_s) / s.dt_s
    spacing = spacing[(spacing > 0.02) & (spacing < 1.98)]
    jitter = float(np.std(spacing)) / np.sqrt(2.0) if spacing.size > 10 else 0.0
    if jitter < s.limits.recorder.jitter:
        return None
    return Finding({"jitter_samples": jitter}, np.ones(s.stamp_s.size, dtype=bool))


EFFECT = Fault(
    name="sampling",
    block=Block.RECORDER,
    sentence="The polling scatters by {jitter_samples} samples; do not trust fast motion of PV.",
    check="Poll at a fixed rate, or record at the controller.",
    caption="Time between samples: a sound recorder has one narrow peak.",
    order=1,
    find=scattered_stamps,
    ends=Ends.ALL,
    numbers=(Number("jitter_samples", "samples", "Scatter of stamps", share=0.1),),
    drawn=spacings,
)
