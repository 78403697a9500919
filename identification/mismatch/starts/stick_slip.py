"""Where to start a sticking valve: its innovations fall into narrow pits, so stickband and jump are scanned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.candidate import Fitted, Model, Problem
from identification.estimation.noise import whitened
from identification.estimation.prediction_error import descend, loss_of, residual_fit
from identification.record import Floats
from identification.simulation.effect import Variant
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

WIDTHS = np.geomspace(0.6, 4.0, 64)
"""Stickbands tried, in widths of the play that fits best: steps of 3 %, about the width of a pit."""
JUMPS = (0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0)
"""Slip jumps tried, in stickbands."""
FINALISTS = 12
"""Pairs judged with a noise model of their own."""
FOLLOWED = 2
"""Pairs followed to the end."""
COMPASS = (0.02, 0.007, 0.0025)
"""Relative steps of the search within a pit."""


def quick_loss(p: Problem, c: Floats, ar: Floats) -> float:
    """Weighted mean square innovation under a given noise model."""
    return loss_of(p, whitened(p.y - simulate(p.inputs, c), ar, p.edges))


def own_loss(p: Problem, c: Floats) -> float:
    """The same under the noise model that suits it best."""
    return residual_fit(p, c).loss


def sticking(c: Floats, row: Variant, stickband: float, jump: float) -> Floats:
    """Constants with that stickband and jump [% OP]."""
    out = c.copy()
    for slot, value in (row.fixed or {}).items():
        out[slot] = value
    out[Slot.STICKBAND], out[Slot.JUMP] = stickband, min(jump, stickband)
    return out


def scanned(p: Problem, play: Fitted, row: Variant) -> list[Floats]:
    """Constants of the best pairs of stickband and jump, best first."""
    width = float(play.model.c[Slot.STICKBAND])
    trials = [sticking(play.model.c, row, w * width, w * j * width) for w in WIDTHS for j in JUMPS]
    quick = sorted(range(len(trials)), key=lambda i: quick_loss(p, trials[i], play.ar))
    best = [trials[i] for i in quick[:FINALISTS]]
    return sorted(best, key=lambda c: own_loss(p, c))


def settled(p: Problem, c: Floats, row: Variant) -> Floats:
    """The bottom of the pit: stickband and jump moved by ever smaller steps."""
    least = own_loss(p, c)
    for step in COMPASS:
        moving = True
        while moving:
            moving = False
            for slot, way in ((Slot.STICKBAND, 1), (Slot.STICKBAND, -1), (Slot.JUMP, 1), (Slot.JUMP, -1)):
                trial = c.copy()
                trial[slot] *= 1 + way * step
                trial[Slot.JUMP] = min(trial[Slot.JUMP], trial[Slot.STICKBAND])
                found = own_loss(p, trial)
                if found < least * (1 - 1e-7):
                    c, least, moving = trial, found, True
    return c


def fit_sticking(p: Problem, play: Fitted, row: Variant, rows: tuple[Variant, ...]) -> Fitted:
    """The best sticking valve about a fitted play.

    Parameters
    ----------
    p : Problem
    play : Fitted
        A fit whose last row is a play.
    row : Variant
        The kind of sticking.
    rows : tuple of Variant
        Rows that the fit holds beside it.
    """
    fits = []
    for c in scanned(p, play, row)[:FOLLOWED]:
        first = descend(p, Model((*rows, row), settled(p, c, row)), p.limits.search.screen_steps)
        again = settled(p, first.model.c, row)
        fits.append(descend(p, replace(first.model, c=again), p.limits.search.screen_steps))
    return min(fits, key=lambda fit: fit.loss)
