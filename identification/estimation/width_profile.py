"""How well plays of every width explain PV, against an ideal valve: what one record says of each width, kept so that
several records can be added up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.backlash_stiction import generic_noise, plays, tried
from identification.estimation.hammerstein import Fit
from identification.record import Floats
from identification.simulation.valve import IDEAL, StemLaw

WIDTHS = np.geomspace(0.1, 60.0, 29)
"""Widths of a play that records are asked of [% OP], a quarter apart: from the least dead band of a positioner
to that of a valve which has come loose."""
SEEN = 0.03
"""Width over OP's range below which a play moves PV as an ideal valve does [-]; ours."""
WHOLE = 1.25
"""Width over OP's range from which on the stem never moves [-]."""


def width_profile(linear: Fit, play: Fit) -> Floats:
    """Log likelihood of plays of all WIDTHS over that of an ideal valve [nat], shape of WIDTHS.

    Each width has the process that suits it best, under the better of two noise models: that of the fit behind
    a play, and one that knows nothing.

    linear, play : the fits to one window, behind an ideal valve and behind the play that fits best.
    """
    window = linear.window
    blocks = replace(window, position=None)
    out, reach = np.zeros(WIDTHS.size), float(np.ptp(window.op))
    asked = np.flatnonzero((SEEN * reach < WIDTHS) & (WHOLE * reach > WIDTHS))
    if asked.size == 0:
        return out
    begins = [(fit.time_constant_s, fit.dead_time_s) for fit in (play, linear)]
    valves = [*plays(WIDTHS[asked][::-1]), IDEAL]

    def left(ar: Floats, valves: list[StemLaw]) -> Floats:
        return np.array([fit.sigma2 for fit in tried(blocks, ar, valves, begins, 1)])

    least = np.minimum(*(left(ar, valves) for ar in (play.ar, generic_noise())))
    ideal = min(least[-1], *left(linear.ar, [IDEAL]))
    out[asked] = 0.5 * play.count * np.log(ideal / least[-2::-1])
    out[asked[-1] + 1 :] = out[asked[-1]]
    return out
