"""A controller that runs with other settings than stated."""

from __future__ import annotations

from identification.controller.check import ControllerFault, StatedSettings
from identification.mismatch.curves.controller import rebuilt_course
from identification.mismatch.curves.drawn import Shape
from identification.mismatch.effect import Block, Fault, exact
from identification.mismatch.recording import Finding, Recording
from identification.models import Estimate
from identification.record import Floats

SURE = 0.02
"""Half width of both intervals, as a share; ours."""


def numbers(found: Finding, s: Recording) -> dict[str, Estimate]:
    """Kp [% OP/% PV] and Ti [s] as recovered."""
    kp, ti = found.values["kp"], found.values["ti_samples"] * s.dt_s
    return {"kp": exact(kp, "% OP/% PV", SURE * abs(kp)), "ti_s": exact(ti, "s", SURE * ti)}


def drawn(found: Finding, s: Recording, _: Floats) -> Shape | None:
    """OP rebuilt by the settings found and by those stated."""
    return rebuilt_course(found.name, s, StatedSettings(found.values["kp"], found.values["ti_samples"]))


EFFECT = Fault(
    name="controller-settings",
    block=Block.CONTROLLER,
    sentence="The controller runs with other settings than stated: Kp {kp} and Ti {ti_s}.",
    check="Read Kp, Ti and form in the controller and correct loops.csv or the controller.",
    caption=("OP recorded, and OP rebuilt from SP and PV by the settings found and by those stated."),
    finds=ControllerFault.SETTINGS,
    numbers=numbers,
    drawn=drawn,
    titles={"kp": "Kp", "ti_s": "Ti"},
)
