"""A controller that runs with other settings than stated."""

from identification.mismatch.effect import Block, Fault, Number
from identification.mismatch.fault_pictures import other_settings

EFFECT = Fault(
    name="controller-settings",
    block=Block.CONTROLLER,
    sentence="The controller runs with other settings than stated: Kp {kp} and Ti {ti_s}.",
    check="Read Kp, Ti and form in the controller and correct loops.csv or the controller.",
    caption="OP recorded, and OP rebuilt from SP and PV by the settings found and by those stated.",
    numbers=(
        Number("kp", "% OP/% PV", "Kp", share=0.02),
        Number("ti_s", "s", "Ti", "ti_samples", in_time=True, share=0.02),
    ),
    drawn=other_settings,
)
