"""What a flexible model of no name could still explain: the ceiling under which a named effect has to be near."""

from __future__ import annotations

import numpy as np

from identification.estimation.candidate import Fitted, Problem
from identification.estimation.noise import lag_means, whitened
from identification.estimation.prediction_error import sensitivities
from identification.record import Floats
from identification.simulation.lag import lagged
from identification.simulation.open_loop import simulate, through_valve
from identification.simulation.parameters import Slot
from identification.simulation.vessel import plain_vessel

BOXES = 32
"""Past stretches of OP that may act, each with a weight of its own."""
REACH = 8.0
"""How far back they go, in time constants plus dead times; ours: a recycle of seven is within it."""
FEWEST = 3.0
"""A stretch is at least this many samples."""


def past_moves(p: Problem, through: Floats, length_s: float) -> list[Floats]:
    """OP's means over past stretches, each shape (n,)."""
    width = max(round(length_s / BOXES / p.inputs.dt_s), int(FEWEST))
    total = np.concatenate(([0.0], np.cumsum(through - through.mean())))
    n = through.size
    k = np.arange(n)
    out = []
    for i in range(BOXES):
        near, far = np.maximum(k - i * width, 0), np.maximum(k - (i + 1) * width, 0)
        out.append((total[near] - total[far]) / width)
    return out


def bent_moves(p: Problem, fit: Fitted, through: Floats) -> list[Floats]:
    """Responses to OP's fast part by size, to its square and to PV's square, each shape (n,)."""
    c = fit.model.c.copy()
    c[Slot.K], c[Slot.BIAS], c[Slot.START] = 1.0, 0.0, 0.0
    dt_s = p.inputs.dt_s
    still = np.zeros(through.size)
    moves = []
    for share in (0.1, 0.5):
        fast = through - lagged(through, max(share * float(c[Slot.T]), dt_s), dt_s)
        moves += [fast * np.abs(fast), np.abs(fast)]
    level = through - through.mean()
    moves += [level**2, level**3]
    return [plain_vessel(x - x[0], still, c, dt_s, 0.0) for x in moves]


def ceiling(p: Problem, fit: Fitted) -> tuple[float, int]:
    """Gain in log likelihood [nat] that the flexible model has over a fit, and the number of its weights.

    The fit's own constants and its noise model follow linearly, so the gain is of what they cannot give.
    """
    e, left, count = explained_freely(p, fit)
    won = 0.5 * float(e @ e - left @ left) / max(fit.loss, 1e-30)
    return won * fit.count / max(p.count, 1), count


def explained_freely(p: Problem, fit: Fitted) -> tuple[Floats, Floats, int]:
    """Weighted innovations that a fit's own constants cannot lessen and what the flexible model leaves of them, shape
    (n,) each, and the number of its weights."""
    c = fit.model.c
    through = through_valve(p.inputs, c)
    length = REACH * float(c[Slot.T] + c[Slot.L])
    free = past_moves(p, through, min(length, 0.2 * through.size * p.inputs.dt_s)) + bent_moves(
        p, fit, through
    )
    root = np.sqrt(p.weight)
    r = p.y - simulate(p.inputs, c)
    own = np.concatenate((sensitivities(p, fit.model, fit.ar), lag_means(r, p.edges))) * root
    more = np.stack([whitened(x, fit.ar, p.edges) for x in free]) * root
    span = np.linalg.qr(own.T)[0]
    e = fit.e * root
    e = e - span @ (span.T @ e)
    more = more.T - span @ (span.T @ more.T)
    q, scale = np.linalg.qr(more)
    kept = np.abs(np.diag(scale)) > 1e-8 * np.abs(np.diag(scale)).max()
    return e, e - q[:, kept] @ (q[:, kept].T @ e), int(kept.sum())
