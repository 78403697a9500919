"""PV stamped by another clock than OP."""

from __future__ import annotations

from identification.controller.check import ControllerFault
from identification.mismatch.curves.controller import clock_course
from identification.mismatch.curves.drawn import Shape
from identification.mismatch.effect import Block, Fault, exact
from identification.mismatch.recording import Finding, Recording
from identification.models import Estimate
from identification.record import Floats

SURE = 0.25
"""Half width of the interval [samples]; the steps in which the shift is searched."""


def numbers(found: Finding, s: Recording) -> dict[str, Estimate]:
    """How late PV's clock is [s]."""
    return {"shift_s": exact(found.values["late_samples"] * s.dt_s, "s", SURE * s.dt_s)}


def drawn(found: Finding, s: Recording, _: Floats) -> Shape | None:
    """OP rebuilt with PV as stamped, and with its clock set right."""
    return clock_course(found.name, s, found.values["late_samples"])


EFFECT = Fault(
    name="clock-offset",
    block=Block.RECORDER,
    sentence="PV is stamped {shift_s} later than OP: the two clocks differ.",
    check="Record PV and OP from one source or synchronize the clocks.",
    caption="OP recorded, and rebuilt with PV's clock set right (found) and as stamped.",
    finds=ControllerFault.CLOCK,
    numbers=numbers,
    drawn=drawn,
    titles={"shift_s": "PV late by"},
)
