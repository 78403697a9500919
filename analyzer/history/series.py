"""What a reader returns: one tag's raw samples, stamps as logged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Series:
    """Raw samples of one tag, oldest first, one per stamp.

    Parameters
    ----------
    stamp_s : ndarray of float, shape (n,)
        Time of each sample [s since 1970-01-01 UTC], strictly rising.
    value : ndarray of float, shape (n,)
        Values in the tag's own unit; NaN where the export holds no number.
    bad : ndarray of bool, shape (n,)
        True where the historian says that the value is not good, or where there is no number; of a text tag,
        where there is no text.
    text : ndarray of str or None
        The texts, shape (n,), where the tag is a text tag (controller modes); else None.
    unread : int
        Values in the export that look like numbers and could not be understood; bad here.
    example : str
        One of them.
    """

    stamp_s: NDArray[np.float64]
    value: NDArray[np.float64]
    bad: NDArray[np.bool_]
    text: NDArray[np.object_] | None = None
    unread: int = 0
    example: str = ""
