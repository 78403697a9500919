"""A controller whose settings differ from the stated ones."""

from identification.controller.check import StatedSettings
from identification.mismatch.effect import Block, Fault, Finding, Floats, Recording, within
from identification.mismatch.pictures import Picture, law_window, most_active, rebuilt_course


def other_settings(found: Finding, s: Recording, _: Floats) -> Picture | None:
    """OP over its most active stretch, recomputed by identified and stated settings; None without SP or settings."""
    if s.sp is None or s.stated is None:
        return None
    part, e = most_active(s.op, law_window(s, s.stated.ti), s.usable), s.sp - s.pv
    own = StatedSettings(found.values["kp"], found.values["ti_samples"])
    return rebuilt_course(s, part, {"found": (e, own), "stated": (e, s.stated)})


EFFECT = Fault(
    name="controller-settings",
    block=Block.CONTROLLER,
    sentence="The controller runs with other settings than stated: Kp {kp} and Ti {ti_s}.",
    check="Read Kp, Ti and form in the controller and correct loops.csv or the controller.",
    caption="OP recorded, and OP rebuilt from SP and PV by the settings found and by those stated.",
    numbers=lambda found, s: {
        "kp": within(0.02, found.values["kp"], "% OP/% PV"),
        "ti_s": within(0.02, found.values["ti_samples"] * s.dt_s, "s"),
    },
    titles={"kp": "Kp", "ti_s": "Ti"},
    drawn=other_settings,
)
