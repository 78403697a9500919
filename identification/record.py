"""Trends of one loop on one clock: the same type for plant data and for the simulator."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class LoopRecord:
    """SP, PV and OP of one loop on a uniform clock; arrays of shape (n,).

    tag : the loop's name; start_s : time of the first sample [s since 1970-01-01 UTC]; dt_s : sample interval [s];
    sp, pv : set point and process value [% of PV span]; op : controller output [% of OP span]; bad : True where a
    sample must not be used (gap, bad quality), values there are filled, never NaN; position : stem position [% of OP
    span] where recorded; sp_estimated : whether no SP was recorded and one was estimated from PV; masks : True where
    the named thing happens: gap, stale, compressed, quantized, saturated, manual, idle; feed : feedforward signal of
    OP, in its own unit, where stated and recorded; gain_share : gain of the controller over that of most of the
    record [-], where a schedule changes it.
    """

    tag: str
    start_s: float
    dt_s: float
    sp: Floats
    pv: Floats
    op: Floats
    bad: Mask
    position: Floats | None = None
    sp_estimated: bool = False
    masks: Mapping[str, Mask] = field(default_factory=dict)
    feed: Floats | None = None
    gain_share: Floats | None = None

    def __len__(self) -> int:
        return self.pv.size

    @property
    def error(self) -> Floats:
        """Control error e = SP - PV [% of span], shape (n,)."""
        return self.sp - self.pv

    @property
    def stem(self) -> Floats:
        """Stem position where recorded, else OP [% of OP span], shape (n,)."""
        return self.op if self.position is None else self.position

    @property
    def at_work(self) -> Mask:
        """True where a sample is good and no other loop has the valve, in manual too, shape (n,)."""
        return ~(self.bad | self.mask("idle"))

    @property
    def usable(self) -> Mask:
        """True where a sample is good and the loop active in automatic, shape (n,)."""
        return self.at_work & ~self.mask("manual")

    @property
    def time_s(self) -> Floats:
        """Seconds since the first sample, shape (n,)."""
        return np.asarray(np.arange(self.pv.size) * self.dt_s, dtype=np.float64)

    @property
    def duration_s(self) -> float:
        """Length of the record [s]."""
        return self.pv.size * self.dt_s

    def mask(self, name: str) -> Mask:
        """The named mask, all False if it was never set; shape (n,)."""
        found = self.masks.get(name)
        return np.zeros(self.pv.size, dtype=bool) if found is None else found

    def thinned(self, factor: int) -> LoopRecord:
        """Every `factor`-th sample, with OP's mean until the next, which drives the process meanwhile.

        A sample is bad, or a named thing happens at it, if that is true of any sample until the next.
        """
        n = self.pv.size // factor * factor

        def within(x: Mask) -> Mask:
            return np.asarray(x[:n].reshape(-1, factor).any(axis=1))

        kept = self._each(lambda x: x[:n:factor], within)
        return replace(kept, dt_s=self.dt_s * factor, op=self.op[:n].reshape(-1, factor).mean(axis=1))

    def span(self, first: int, last: int) -> LoopRecord:
        """The record of samples first (included) to last (excluded)."""
        cut = slice(max(first, 0), last)
        kept = self._each(lambda x: x[cut], lambda x: x[cut])
        return replace(kept, start_s=self.start_s + max(first, 0) * self.dt_s)

    def _each(self, trend: Callable[[Floats], Floats], mask: Callable[[Mask], Mask]) -> LoopRecord:
        """The record with a function applied to each trend, and another to each mask."""
        return replace(
            self,
            sp=trend(self.sp),
            pv=trend(self.pv),
            op=trend(self.op),
            bad=mask(self.bad),
            position=None if self.position is None else trend(self.position),
            feed=None if self.feed is None else trend(self.feed),
            gain_share=None if self.gain_share is None else trend(self.gain_share),
            masks={name: mask(x) for name, x in self.masks.items()},
        )
