"""Polling that scatters: values stand at other times than their stamps say."""

from identification.mismatch import recording_faults
from identification.mismatch.effect import Block, Ends, Fault, Number
from identification.mismatch.fault_pictures import spacings

SURE = 0.1
"""Half width of the interval, in the scatter found; ours."""

EFFECT = Fault(
    name="sampling",
    block=Block.RECORDER,
    sentence="The polling scatters by {jitter_samples} samples; do not trust fast motion of PV.",
    check="Poll at a fixed rate, or record at the controller.",
    caption="Time between samples: a sound recorder has one narrow peak.",
    order=1,
    find=lambda s: recording_faults.sampling(s.stamp_s, s.dt_s, s.limits.recorder),
    ends=Ends.ALL,
    numbers=(Number("jitter_samples", "samples", "Scatter of stamps", share=SURE),),
    drawn=spacings,
)
