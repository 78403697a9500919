"""A separate simulation from OP to PV: the stem as a state machine, then the difference equation of the
process."""

from __future__ import annotations

from identification.models import Process, Valve
from identification.record import Floats
from identification.simulation.lag import discretize, respond
from identification.simulation.valve import stem_position


def pv_of(process: Process, valve: Valve, op: Floats, dt_s: float) -> Floats:
    """Deviation of PV from rest [% PV], shape (n,), with the stem at its first position."""
    stem = stem_position(op, valve)
    d = discretize(process, dt_s)
    return respond(stem - stem[0], d)
