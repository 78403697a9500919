"""A historian that keeps few points and draws straight lines between them."""

from identification.mismatch import recording_faults
from identification.mismatch.effect import Block, Ends, Fault, Number
from identification.mismatch.fault_pictures import straight_lines

EFFECT = Fault(
    name="compression",
    block=Block.RECORDER,
    sentence="The historian compressed the trends to straight lines; nothing can be judged on them.",
    check="Switch compression and exception off for PV, SP and OP, then ask again.",
    caption="Straight segments between few stored points: what happened between them is not known.",
    order=0,
    find=lambda s: recording_faults.compression(s.pv, s.limits.recorder),
    ends=Ends.ALL,
    numbers=(Number("straight_share", "", "Samples on straight lines"),),
    drawn=straight_lines,
)
