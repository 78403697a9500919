"""How plainly a recording would show a valve's play, if there were one: what its absence says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from identification.estimation.backlash_stiction import begin
from identification.estimation.hammerstein import Fit, residual
from identification.estimation.search import prepare, search, starts
from identification.estimation.window import Window
from identification.record import Floats
from identification.simulation.valve import IDEAL, StemLaw, sticking


def expected_evidence(window: Window, linear: Fit, width: float, period_s: float) -> float:
    """Log likelihood [nat] that a play would win over no play, under the noise that the recording has.

    PV is simulated behind the play, as large as the process without one makes it, and a process without play is
    fitted to that: what it leaves, against the innovations of the recording, is the Kullback-Leibler divergence of
    the two models (Kullback 1951). Noise, few samples and a short record make it small. A play that is there brings
    as much to three times as much: noise keeps the plain process from fitting as well as it does here.

    linear : the process behind an ideal valve, fitted to the window in blocks; width : of the play [% OP]; period_s :
    period of the oscillation [s].
    """
    blocks = replace(window, fine=False, position=None)
    free, behind = (_pv(blocks, linear, valve) for valve in (IDEAL, sticking(width, 0.0)))
    moves = float(np.std(behind))
    if moves == 0.0 or linear.sigma2 <= 0.0:
        return 0.0
    simulated = replace(blocks, y=behind * (float(np.std(free)) / moves))
    prepared = prepare(simulated, IDEAL, linear.ar)
    left = begin(prepared, search(prepared, starts(simulated, period_s))).sigma2
    return 0.5 * linear.count * math.log1p(left / linear.sigma2)


def _pv(window: Window, linear: Fit, valve: StemLaw) -> Floats:
    """PV of a process behind a valve, free of load and noise [% PV], shape (n,)."""
    return window.centred - residual(window, replace(linear, valve=valve))
