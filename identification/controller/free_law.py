"""The law of a record for which no settings are stated: the variant with the strongest evidence, and its settings.

The variants of law_variants are fitted with free gains. An interval adds the scatter between parts of the record
(delete-a-group jackknife, Shao and Wu 1989) and the share of OP that the law does not explain: moves of PV that no
sample shows may be collinear with those that the samples show.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, pairwise

import numpy as np

from identification.controller.gain_pieces import APART
from identification.controller.law_comparison import AS_WELL, ROUNDING, WORTH, settings_of
from identification.controller.law_variants import (
    STRAIGHT,
    PreparedRecord,
    VariantFit,
    bent_shapes,
    gains_of,
    prepared_record,
    terms_of,
    usual_variants,
    with_best_filter,
)
from identification.controller.pid_regression import SMALL, best_gains, fit_pi
from identification.models import Estimate, Pid
from identification.record import Floats, LoopRecord, Mask

USUAL_SCAN = 1.0
"""Scan of a controller for which nothing is stated [s]: systems have .1 to 1 s, and historians keep rows that
are slower."""

INTEGRAL = np.eye(3)[1:2]
SIMPLEST_FIRST = (np.eye(3)[:1], INTEGRAL, np.eye(3)[:2], np.eye(3))
"""Gains that are free in P, I, PI and PID, as rows of best_gains."""
PARTS = 8
"""Parts of a record of which one is left out at a time; ours: enough for an interval, and each holds many moves."""
T_NINETY = 1.895
"""95 % quantile of Student's distribution with seven degrees of freedom."""
DIGITS = 0.005
"""Least half-width of an interval's log: settings are entered with three digits."""
UNSEEN = 1.0
"""Ratio of the log error of a setting to the root of the unexplained share: nine of ten are smaller. Ours,
on seeds 41 and 42 of proofs/controllers.py."""


@dataclass(frozen=True, slots=True)
class FreeLaw:
    """A law identified without stated settings: the controller, the share of OP's variance that it explains [-], and
    gain [% OP/% PV] and integral time [s] with 90 % intervals; several, whether parts of a signal's range have
    different gains, so that no pair of settings is the controller's."""

    found: Pid
    explained: float
    kp: Estimate
    ti_s: Estimate
    several: bool = False

    def is_clear(self, dt_s: float, explained: float, ti_samples: float, filter_of_ti: float) -> bool:
        """Whether the law has one gain and explains at least a share of OP [-], its integral time is at least so many
        samples of an interval [s], and its filter of PV at most a share of that time [-]."""
        ti_s = abs(self.found.ti_s)
        seen = self.found.kp == 0.0 or ti_s >= ti_samples * dt_s
        clear = not self.several and self.explained >= explained
        return clear and seen and self.found.pv_filter_s <= filter_of_ti * ti_s


def free_law(record: LoopRecord, scale_s: float) -> FreeLaw | None:
    """The law that OP follows; None where OP follows none.

    record : SP, PV and OP [% of span]. scale_s : time scale on which the loop moves [s]. A law that explains
    little is returned too: the caller checks its share.
    """
    first = fit_pi(record, scale_s)
    if first is None or first.kp == 0.0:
        return None
    start = Pid(first.kp, first.ti_s, scan_s=min(record.dt_s, USUAL_SCAN))
    x = prepared_record(record, scale_s, start)
    seen = _clearest(x, start)
    if seen is None:
        return None
    enough = AS_WELL * seen.residual_share(seen.free) + ROUNDING
    for along in SIMPLEST_FIRST:
        gains = best_gains(seen.moves.values(), seen.weight, along, np.zeros(3))
        pid = settings_of(gains, record.duration_s, start)
        alone = along is INTEGRAL and _is_integral(seen, record.dt_s)
        if pid is not None and (alone or seen.residual_share(gains) <= enough):
            return _law(x, seen, along, pid)
    return None


def _is_integral(seen: VariantFit, dt_s: float) -> bool:
    """Whether the gain of the error is the delay, of at most a sample, of an integral without one."""
    kp, ki, _ = (float(g) for g in seen.free)
    return -dt_s * abs(ki) <= kp * math.copysign(1.0, ki) < 0.0


def _law(x: PreparedRecord, seen: VariantFit, along: Floats, pid: Pid) -> FreeLaw:
    """A law with its intervals."""
    explained = 1.0 - seen.residual_share(gains_of(pid))
    kp, ti_s = (
        _around(v, w) for v, w in zip((pid.kp, pid.ti_s), _widths(x, seen, along, explained), strict=True)
    )
    return FreeLaw(terms_of(x, pid, seen), explained, kp, replace(ti_s, unit="s"), _several(x, seen, along))


def _clearest(x: PreparedRecord, start: Pid) -> VariantFit | None:
    """The simplest variant of the law; no other one reproduces OP clearly better."""
    best: VariantFit | None = None
    for seen in _variants(x, start):
        lawful = seen.is_law(gains_of(start))
        if lawful and (best is None or seen.misfit(seen.free) < best.misfit(best.free) - WORTH):
            best = seen
        if best is not None and best.misfit(best.free) < math.log(SMALL) + WORTH:
            break  # no residual is so small that another variant is clearly better
    if best is None or best.variant.pv_filter == 0.0:
        return best
    near = with_best_filter(x, best.variant, None)
    return near if near is not None and near.misfit(near.free) < best.misfit(best.free) else best


def _variants(x: PreparedRecord, start: Pid) -> Iterator[VariantFit]:
    bent = (usual_variants(x, shape, smoothing=False) for shape in bent_shapes(x, None))
    return chain(usual_variants(x, STRAIGHT, start), *bent)


def _widths(x: PreparedRecord, seen: VariantFit, along: Floats, explained: float) -> tuple[float, float]:
    """Half-widths of the 90 % intervals of the logs of gain and integral time."""
    edges = np.linspace(0, len(x.record), PARTS + 1).astype(int)
    k = np.arange(len(x.record))
    gains = [_gains_without(x, seen, along, (k >= a) & (k < b)) for a, b in pairwise(edges)]
    logs = np.array([_logs(g) for g in gains if g is not None])
    jackknife = np.zeros(2)
    if len(logs) > 1:
        jackknife = np.sqrt((len(logs) - 1) * logs.var(axis=0))
    wide = np.hypot(T_NINETY * jackknife, UNSEEN * math.sqrt(max(1.0 - explained, 0.0)))
    return float(wide[0]), float(wide[1])


def _logs(gains: Floats) -> tuple[float, float]:
    """Logs of gain and integral time, 0 for a missing one; of an integral alone that of 1 / ki."""
    kp, ki = abs(float(gains[0])), abs(float(gains[1]))
    return math.log(kp) if kp else 0.0, math.log((kp or 1.0) / ki) if ki else 0.0


def _gains_without(x: PreparedRecord, seen: VariantFit, along: Floats, out: Mask) -> Floats | None:
    """The gains of a variant without some samples, bool, shape (n,); None where the others show no law."""
    rest = replace(x, out=x.out | out).fit_variant(seen.rows, seen.variant)
    return None if rest is None else best_gains(rest.moves.values(), rest.weight, along, np.zeros(3))


def _several(x: PreparedRecord, seen: VariantFit, along: Floats) -> bool:
    """Whether the gains in the lower and the upper half of OP, PV or SP differ by more than the usual resolution."""
    if x.out.all():
        return False
    for signal in (x.record.op, x.record.pv, x.record.sp):
        middle = np.median(signal[~x.out])
        pair = [_gains_without(x, seen, along, out) for out in (signal < middle, signal > middle)]
        kp = [abs(float(g[0])) for g in pair if g is not None]
        if len(kp) == 2 and max(kp) > APART * min(kp):
            return True
    return False


def _around(value: float, half: float) -> Estimate:
    """A setting with its interval; a setting that is zero or infinite is exact."""
    if value == 0.0 or math.isinf(value):
        return Estimate(value, value, value)
    half = max(half, DIGITS)
    ends = sorted((value * math.exp(-half), value * math.exp(half)))
    return Estimate(value, ends[0], ends[1])
