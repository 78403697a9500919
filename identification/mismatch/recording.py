"""One recording to be explained, and what is found in it before any physics is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from identification.controller.check import StatedSettings
from identification.record import Floats, Mask


@dataclass(frozen=True, slots=True)
class Recording:
    """One recording to be explained.

    sp : shape (n,) [% PV], None where not recorded; pv, op : shape (n,) [% of span]; usable : bool, shape (n,);
    dt_s [s]; stamp_s : stamps as logged [s]; stated : the controller as the plant states it; ranged : whether PV's
    range is stated; neighbours : OPs of other loops on the same clock, each shape (n,);
    kind : the loop's type as stated, lower case.
    """

    sp: Floats | None
    pv: Floats
    op: Floats
    usable: Mask
    dt_s: float
    stamp_s: Floats
    stated: StatedSettings | None = None
    ranged: bool = True
    neighbours: tuple[Floats, ...] = ()
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Finding:
    """What was found about recorder or controller: its numbers, where it is (bool, shape (n,)), the effect's name."""

    values: Mapping[str, float]
    where: Mask = field(repr=False)
    name: str = ""
