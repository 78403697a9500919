"""A faulty valve begun where the loop's own cycles showed it, each stretch between two turns of OP a trial.

Run open over a whole recording, one constant friction loses its place as soon as a slip comes earlier or later than
the one before, and with it the likelihood; the descent from a guess then never finds it. Stretch by stretch the same
fault is plain.
"""

from __future__ import annotations

import numpy as np

from identification.estimation.candidate import Fitted, Model, Problem
from identification.estimation.prediction_error import descend
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.effect import Friction
from identification.mismatch.outside import about
from identification.mismatch.recording import SeenInCycles
from identification.models import Backlash, Stiction, Valve
from identification.record import Floats
from identification.simulation.effect import Variant
from identification.simulation.open_loop import as_parameters
from identification.simulation.parameters import Slot

OF_CYCLES = (Slot.T, Slot.L, Slot.K, Slot.STICKBAND, Slot.JUMP, Slot.COAST)
"""Parameters that the cycles tell."""


def is_friction(name: str) -> bool:
    """Whether an effect is play or stick-slip, which cycles can show."""
    return about(name).friction in (Friction.PLAY, Friction.STICKS)


def begun(p: Problem, near: Fitted, seen: SeenInCycles, valve: Valve) -> Floats:
    """Constants of a fit with process and valve as the cycles told them, shape (SIZE + own,)."""
    c, told = near.model.c.copy(), as_parameters(seen.process, valve)
    for slot in OF_CYCLES:
        c[slot] = told[slot]
    c[Slot.START] = p.y[0]
    c[Slot.BIAS] = float(np.mean(p.y)) - c[Slot.K] * float(np.mean(p.inputs.op) - p.inputs.middle)
    return c


def valve_for(row: Variant, valve: Backlash | Stiction) -> Valve:
    """The valve seen as a row of the catalogue can hold it; None where the row is of another motion."""
    if EFFECTS[row.name].friction is Friction.PLAY:
        return Backlash(valve.width if isinstance(valve, Backlash) else valve.stickband)
    return valve if isinstance(valve, Stiction) and row.label == valve.motion else None


def from_cycles(p: Problem, near: Fitted, seen: SeenInCycles, rows: tuple[Variant, ...]) -> list[Fitted]:
    """Faulty valves added to a fit, each followed to the end from what the cycles told.

    Parameters
    ----------
    p : Problem
    near : Fitted
        The fit to which the valve is added.
    seen : SeenInCycles
    rows : tuple of Variant
        Of the catalogue; those of friction are begun.
    """
    out = []
    for row in rows:
        valve = valve_for(row, seen.valve) if is_friction(row.name) else None
        if valve is not None:
            model = Model((*near.model.added, row), begun(p, near, seen, valve))
            out.append(descend(p, model, p.limits.search.full_steps))
    return out
