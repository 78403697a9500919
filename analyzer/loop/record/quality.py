"""From raw stamps to one clock: masks of unusable samples, set before any analysis.

Masks are determined on the raw stamps, where a gap, a frozen value or a compressed stretch is still visible, and
carried onto the clock of the loop's record.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from analyzer.config import QualityLimits
from analyzer.history.series import Series
from analyzer.loop.decisions import LacksError, MissingData, Requirement, RequirementKind
from analyzer.loop.record.sample_clock import (
    archived_share,
    clock_of,
    collinear,
    constant_stretches,
    interval,
    onto_clock,
    resolution,
    without_stray_ends,
)
from analyzer.loop.record.shared_valve import Shared, half, selected
from analyzer.loops.gain_schedule import in_force
from analyzer.loops.spec import STATED, LoopSpec
from identification.controller.check import runs
from identification.controller.pi_regression import feedback_share
from identification.experiments.find import in_manual
from identification.limits import LIMITS
from identification.record import Floats, LoopRecord, Mask

MOVING = 0.3
"""Share of samples at which OP moves, from which no operator and no script moves it: a random sequence
switches every fifth sample at most."""
BEYOND_GAP = 1.1
"""Error from which a constant OP is not within the gap of its controller [gaps]: rounding, and noise on
PV."""

RECORDED_RANGE = (0.005, 0.995)
"""Quantiles of PV that give its span if none is stated; contract of loops.csv."""
MODES: Mapping[str, list[str]] = STATED["modes"]
"""Mode texts, lower case, of modes in which the controller does not move OP, or does."""


@dataclass(frozen=True, slots=True)
class Scale:
    """Ranges of a loop's signals: the meaning of percent.

    low, span : PV range in the tag's own unit; op_low, op_span : range of OP; recorded : True if the PV range was
    taken from the record because none is stated.
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
    """A record with its scale, the resolution of its trends and sentences about its quality.

    pv_step : resolution of PV [% of span], 0 if none was found; compressed_share : share of samples on straight
    segments [-]; op_known : False if no OP was recorded; op_scaled : False if the recorded OP cannot be in percent of
    its stated or assumed range; archived_share : share of samples that a compressing historian kept [-], the smaller
    of PV and OP; shared : the loop's part of a valve that it shares, None if it has its own valve; gain_share :
    factor of Kp by the schedule of the gain in most of the record, 1 without a schedule [-].
    """

    record: LoopRecord
    scale: Scale
    pv_step: float
    compressed_share: float
    notes: tuple[str, ...]
    op_known: bool = True
    op_scaled: bool = True
    archived_share: float = 1.0
    shared: Shared | None = None
    gain_share: float = 1.0


def scale_of(spec: LoopSpec, pv: Floats) -> Scale:
    """Ranges of a loop: the stated ones, else the recorded range of PV and 0 to 100 for OP."""
    op_low = spec.op_lo if spec.op_lo is not None else 0.0
    op_high = spec.op_hi if spec.op_hi is not None else 100.0
    if spec.pv_lo is not None and spec.pv_hi is not None:
        return Scale(spec.pv_lo, spec.pv_hi - spec.pv_lo, op_low, op_high - op_low, False)
    low, high = (float(q) for q in np.quantile(pv, RECORDED_RANGE))
    return Scale(low, high - low if high > low else 1.0, op_low, op_high - op_low, True)


def _trimmed(pv: Series | None, spec: LoopSpec, limits: QualityLimits) -> tuple[Series, float]:
    """PV between its first and last good sample, and the interval of its samples [s]."""
    if pv is None:
        raise LacksError(Requirement(MissingData.PV, RequirementKind.PV_TAG, (spec.pv or f"{spec.loop}.PV",)))
    good = int((~pv.bad).sum())
    if good == 0:
        raise LacksError(Requirement(MissingData.SAMPLES, RequirementKind.GOOD_PV))
    if good < limits.samples:
        raise LacksError(Requirement(MissingData.SAMPLES, RequirementKind.MORE_PV, (limits.samples, good)))
    trimmed = without_stray_ends(pv)
    dt = interval(trimmed.stamp_s)
    if not dt > 0:
        raise LacksError(Requirement(MissingData.SAMPLES, RequirementKind.STAMPS))
    return trimmed, dt


def prepare(spec: LoopSpec, series: Mapping[str, Series], limits: QualityLimits) -> Prepared:
    """One loop's raw samples on one clock, with masks; the spec has the tags that the export has. Raises LacksError
    if PV is missing or too short; the text gives the requirement and the available data."""
    series = _numeric(spec, series, limits)
    trimmed, dt = _trimmed(series.get(spec.pv or ""), spec, limits)
    clock = clock_of(trimmed, dt, limits)
    pv, gap = onto_clock(trimmed, clock, dt, limits)
    scale = scale_of(spec, pv[~gap])
    pv = scale.pv_pct(pv)
    op, op_gap = _signal(series, spec.op, clock, dt, limits)
    sp, sp_gap = _signal(series, spec.sp, clock, dt, limits)
    sp_known = spec.sp is not None and not sp_gap.all()
    sp = scale.pv_pct(sp) if sp_known else np.full(clock.size, float(np.median(pv[~gap])))
    op_known = bool(spec.op) and not op_gap.all() and bool(np.isfinite(scale.op_pct(op)).all())
    position, _ = _signal(series, spec.position, clock, dt, limits)
    has_position = bool(spec.position and spec.position in series)
    feed, no_feed = _signal(series, spec.feed, clock, dt, limits)
    record = LoopRecord(
        spec.loop,
        float(clock[0]),
        dt,
        sp,
        pv,
        scale.op_pct(op) if op_known else np.zeros(clock.size),
        gap | op_gap if spec.op else gap,
        scale.op_pct(position) if has_position else None,
        not sp_known,
        feed=None if no_feed.all() else feed,
    )
    share, gain_share = _scheduled(spec, record, scale)
    record = replace(record, gain_share=gain_share)
    step = resolution(pv)
    masked = _masked(record, clock, series.get(spec.mode or ""), op_known, step, limits)
    if spec.gap and spec.mode is None:
        manual = beyond_gap(masked.mask("manual"), masked.error, 100.0 * spec.gap / scale.span)
        masked = replace(masked, masks=MappingProxyType({**masked.masks, "manual": manual}))
    other = spec.partner_output.tag if spec.partner_output is not None else None
    shared = _shared(masked, spec, _signal(series, other, clock, dt, limits), limits)
    if shared is not None:
        saturated = masked.mask("saturated") & ~shared.idle  # an idle loop has no limit
        masks = {**masked.masks, "saturated": saturated, "idle": shared.idle}
        masked = replace(masked, masks=MappingProxyType(masks))
    described = _described(masked, scale, op_known, spec.in_ma, step, limits)
    return replace(described, shared=shared, gain_share=share)


def _scheduled(spec: LoopSpec, record: LoopRecord, scale: Scale) -> tuple[float, Floats | None]:
    """Factor of Kp by the stated schedule in most of a record, and its factor at each sample over that one; None
    where it is constant. The last OP decides on its own next move."""
    schedule = spec.schedule
    if schedule is None:
        return 1.0, None
    low, span = (scale.op_low, scale.op_span) if schedule.over == "op" else (scale.low, scale.span)
    signal = low + span * getattr(record, schedule.over) / 100.0
    share = schedule.share(np.concatenate((signal[:1], signal[:-1])) if schedule.over == "op" else signal)
    most = in_force(share, ~record.bad)
    return most, None if np.ptp(share) == 0.0 else share / most


def _shared(
    record: LoopRecord, spec: LoopSpec, other: tuple[Floats, Mask], limits: QualityLimits
) -> Shared | None:
    """The loop's part of a shared valve; other, the other controller's output in its own unit."""
    if spec.partner_output is None or spec.op is None or other[1].all():
        return None
    output = (
        100.0 * (other[0] - spec.partner_output.low) / (spec.partner_output.high - spec.partner_output.low)
    )
    found = selected if spec.override_with else half
    return found(record, output, other[1], limits)


def _numeric(spec: LoopSpec, series: Mapping[str, Series], limits: QualityLimits) -> dict[str, Series]:
    """The samples of a loop; values of SP, PV, OP or position that are no number are bad. Raises LacksError if many
    values of one of them are unreadable: the remaining ones would be a different trend."""
    out = dict(series)
    for role in ("pv", "sp", "op", "position"):
        tag = getattr(spec, role)
        found = series.get(tag) if tag else None
        if found is None:
            continue
        if found.unread > limits.unread_share * max(found.value.size, 1):
            raise LacksError(
                Requirement(MissingData.READABLE, RequirementKind.NUMBERS, (found.unread, tag, found.example))
            )
        out[tag] = replace(found, bad=found.bad | ~np.isfinite(found.value), text=None)
    return out


def _signal(
    series: Mapping[str, Series], tag: str | None, clock: Floats, dt: float, limits: QualityLimits
) -> tuple[Floats, Mask]:
    found = series.get(tag) if tag else None
    if found is None:
        return np.zeros(clock.size), np.ones(clock.size, dtype=bool)
    return onto_clock(found, clock, dt, limits)


def op_in_range(op: Floats, q: QualityLimits) -> bool:
    """Whether OP can be in percent of its stated range.

    It cannot if it leaves the range, or if it moves freely within a band near a limit and does not stay at the limit
    itself, as outputs recorded from 0 to 1 or as deviations do.
    """
    low, high = float(op.min()), float(op.max())
    if low < -q.outside_pct or high > 100 + q.outside_pct:
        return False
    resting = float((np.minimum(np.abs(op), np.abs(op - 100)) <= q.on_limit_pct).mean())
    near_limit = high <= q.limit_pct or low >= 100 - q.limit_pct
    return not near_limit or low == high or resting >= q.resting_share


def _masked(
    record: LoopRecord, clock: Floats, mode: Series | None, op_known: bool, pv_step: float, q: QualityLimits
) -> LoopRecord:
    """The record with its masks; its bad samples are its gaps."""
    op, gap, none = record.op, record.bad, np.zeros(clock.size, dtype=bool)
    stale = constant_stretches(record.pv, record.dt_s, q.stale_s, q.stale_samples) & ~gap
    ranged = op_known and op_in_range(op, q)
    saturated = (op <= q.limit_pct) | (op >= 100 - q.limit_pct) if ranged else none
    held = stale.any() and (not op_known or float(np.ptp(op[stale])) == 0.0)
    if held and not _driven_to_limit(record, stale, saturated, q):
        stale = none
    by_script = mode is None and op_known and moved_by_script(record)
    if by_script:  # OP at 0 before and after a test is at no limit
        saturated = none
    manual = ~none if by_script else _manual(mode, clock, record, q) if op_known else none
    masks = {
        "gap": gap,
        "stale": stale,
        "compressed": collinear(record.pv),
        "quantized": none if pv_step == 0 else np.ones(clock.size, dtype=bool),
        "saturated": saturated,
        "manual": manual & ~saturated if mode is None else manual,
    }
    return replace(record, bad=gap | stale, masks=MappingProxyType(masks))


def _driven_to_limit(record: LoopRecord, stale: Mask, saturated: Mask, q: QualityLimits) -> bool:
    """Whether OP is constant because a frozen PV has driven it to its limit: PV is constant for long, away from its
    set point and from the ends of its own range, at which a transmitter is constant too."""
    off = float(np.abs(record.error[stale]).min())
    within = q.frozen_ends_pct < float(record.pv[stale].min()) < 100.0 - q.frozen_ends_pct
    long = float(stale.sum()) * record.dt_s >= q.frozen_s
    return (
        bool(saturated[stale].all())
        and long
        and within
        and off > q.frozen_ends_pct
        and not record.sp_estimated
    )


def moved_by_script(record: LoopRecord) -> bool:
    """Whether an operator or a script moves OP over the whole record: no SP is recorded, and OP, mostly constant,
    does not respond to PV."""
    op = record.op
    constant = record.sp_estimated and float(np.mean(np.diff(op) != 0.0)) < MOVING
    if not constant or not in_manual(record, np.ones(op.size, dtype=bool)):
        return False
    return feedback_share(op, record.pv) < LIMITS.controller.feedback


def _manual(mode: Series | None, clock: Floats, record: LoopRecord, q: QualityLimits) -> Mask:
    """True where the controller is in manual: by its mode, else where OP is constant while the error moves."""
    found = None if mode is None else _mode_mask(mode, clock)
    if found is not None:
        return found
    still = constant_stretches(record.op, record.dt_s, q.manual_s, q.manual_samples)
    moves = still.any() and float(np.std(record.error[still])) > 1e-9
    return still if moves else np.zeros(still.size, dtype=bool)


def beyond_gap(manual: Mask, error: Floats, gap: float) -> Mask:
    """The spans of a mask, shape (n,), in which the error [% PV] leaves a gap: within the gap OP of a controller in
    automatic is constant too."""
    out = manual.copy()
    for first, last in runs(manual):
        out[first:last] = float(np.abs(error[first:last]).max()) > BEYOND_GAP * gap
    return out


def _mode_mask(mode: Series, clock: Floats) -> Mask | None:
    at = np.clip(np.searchsorted(mode.stamp_s, clock, side="right") - 1, 0, None)
    if mode.text is not None:
        texts = np.array([str(t).strip().lower() for t in mode.text], dtype=object)
        manual = np.isin(texts, MODES["manual"])
        return manual[at] if (manual | np.isin(texts, MODES["automatic"])).any() else None
    if mode.bad.all():
        return None
    return (mode.value == 0)[at] & ~mode.bad[at]


def op_range(scale: Scale, op: Floats) -> Requirement:
    """The range to state if OP [% of the range assumed] cannot be percent of that range."""
    low, high = (scale.op_low + 0.01 * scale.op_span * float(x) for x in (op.min(), op.max()))
    return Requirement(
        MissingData.OP_RANGE,
        RequirementKind.OP_RANGE,
        (low, high, scale.op_low, scale.op_low + scale.op_span),
    )


def _described(
    record: LoopRecord, scale: Scale, op_known: bool, in_ma: bool, pv_step: float, limits: QualityLimits
) -> Prepared:
    compressed = float(record.mask("compressed").mean())
    notes = []
    if scale.recorded:
        notes.append("no PV range stated: percent of the recorded range")
    if record.sp_estimated:
        notes.append("no SP recorded: estimated as the median of PV")
    if not op_known:
        notes.append("no OP recorded: no cause can be identified")
    op_scaled = not op_known or (op_in_range(record.op, limits) and not in_ma)
    if not op_scaled:
        notes.append(str(op_range(scale, record.op)))
    for name in ("gap", "stale", "saturated", "manual", "idle"):
        share = float(record.mask(name).mean())
        if share > 0.005:
            notes.append(f"{name} {100 * share:.0f} % of the time")
    if compressed > 0.3:
        notes.append(f"compressed: {100 * compressed:.0f} % of the samples lie on straight segments")
    if pv_step > 0:
        notes.append(f"PV on a grid of {pv_step:.3g} % of span")
    archived = min(archived_share(x) for x in ((record.pv, record.op) if op_known else (record.pv,)))
    return Prepared(record, scale, pv_step, compressed, tuple(notes), op_known, op_scaled, archived)
