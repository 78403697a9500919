"""Does OP answer PV: what PV tells of OP's next move beyond what OP's own past tells."""

from __future__ import annotations

import numpy as np

from identification.record import Floats

OWN = (1, 2, 3)
"""Moves of OP's own past by which its next is foretold; ours."""
SEEN = (1, 2, 4, 8)
"""Samples back from which PV's way to now is looked at; ours: as far as a proportional action reaches."""


def fed_back(op: Floats, pv: Floats) -> float:
    """Share [-] of what OP's own past leaves of its moves that PV's value and its last moves tell, 0 to 1.

    Both of shape (n,). 0 for a record of fewer samples than twenty times the constants.
    """
    reach = max(max(OWN) + 1, max(SEEN))
    k = np.arange(reach, op.size)
    if k.size < 20 * (2 + len(OWN) + 1 + len(SEEN)):
        return 0.0
    moved = op[k] - op[k - 1]
    own = [np.ones(k.size), op[k - 1], *(op[k - i] - op[k - i - 1] for i in OWN)]
    seen = [pv[k], *(pv[k] - pv[k - i] for i in SEEN)]
    alone, together = _left(moved, own), _left(moved, own + seen)
    return 1.0 - together / alone if alone > 0.0 else 0.0


def _left(y: Floats, columns: list[Floats]) -> float:
    """Sum of squares that a regression leaves."""
    x = np.stack(columns, axis=1)
    x = x / np.maximum(np.abs(x).max(axis=0), 1e-12)
    r = y - x @ np.linalg.lstsq(x, y, rcond=1e-10)[0]
    return float(r @ r)
