"""From raw stamps to one clock: what is fit for use, said sample by sample, before any analysis.

Masks are taken on the raw stamps, where a gap, a frozen value or a compressed stretch is still visible, and
carried onto the clock of the loop's record.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from analyzer.config import QualityLimits
from analyzer.decisions import Lack, LacksError, Needs
from analyzer.history.series import Series
from analyzer.history.stray import main_span
from analyzer.loops.spec import LoopSpec
from identification.record import Floats, LoopRecord, Mask

MANUAL_TEXTS = ("man", "iman", "lo", "manual", "hand", "local", "rout", "0", "off", "oos", "init")
"""Mode texts, lower case, that mean that the controller does not move OP."""
AUTOMATIC_TEXTS = (
    "aut",
    "auto",
    "automatic",
    "cas",
    "casc",
    "cascade",
    "rcas",
    "rsp",
    "remote",
    "spc",
    "1",
    "on",
)
"""Mode texts, lower case, that mean that it does."""
RECORDED_RANGE = (0.005, 0.995)
"""Quantiles of PV that stand for its span where none is stated; contract of loops.csv."""


@dataclass(frozen=True, slots=True)
class Scale:
    """What percent means for a loop.

    low, span : PV range in the tag's own unit; op_low, op_span : range of OP; recorded : True where the PV
    range was taken from the record because none is stated.
    """

    low: float
    span: float
    op_low: float
    op_span: float
    recorded: bool

    def pv_pct(self, value: Floats) -> Floats:
        """PV or SP in % of span."""
        return (value - self.low) * (100.0 / self.span)

    def op_pct(self, value: Floats) -> Floats:
        """OP or position in % of span."""
        return (value - self.op_low) * (100.0 / self.op_span)


@dataclass(frozen=True, slots=True)
class Prepared:
    """A record with its scale, the resolution of its trends and plain sentences about its quality.

    pv_step, op_step : resolution of PV and OP [% of span], 0 where none was seen; compressed_share : share of
    samples on straight segments [-]; op_known : False where no OP was recorded.
    """

    record: LoopRecord
    scale: Scale
    pv_step: float
    op_step: float
    compressed_share: float
    notes: tuple[str, ...]
    op_known: bool = True


def interval(stamp_s: Floats) -> float:
    """The sample interval of raw stamps [s]: the median spacing, or the mean where it is the same but for jitter."""
    if stamp_s.size < 2:
        return math.nan
    median = float(np.median(np.diff(stamp_s)))
    even = float(f"{(stamp_s[-1] - stamp_s[0]) / (stamp_s.size - 1):.4g}")
    return even if abs(even - median) < 0.005 * median else median


def onto_clock(series: Series, clock: Floats, dt_s: float, limits: QualityLimits) -> tuple[Floats, Mask]:
    """Values held on a clock, and where there is nothing to hold.

    Returns
    -------
    ndarray of shape (n,), ndarray of bool, shape (n,)
        The last good value at or before each tick (the next one where there is none), and True where it is a
        gap: older than gap_factor intervals of the tag, or not good.
    """
    good = ~series.bad
    if not good.any():
        return np.zeros(clock.size), np.ones(clock.size, dtype=bool)
    if clock.size == series.stamp_s.size and np.array_equal(clock, series.stamp_s):
        return _held(series.value, good)
    stamp, value = series.stamp_s[good], series.value[good]
    at = np.searchsorted(stamp, clock + 0.01 * dt_s, side="right") - 1
    own = max(interval(stamp), dt_s) if stamp.size > 1 else dt_s
    age = clock - stamp[np.maximum(at, 0)]
    lost = np.zeros(clock.size, dtype=bool)
    raw = np.clip(np.searchsorted(series.stamp_s, clock + 0.01 * dt_s, side="right") - 1, 0, None)
    lost |= ~good[raw] & (np.abs(clock - series.stamp_s[raw]) < 0.5 * dt_s)
    return value[np.maximum(at, 0)], (at < 0) | (age > limits.gap_factor * own) | lost


def _held(value: Floats, good: Mask) -> tuple[Floats, Mask]:
    if good.all():
        return value, ~good
    at = np.maximum.accumulate(np.where(good, np.arange(value.size), -1))
    return value[np.where(at < 0, int(np.argmax(good)), at)], ~good


def run_lengths(value: Floats) -> np.ndarray:
    """Length of each run of equal values."""
    first = np.flatnonzero(np.concatenate(([True], value[1:] != value[:-1])))
    return np.diff(np.concatenate((first, [value.size])))


def constant_stretches(value: Floats, dt_s: float, seconds: float, samples: int) -> Mask:
    """True where a value stands unchanged for so long and so many samples, shape (n,)."""
    length = run_lengths(value)
    enough = (length >= samples) & (length * dt_s >= seconds)
    return np.repeat(enough, length)


def straight(value: Floats) -> Mask:
    """True where a sample lies on the line between its neighbours while the trend moves, shape (n,).

    Swinging-door compression leaves straight, sloping segments; steps of a coarse resolution and constants
    are straight too, but level.
    """
    out = np.zeros(value.size, dtype=bool)
    if value.size < 3:
        return out
    rise = np.diff(value)
    scale = np.abs(rise).max() * 1e-4
    out[1:-1] = (np.abs(np.diff(rise)) <= np.maximum(scale, 1e-3 * np.abs(rise[:-1]))) & (
        np.abs(rise[:-1]) > 0
    )
    return out


def resolution(value: Floats) -> float:
    """The step of the grid that values stand on, in their unit; 0 where there is none.

    The smallest difference between values that occur; a grid is told by over ten samples a level.
    """
    levels = np.unique(value[:20000])
    if levels.size < 2 or levels.size * 10 > min(value.size, 20000):
        return 0.0
    return float(np.median(np.diff(levels)))


def scale_of(spec: LoopSpec, pv: Floats) -> Scale:
    """What percent means: the stated ranges, else the recorded range of PV and 0 to 100 for OP."""
    op_low = spec.op_lo if spec.op_lo is not None else 0.0
    op_high = spec.op_hi if spec.op_hi is not None else 100.0
    if spec.pv_lo is not None and spec.pv_hi is not None:
        return Scale(spec.pv_lo, spec.pv_hi - spec.pv_lo, op_low, op_high - op_low, False)
    low, high = (float(q) for q in np.quantile(pv, RECORDED_RANGE))
    return Scale(low, high - low if high > low else 1.0, op_low, op_high - op_low, True)


def manual_mask(
    mode: Series | None, clock: Floats, dt_s: float, op: Floats, error: Floats, q: QualityLimits
) -> Mask:
    """True where the controller is in manual: by its mode, else where OP stands still while the error moves."""
    if mode is not None:
        found = _mode_mask(mode, clock)
        if found is not None:
            return found
    still = constant_stretches(op, dt_s, q.manual_s, q.manual_samples)
    if not still.any() or float(np.std(error[still])) <= 1e-9:
        return np.zeros(op.size, dtype=bool)
    return still


def _mode_mask(mode: Series, clock: Floats) -> Mask | None:
    at = np.clip(np.searchsorted(mode.stamp_s, clock, side="right") - 1, 0, None)
    if mode.text is not None:
        texts = np.array([str(t).strip().lower() for t in mode.text], dtype=object)
        known = np.isin(texts, MANUAL_TEXTS) | np.isin(texts, AUTOMATIC_TEXTS)
        return np.isin(texts, MANUAL_TEXTS)[at] if known.any() else None
    if mode.bad.all():
        return None
    return (mode.value == 0)[at] & ~mode.bad[at]


def _clock(pv: Series, dt_s: float, limits: QualityLimits) -> Floats:
    """PV's own stamps where they are uniform, else a uniform clock over them.

    Raises
    ------
    LacksError
        The samples are spread so thinly that most of that clock would be gaps.
    """
    spacing = np.diff(pv.stamp_s)
    if spacing.size and float(np.max(np.abs(spacing - dt_s))) <= 0.01 * dt_s:
        return pv.stamp_s
    count = int((pv.stamp_s[-1] - pv.stamp_s[0]) / dt_s + 1e-6) + 1
    if count > limits.ticks_per_sample * pv.stamp_s.size:
        share = 100 * pv.stamp_s.size / count
        text = (
            f"needs samples that follow each other, has {pv.stamp_s.size}, mostly {dt_s:g} s apart, spread over "
            f"{(pv.stamp_s[-1] - pv.stamp_s[0]) / 86400:.1f} days ({share:.1f} % of that time)"
        )
        raise LacksError(Needs(Lack.SAMPLES, text))
    return pv.stamp_s[0] + dt_s * np.arange(count)


def _enough(pv: Series | None, spec: LoopSpec, limits: QualityLimits) -> Series:
    if pv is None:
        raise LacksError(Needs(Lack.PV, f"no PV tag {spec.pv or spec.loop + '.PV'} in the export"))
    good = int((~pv.bad).sum())
    if pv.stamp_s.size == 0 or good == 0:
        raise LacksError(Needs(Lack.SAMPLES, "needs PV samples, has none that is good"))
    if good < limits.samples:
        raise LacksError(Needs(Lack.SAMPLES, f"needs {limits.samples} good PV samples, has {good}"))
    return pv


def prepare(spec: LoopSpec, series: Mapping[str, Series], limits: QualityLimits) -> Prepared:
    """One loop's raw samples on one clock, with masks.

    Parameters
    ----------
    spec : LoopSpec
        With the tags that the export has.
    series : mapping of tag to Series
    limits : QualityLimits

    Raises
    ------
    LacksError
        Where there is no PV, or too little of it; the text says what is needed and what there is.
    """
    series = _numeric(spec, series, limits)
    pv_raw = _enough(series.get(spec.pv or ""), spec, limits)
    trimmed = _without_stray_ends(pv_raw)
    dt = interval(trimmed.stamp_s)
    if not dt > 0:
        raise LacksError(Needs(Lack.SAMPLES, "needs samples at different times, has one stamp"))
    clock = _clock(trimmed, dt, limits)
    pv, gap = onto_clock(trimmed, clock, dt, limits)
    scale = scale_of(spec, pv[~gap])
    pv = scale.pv_pct(pv)
    op, op_gap = _signal(series, spec.op, clock, dt, limits)
    sp, sp_gap = _signal(series, spec.sp, clock, dt, limits)
    sp_known = spec.sp is not None and not sp_gap.all()
    sp = scale.pv_pct(sp) if sp_known else np.full(clock.size, float(np.median(pv[~gap])))
    op = scale.op_pct(op) if spec.op and not op_gap.all() else np.full(clock.size, math.nan)
    position, _ = _signal(series, spec.position, clock, dt, limits)
    has_position = bool(spec.position and spec.position in series)
    masks = _masks(spec, series, limits, clock, dt, pv, sp, op, gap | (op_gap if spec.op else False))
    record = LoopRecord(
        spec.loop,
        float(clock[0]),
        dt,
        sp,
        pv,
        op if np.isfinite(op).all() else np.zeros(clock.size),
        masks["gap"] | masks["stale"],
        scale.op_pct(position) if has_position else None,
        not sp_known,
        MappingProxyType(masks),
    )
    return _described(record, scale, op, limits)


def _numeric(spec: LoopSpec, series: Mapping[str, Series], limits: QualityLimits) -> dict[str, Series]:
    """The samples of a loop, what is no number in SP, PV, OP or position bad.

    Raises
    ------
    LacksError
        Where many values of one of them were not understood: what is left would be another trend.
    """
    out = dict(series)
    for role in ("pv", "sp", "op", "position"):
        tag = getattr(spec, role)
        found = series.get(tag) if tag else None
        if found is None:
            continue
        if found.unread > limits.unread_share * max(found.value.size, 1):
            text = (
                f"{found.unread} values of {tag}, such as '{found.example}', are not understood as numbers; needs "
                "plain numbers: export them so, or state --decimal and --delimiter"
            )
            raise LacksError(Needs(Lack.READABLE, text))
        out[tag] = replace(found, bad=found.bad | ~np.isfinite(found.value), text=None)
    return out


def _signal(
    series: Mapping[str, Series], tag: str | None, clock: Floats, dt: float, limits: QualityLimits
) -> tuple[Floats, Mask]:
    found = series.get(tag) if tag else None
    if found is None:
        return np.zeros(clock.size), np.ones(clock.size, dtype=bool)
    return onto_clock(found, clock, dt, limits)


def _without_stray_ends(pv: Series) -> Series:
    """PV from its first to its last good sample, those far from the rest left out."""
    stamp = pv.stamp_s[~pv.bad]
    span = main_span(stamp)
    if span.stray:
        inside = slice(*np.searchsorted(pv.stamp_s, [span.first_s, np.nextafter(span.last_s, np.inf)]))
        pv = Series(pv.stamp_s[inside], pv.value[inside], pv.bad[inside])
    good = np.flatnonzero(~pv.bad)
    if good[0] == 0 and good[-1] == pv.bad.size - 1:
        return pv
    cut = slice(int(good[0]), int(good[-1]) + 1)
    return Series(pv.stamp_s[cut], pv.value[cut], pv.bad[cut])


def op_in_range(op: Floats, q: QualityLimits) -> bool:
    """Whether OP can be in percent of its stated range.

    It cannot where it leaves the range, nor where it moves freely within a band beside a limit and never rests
    on the limit itself, as outputs do that were recorded from 0 to 1 or as deviations.
    """
    low, high = float(op.min()), float(op.max())
    if low < -q.outside_pct or high > 100 + q.outside_pct:
        return False
    beside = high <= q.limit_pct or low >= 100 - q.limit_pct
    resting = max(float((op == low).mean()), float((op == high).mean()))
    return not (beside and resting < 0.2)


def _masks(
    spec: LoopSpec,
    series: Mapping[str, Series],
    q: QualityLimits,
    clock: Floats,
    dt: float,
    pv: Floats,
    sp: Floats,
    op: Floats,
    gap: Mask,
) -> dict[str, Mask]:
    none = np.zeros(clock.size, dtype=bool)
    known_op = bool(np.isfinite(op).all())
    stale = constant_stretches(pv, dt, q.stale_s, q.stale_samples) & ~gap
    if stale.any() and (not known_op or float(np.ptp(op[stale])) == 0.0):
        stale = none
    ranged = known_op and op_in_range(op, q)
    saturated = (op <= q.limit_pct) | (op >= 100 - q.limit_pct) if ranged else none
    mode = series.get(spec.mode or "")
    manual = manual_mask(mode, clock, dt, op, sp - pv, q) if known_op else none
    coarse = none if resolution(pv) == 0 else np.ones(clock.size, dtype=bool)
    return {
        "gap": gap,
        "stale": stale,
        "compressed": straight(pv),
        "quantized": coarse,
        "saturated": saturated,
        "manual": manual & ~saturated if mode is None else manual,
    }


def _described(record: LoopRecord, scale: Scale, op: Floats, limits: QualityLimits) -> Prepared:
    known_op = bool(np.isfinite(op).all())
    compressed = float(record.mask("compressed").mean())
    notes = []
    if scale.recorded:
        notes.append("no PV range stated: percent of the recorded range")
    if record.sp_estimated:
        notes.append("no SP recorded: estimated as the median of PV")
    if not known_op:
        notes.append("no OP recorded: no cause can be told")
    elif not op_in_range(op, limits):
        notes.append("OP does not fit its stated range: its limits are not known")
    for name in ("gap", "stale", "saturated", "manual"):
        share = float(record.mask(name).mean())
        if share > 0.005:
            notes.append(f"{name} {100 * share:.0f} % of the time")
    if compressed > 0.3:
        notes.append(f"compressed: {100 * compressed:.0f} % of the samples lie on straight segments")
    step = resolution(record.pv)
    op_step = resolution(record.op) if known_op else 0.0
    if step > 0:
        notes.append(f"PV on a grid of {step:.3g} % of span")
    return Prepared(record, scale, step, op_step, compressed, tuple(notes), known_op)
