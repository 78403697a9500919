"""How well plays of every width explain PV, against an ideal valve: what one record says of each width, kept so that
several records can be added up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.noise import generic_noise
from identification.estimation.search import Dynamics, WhitePv, behind, search, white_pv
from identification.estimation.window import Fit, Window
from identification.limits import FIT
from identification.record import Floats
from identification.simulation.valve import IDEAL, sticking

WIDTHS = np.geomspace(0.1, 60.0, 29)
"""Widths of a play that records are asked of [% OP], a quarter apart: from the least dead band of a positioner
to that of a valve which has come loose."""


def width_profile(linear: Fit, play: Fit) -> Floats:
    """Log likelihood of plays of all WIDTHS over that of an ideal valve [nat], shape of WIDTHS.

    Each width has the process that suits it best, under the better of two noise models: that of the fit behind
    a play, and one that knows nothing.

    linear, play : the fits to one window, behind an ideal valve and behind the play that fits best.
    """
    window = linear.window
    blocks = replace(window, position=None)
    out, reach = np.zeros(WIDTHS.size), float(np.ptp(window.op))
    asked = np.flatnonzero((FIT.width_seen * reach < WIDTHS) & (FIT.width_whole * reach > WIDTHS))
    if asked.size == 0:
        return out
    ideal, least = _ideal(blocks, linear, play, linear.ar), np.full(asked.size, np.inf)
    for ar in (play.ar, generic_noise()):
        ideal = min(ideal, _ideal(blocks, linear, play, ar))
        least = np.minimum(least, _swept(white_pv(blocks, ar), WIDTHS[asked], play))
    out[asked] = 0.5 * play.count * np.log(ideal / least)
    out[asked[-1] + 1 :] = out[asked[-1]]
    return out


def _ideal(window: Window, linear: Fit, play: Fit, ar: Floats) -> float:
    """Innovations variance behind an ideal valve under one noise model."""
    begins = [_dynamics(linear), _dynamics(play)]
    return search(behind(white_pv(window, ar), IDEAL), begins, FIT.profile_halvings)[1]


def _dynamics(fit: Fit) -> Dynamics:
    return fit.time_constant_s, fit.dead_time_s


def _swept(pv: WhitePv, widths: Floats, play: Fit) -> Floats:
    """Innovations variance behind plays of rising widths, from that of the best one outwards either way."""
    out = np.empty(widths.size)
    first = int(np.argmin(np.abs(np.log(widths / max(play.valve.stickband, 1e-3)))))
    for way in (range(first, widths.size), range(first - 1, -1, -1)):
        near = _dynamics(play)
        for k in way:
            prepared = behind(pv, sticking(widths[k], 0.0))
            near, out[k], _, _ = search(prepared, [near, _dynamics(play)], FIT.profile_halvings)
    return out
