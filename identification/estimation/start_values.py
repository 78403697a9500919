"""The plain loop from routine data: gain, time constant and dead time by prediction error, from OP to PV."""

from __future__ import annotations

import math

import numpy as np

from identification.estimation.backlash_stiction import begin, generic_noise
from identification.estimation.noise import arx_noise
from identification.estimation.search import (
    Dynamics,
    prepare,
    search,
)
from identification.estimation.window import Window
from identification.limits import FIT
from identification.models import Fopdt
from identification.record import Floats, Mask
from identification.simulation.valve import IDEAL

NO_WHITENING = np.zeros(1)
"""The noise model of a simulation judged by its own errors: none."""


def record_starts(samples: int, dt_s: float) -> list[Dynamics]:
    """Time constants and dead times [s] from which the search begins, over all time scales of the record."""
    count = 1 + math.ceil(math.log(max(samples / FIT.shortest, FIT.apart)) / math.log(FIT.apart))
    times = FIT.shortest * FIT.apart ** np.arange(count)
    pairs = {(t, min(round(t * d, 1), FIT.longest_delay * samples)) for t in times for d in FIT.delays}
    return [(t * dt_s, d * dt_s) for t, d in sorted(pairs)]


def simulated_best(y: Floats, op: Floats, usable: Mask, dt_s: float) -> Fopdt:
    """The plain loop whose simulation leaves least of PV, a straight line of load taken out; see plain_processes."""
    return _searched(Window(y, op, usable, dt_s), NO_WHITENING)


def _searched(window: Window, ar: Floats) -> Fopdt:
    prepared = prepare(window, IDEAL, np.ascontiguousarray(ar))
    fit = begin(window, prepared, search(prepared, record_starts(window.y.size, window.dt_s), 2))
    return Fopdt(fit.gain, fit.time_constant_s, fit.dead_time_s)


def plain_processes(y: Floats, op: Floats, usable: Mask, dt_s: float) -> list[Fopdt]:
    """Plain loops that explain PV from OP best: one step ahead under each of two first noise models, and simulated.

    y, op : shape (n,), PV and OP [% of span]; usable : bool, shape (n,), False where a sample must not be used; dt_s
    : sample interval [s]. Returns starts for a descent, one for each; the last is the simulated one.
    """
    window = Window(y, op, usable, dt_s)
    stem = window.stems_in_blocks.ideal
    learnt = arx_noise(window.centred, stem, usable, FIT.ar_order, FIT.input_lags)
    return [_searched(window, ar) for ar in (learnt, generic_noise(), NO_WHITENING)]
