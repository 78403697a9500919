"""The plain loop from routine data: gain, time constant and dead time by prediction error, from OP to PV."""

from __future__ import annotations

import math

import numpy as np

from identification.estimation.backlash_stiction import begin, generic_noise
from identification.estimation.noise import arx_noise
from identification.estimation.search import AR_ORDER, INPUT_LAGS, Dynamics, prepare, search
from identification.estimation.window import Window
from identification.models import Fopdt
from identification.record import Floats, Mask
from identification.simulation.valve import IDEAL

SHORTEST = 1.5
"""Shortest time constant tried [samples]."""
APART = 2.5
"""Ratio of neighbouring time constants; ours: the descent covers a factor of three either way."""
DELAYS = (0.0, 0.1, 0.3, 0.8)
"""Dead times tried, as shares of the time constant."""
LONGEST_DELAY = 0.1
"""Longest dead time tried at first, as a share of the record; the descent may go on from there."""
NO_WHITENING = np.zeros(1)
"""The noise model of a simulation judged by its own errors: none."""


def record_starts(samples: int, dt_s: float) -> list[Dynamics]:
    """Time constants and dead times [s] from which the search begins, over all time scales of the record."""
    count = 1 + math.ceil(math.log(max(samples / SHORTEST, APART)) / math.log(APART))
    times = SHORTEST * APART ** np.arange(count)
    pairs = {(t, min(round(t * d, 1), LONGEST_DELAY * samples)) for t in times for d in DELAYS}
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
    learnt = arx_noise(window.centred, stem, usable, AR_ORDER, INPUT_LAGS)
    return [_searched(window, ar) for ar in (learnt, generic_noise(), NO_WHITENING)]
