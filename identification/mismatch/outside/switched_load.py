"""A load that PV itself switches on when it is high and off when it is low: a thermostat, a float, a relief valve."""

from __future__ import annotations

from identification.mismatch.curves.course import course, load_over_time, over_record
from identification.mismatch.curves.drawn import Axis, Drawing, Shape
from identification.mismatch.effect import Block, Effect
from identification.simulation.effect import Param, Variant
from identification.simulation.parameters import Slot

PLACES = tuple(0.05 * i for i in range(2, 19))
"""Where the search begins, in the span of PV; ours: a start finds its place from a twentieth of the span off."""
BANDS = (0.5, 3.0)
"""Bands with which it begins [% PV]; ours."""


def load_switched(d: Drawing) -> Shape:
    """The load as PV switches it."""
    at = over_record(d.inputs)
    return course(d, at, load_over_time(d, at), Axis("load at the inlet", "% OP"))


EFFECT = Effect(
    name="switched-load",
    block=Block.LOAD,
    sentence="a load of {switched_load_pct} comes on where PV passes {switches_at_pct} and goes where it falls back",
    check="Look for a switch on PV: a thermostat, a float, a relief valve, a pump or fan that stands by.",
    curve=load_switched,
    variants=(
        Variant(
            (
                Param(Slot.SWITCH, "switched_load_pct", "% OP", -60.0, 60.0, title="Switched load"),
                Param(Slot.SWITCH_AT, "switches_at_pct", "% PV", 0.0, 1.0, "pvspan", title="Switches at"),
                Param(Slot.SWITCH_BAND, "switch_band_pct", "% PV", 0.0, 50.0, title="Band of the switch"),
            ),
            tuple({Slot.SWITCH_AT: at, Slot.SWITCH_BAND: band} for at in PLACES for band in BANDS),
            linear=Slot.SWITCH,
        ),
    ),
)
