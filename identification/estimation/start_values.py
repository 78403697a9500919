"""The plain loop from routine data: gain, time constant and dead time by prediction error, from OP to PV."""

from __future__ import annotations

import numpy as np

from identification.estimation.backlash_stiction import begin, generic_noise
from identification.estimation.hammerstein import IDEAL
from identification.estimation.noise import arx_noise
from identification.estimation.search import AR_ORDER, INPUT_LAGS, Dynamics, prepare, search
from identification.estimation.window import Window
from identification.models import Fopdt
from identification.record import Floats, Mask

TIMES = (1.5, 4.0, 10.0, 25.0, 60.0, 150.0, 400.0)
"""Time constants tried [samples]; ours: from the scan to the longest that a shift of logging shows."""
DELAYS = (0.0, 0.1, 0.3, 0.8)
"""Dead times tried, as shares of the time constant."""
LONGEST_DELAY = 80
"""Longest dead time tried at first [samples]; the descent may go on from there."""


def starts(dt_s: float) -> list[Dynamics]:
    """Time constants and dead times [s] from which the search begins."""
    pairs = {(t, min(round(t * d, 1), LONGEST_DELAY)) for t in TIMES for d in DELAYS}
    return [(t * dt_s, d * dt_s) for t, d in sorted(pairs)]


def plain_processes(y: Floats, op: Floats, usable: Mask, dt_s: float) -> list[Fopdt]:
    """Plain loops that explain PV from OP best under each of two first noise models.

    Parameters
    ----------
    y, op : ndarray of shape (n,)
        PV and OP [% of span].
    usable : ndarray of bool, shape (n,)
        False where a sample must not be used.
    dt_s : float
        Sample interval [s].

    Returns
    -------
    list of Fopdt
        Starts for a descent; where the record is too short for one, the other alone.
    """
    window = Window(y, op, usable, dt_s)
    stem = window.stems_in_blocks.ideal
    learnt = arx_noise(window.centred, stem, usable, AR_ORDER, INPUT_LAGS)
    found = []
    for ar in (learnt, generic_noise()):
        prepared = prepare(window, IDEAL, np.ascontiguousarray(ar))
        fit = begin(prepared, search(prepared, starts(dt_s), 2))
        found.append(Fopdt(fit.gain, fit.time_constant_s, fit.dead_time_s))
    return found
