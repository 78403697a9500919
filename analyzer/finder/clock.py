"""Tags of an export on one clock, read a few at a time, as input of the finder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analyzer.history.export import Export
from analyzer.history.series import Series

MOST_CELLS = 12000000  # Samples of all tags that are used; more are thinned: a minute and 2 GB for 3,000 tags
LONGEST_S = 86400.0
"""Time that is used, the last of the export [s]: a day has the set point moves of all shifts."""
AT_ONCE = 100  # Tags that are read at a time [tags]: a day of samples a second of them is 150 MB
GOOD_SHARE = 0.5  # Good samples of a tag, of all, below which it is left out


@dataclass(frozen=True, slots=True)
class Sampled:
    """Tags on one clock: names, values without gaps, shape (n, tags), the time between samples [s], and text tags,
    each text as its index among the tag's own texts."""

    tags: tuple[str, ...]
    values: NDArray[np.float64]
    dt_s: float
    texts: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    def of(self, tags: Sequence[str]) -> Sampled:
        """Some of the tags, if available, in the requested order."""
        place = {tag: k for k, tag in enumerate(self.tags)}
        known = [tag for tag in tags if tag in place]
        texts = {tag: self.texts[tag] for tag in tags if tag in self.texts}
        return Sampled(tuple(known), self.values[:, [place[tag] for tag in known]], self.dt_s, texts)


def sampled(
    export: Export,
    tags: Sequence[str],
    span: tuple[float, float],
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Sampled:
    """Values of numeric tags, and texts, over the last day of a span [s since 1970-01-01 UTC].

    Held from each good sample to the next; a mostly bad tag is left out. Raises InputError where the export cannot be
    read.
    """
    first, last = export.span()
    last = min(last, span[1])
    first = max(first, span[0], last - LONGEST_S)
    clock: NDArray[np.float64] | None = None
    texts: dict[str, NDArray[np.float64]] = {}
    names: list[str] = []
    columns: list[NDArray[np.float64]] = []
    for k in range(0, len(tags), AT_ONCE):
        read = export.read(tags[k : k + AT_ONCE])
        if clock is None:
            clock = _clock(list(read.values()), first, last, len(tags))
        for tag, series in read.items():
            held = _held(series, clock)
            if held is not None and series.text is not None:
                texts[tag] = held
            elif held is not None:
                names.append(tag)
                columns.append(held)
        report(min(k + AT_ONCE, len(tags)), len(tags))
    if clock is None or not columns:
        return Sampled((), np.empty((0, 0)), 1.0)
    return Sampled(tuple(names), np.column_stack(columns), float(clock[1] - clock[0]), texts)


def _clock(read: Sequence[Series], first: float, last: float, tags: int) -> NDArray[np.float64]:
    """A clock with the most frequent interval of some tags, coarser if all tags would have too many samples."""
    steps = [float(np.median(np.diff(s.stamp_s))) for s in read if len(s.stamp_s) > 1]
    step = max(float(np.median(steps)) if steps else 1.0, 1e-3)
    thinned = int(np.ceil((last - first) / step * tags / MOST_CELLS))
    return (
        np.arange(first, last + step / 2, step * max(thinned, 1))
        if last > first
        else np.array([first, first + 1.0])
    )


def _held(series: Series, clock: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """A tag's last good value at each time of a clock; None if it has few."""
    value = series.value
    if series.text is not None:
        value = np.unique(series.text.astype(str), return_inverse=True)[1].astype(float)
    good = ~series.bad & np.isfinite(value)
    if good.sum() < 2 or good.sum() < GOOD_SHARE * len(value):
        return None
    at = np.searchsorted(series.stamp_s[good], clock + 1e-6, side="right") - 1
    return np.asarray(value[good][np.maximum(at, 0)])
