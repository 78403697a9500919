"""Whether a recording can answer at all: does PV answer OP, and is it long enough to tell how fast."""

from __future__ import annotations

from typing import TYPE_CHECKING

from identification.mismatch.fitting import deviations
from identification.mismatch.slots import Slot

if TYPE_CHECKING:
    from identification.mismatch.explain import Explanation, Subject

SURE = 3.0
"""Standard deviations by which a gain must differ from zero for PV to answer OP; ours: chance gives one in 370."""
ENOUGH = 5.0
"""Time constants that a recording of a process that settles must hold; the catalogue's need."""
INTEGRATING = ("level",)
"""Loop types that need not settle, of which a short record still tells the slope."""


def unanswered(found: Explanation) -> str:
    """What is needed where PV does not answer OP; empty where it does."""
    spread = deviations(found.p, found.plain)
    slots = [int(p.slot) for p in found.plain.model.params]
    gain, half = float(found.plain.model.c[Slot.K]), SURE * float(spread[slots.index(int(Slot.K))])
    if abs(gain) > half:
        return ""
    return (
        f"needs moves of OP that PV answers; the gain found, {gain:.2g} within {half:.2g} % PV/% OP, "
        "cannot be told from zero"
    )


def too_short(found: Explanation, s: Subject) -> str:
    """What is needed where the record is short against the time constant; empty where it is not."""
    lag, length = float(found.plain.model.c[Slot.T]), s.pv.size * s.dt_s
    if s.kind in INTEGRATING or any(r.name == "integrator" for r in found.best.model.rows):
        return ""
    if length >= ENOUGH * lag:
        return ""
    return (
        f"needs {ENOUGH:.0f} time constants, has {length / lag:.2g} "
        f"(a record of {_time(length)}, a time constant of about {_time(lag)})"
    )


def uninformed(found: Explanation, s: Subject) -> str:
    """What the recording lacks for an answer, empty where it is enough.

    Parameters
    ----------
    found : Explanation
    s : Subject
    """
    return unanswered(found) or too_short(found, s)


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 7200 else f"{seconds / 3600:.3g} h"
