"""Simulated effect of settings: all on the same load, and a change of tuning with intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from identification.models import Backlash, Estimate, Integrator, Loop, Pid
from identification.record import Floats, LoopRecord
from identification.signals.correlation import lag_sums
from identification.simulation.closed_loop import closed_loop, scan_step
from tuning.describing import band
from tuning.frequency_response import integral_s, maximum_sensitivity, rejects_s, slowest_s
from tuning.limit_cycle import kick_of
from tuning.rules import backlash_rule, lambda_settings, simc

PRELUDE = 6.0  # Length of the time between kick and record over the loop's slowest time
LEAST_PRELUDE = 300  # The same at least [scans]
WARM_UP = 0.1  # Share of a simulated record that is left out at its start
BLOCKS = 12
"""Blocks that a simulated record is cut into for the bootstrap: a block holds cycles enough to be counted."""
UNMODELLED = 0.05
"""Standard deviation of the logarithm of a forecast figure from what no fitted model contains: in 45 of 46
loops of benchmarks/world (seeds 591, 592) the simulated present has the recorded error within 10 %, in the
median within 3 %."""
DRAWS = 200  # Bootstrap draws over all loops together

DIGITS = 6
"""Digits of a model's constants, and decimals of a load [% PV], used in simulation: a cycle behind backlash or
stick-slip amplifies a rounding error, and otherwise the thirteenth digit would choose between equally good
settings."""
SEED = 0
NOW, RECOMMENDED, SIMC, LAMBDA, LONGER = "now", "recommended", "SIMC", "lambda", "Ti not below T"
CALMER, SMALLER, DERIVATIVE, REPAIRED = (
    "calmer valve",
    "smaller error",
    "with derivative",
    "now, valve repaired",
)
"""Names of the compared settings; the last is the result of a repair."""


class Assessed(NamedTuple):
    """Assessments of one simulated stretch.

    average_absolute_error [% PV], stem_travel and op_travel [%/h], variability [% PV] (2 sigma of the error),
    oscillation [% PV]: amplitude of the sine with the error's power, times the first peak of its
    autocorrelation; near 0 for noise, the amplitude for a clean cycle.
    """

    average_absolute_error: float
    stem_travel: float
    op_travel: float
    oscillation: float
    variability: float


UNITS = {"stem_travel": "%/h", "op_travel": "%/h"}
NAMES = Assessed._fields


@dataclass(frozen=True, slots=True)
class Forecast:
    """Both tunings on the same load, by assessment name.

    before, after [unit of the assessment], and change = after/before - 1 [-], each with its 90 % interval over blocks
    of the load and over the uncertainty samples.
    """

    before: dict[str, Estimate]
    after: dict[str, Estimate]
    change: dict[str, Estimate]


def in_digits(load: Floats) -> Floats:
    """A load rounded for simulation, shape (n,) [% PV]."""
    return np.ascontiguousarray(np.round(load, DIGITS))


def loop_in_digits(loop: Loop) -> Loop:
    """The loop with its constants rounded to the digits that are known."""

    def rounded(x: float) -> float:
        return float(f"{x:.{DIGITS}g}")

    process, valve = type(loop.process)(*map(rounded, astuple(loop.process))), loop.valve
    if isinstance(valve, Backlash):
        valve = Backlash(rounded(valve.width))
    elif valve is not None:
        valve = replace(valve, stickband=rounded(valve.stickband), slip_jump=rounded(valve.slip_jump))
    return replace(loop, process=process, valve=valve)


def run(loop: Loop, load: Floats) -> LoopRecord:
    """The loop at a constant set point of 0 under a load on the controller's clock, shape (n,) [% PV].

    OP rests in the middle of the controller's range. Without integral action the bias of OP compensates the mean of
    the load, as an operator sets it. A loop with a faulty valve gets one kick before the record begins: a plant that
    cycles is in its large cycle. From rest a small load would not leave the backlash, and a sticking stem may remain
    in a smaller cycle that it reaches from rest alone.
    """
    c, off = loop.controller, math.isinf(integral_s(loop.controller))
    if off and load.size:
        load = in_digits(load - load.mean())
    before = np.concatenate((np.zeros(int(off)), _prelude(loop, load)))  # it begins with OP at its bias
    whole = np.concatenate((before, load))
    record = closed_loop(loop, np.zeros(whole.size), whole, op_start=0.5 * (c.op_lo + c.op_hi))
    return record.span(before.size, whole.size)


def _prelude(loop: Loop, load: Floats) -> Floats:
    """The load's first value, a kick for a while, and the first value again [% PV]; empty without a faulty valve."""
    width = band(loop.valve)
    if width <= 0.0 or load.size == 0:
        return np.empty(0)
    hold = int(min(max(PRELUDE * slowest_s(loop) / scan_step(loop), LEAST_PRELUDE), load.size))
    return load[0] + kick_of(loop, width) * np.repeat([0.0, 1.0, 0.0], [1, hold // 2, hold])


def autocorrelation_peak(error: Floats) -> float:
    """Height of the first peak of the autocorrelation after its first zero, at least 0; 0 for constants.

    error of shape (n,) [% PV]; the estimate is biased towards 0 at long lags, which favours several periods.
    """
    x = error - error.mean()
    power = float(x @ x)
    if x.size < 8 or power <= 1e-18:
        return 0.0
    r = lag_sums(x, x.size - 1) / power
    below = np.flatnonzero(r < 0)
    if below.size == 0:
        return 0.0
    return float(max(r[below[0] :].max(), 0.0))


def assess(record: LoopRecord) -> Assessed:
    """Assessments of a simulated record."""
    e = record.error
    hours = record.duration_s / 3600.0
    sigma = float(np.std(e))
    return Assessed(
        average_absolute_error=float(np.mean(np.abs(e))),
        stem_travel=float(np.abs(np.diff(record.stem)).sum()) / hours,
        op_travel=float(np.abs(np.diff(record.op)).sum()) / hours,
        oscillation=float(np.sqrt(2.0)) * sigma * autocorrelation_peak(e),
        variability=2.0 * sigma,
    )


def settled(record: LoopRecord) -> LoopRecord:
    """A simulated record without its warm-up."""
    return record.span(int(WARM_UP * len(record)), len(record))


def _blocks(record: LoopRecord) -> Floats:
    """Assessments of each block, shape (blocks, number of assessments)."""
    edges = np.linspace(0, len(record), BLOCKS + 1).astype(int)
    return np.array([assess(record.span(int(a), int(b))) for a, b in pairwise(edges)])


def _estimates(value: Floats, draws: Floats, units: bool = True) -> dict[str, Estimate]:
    low, high = np.quantile(draws, [0.05, 0.95], axis=0)
    return {
        n: Estimate(
            float(value[k]),
            float(min(low[k], value[k])),
            float(max(high[k], value[k])),
            UNITS.get(n, "% of span") if units else "",
        )
        for k, n in enumerate(NAMES)
    }


def predict(
    loop: Loop,
    controller: Pid,
    load: Floats,
    uncertainty: Sequence[Loop] = (),
    indistinguishable: Sequence[tuple[Loop, Floats]] = (),
    unmodelled: float = UNMODELLED,
) -> Forecast:
    """The present and a new controller on the same load, on the identified loop and on its uncertainty samples, with
    intervals for another stretch of the same length and kind of load.

    The load, shape (n,), and noise add to PV on the controller's clock [% PV]; ValueError for fewer than ten scans a
    block. `uncertainty`, other loops consistent with the data, and `indistinguishable`, others with a load of their
    own: their controllers are not used. Blocks do not overlap (Kunsch 1989). The load of the coming stretch scatters
    about the mean as that of the recorded one does, so both are drawn; models are uncertain by `unmodelled`, of the
    logarithm of a figure, beyond their samples.
    """
    if load.size < 10 * BLOCKS:
        raise ValueError(f"a forecast needs {10 * BLOCKS} scans of load, has {load.size}")
    rng = np.random.default_rng(SEED)
    cases = [(one, load) for one in (loop, *uncertainty)] + list(indistinguishable)
    old, new = (
        [
            _blocks(settled(run(loop_in_digits(replace(one, controller=pid)), in_digits(x))))
            for one, x in cases
        ]
        for pid in (loop.controller, controller)
    )
    first, second = old[0].mean(axis=0), new[0].mean(axis=0)
    unmodelled = 0.0 if controller == loop.controller else unmodelled
    before, after = [], []
    for b, a in zip(old, new, strict=True):
        for _ in range(max(DRAWS // len(cases), 20)):
            mean, coming = rng.integers(0, BLOCKS, (2, BLOCKS))
            off = np.exp(unmodelled * rng.standard_normal(len(NAMES)))
            before.append(b[mean].mean(axis=0) * _ratio(old[0][coming].mean(axis=0), first))
            after.append(a[mean].mean(axis=0) * _ratio(new[0][coming].mean(axis=0), second) * off)
    return Forecast(
        _estimates(first, np.array(before)),
        _estimates(second, np.array(after)),
        _estimates(_ratio(second, first) - 1.0, _ratio(np.array(after), np.array(before)) - 1.0, units=False),
    )


def _ratio(after: Floats, before: Floats) -> Floats:
    """after/before [-], 1 where nothing was before; any shape."""
    nothing = before <= 1e-12
    return np.where(nothing, 1.0, after / np.where(nothing, 1.0, before))


@dataclass(frozen=True, slots=True)
class Tried:
    """One pair of settings on the load.

    controller; ms, maximum sensitivity [-], inf where the linear loop is unstable; stem_travel [%/h]; error, average
    absolute error [% PV]; peak, its maximum [% PV]; integral_s, Ti/|Kp| [s], integral of the error after a step of
    the load at OP, inf without integral action; record, the simulation without its warm-up.
    """

    name: str
    controller: Pid
    ms: float
    stem_travel: float
    error: float
    peak: float
    integral_s: float
    record: LoopRecord = field(repr=False, compare=False)


def alternatives(loop: Loop, new: Pid | None, chosen: Mapping[str, Pid] | None = None) -> dict[str, Pid]:
    """Settings to compare: the present ones, the recommended ones if any, those of `chosen`, and those of the rules,
    without duplicates. All have the present derivative, except chosen settings with their own."""
    now, h = loop.controller, scan_step(loop)
    found = {NOW: now} | ({} if new is None else {RECOMMENDED: new}) | dict(chosen or {})
    if now.kp == 0.0:  # no rule is for an integral alone
        return found
    rules = {SIMC: simc(loop.process, scan_s=h), LAMBDA: lambda_settings(loop.process, h)}
    found |= {name: replace(now, kp=pid.kp, ti_s=pid.ti_s) for name, pid in rules.items()}
    if not isinstance(loop.process, Integrator):
        found[LONGER] = backlash_rule(loop.process, now)
    seen: dict[tuple[str, ...], str] = {}
    for name, pid in found.items():
        seen.setdefault(tuple(f"{x:.3g}" for x in (pid.kp, pid.ti_s, pid.td_s)), name)
    return {name: found[name] for name in seen.values()}


def tried(loop: Loop, load: Floats, settings: Mapping[str, Pid]) -> tuple[Tried, ...]:
    """Simulate settings in order on a loop under a load on the controller's clock [% PV], shape (n,)."""
    found = []
    for name, pid in settings.items():
        one = replace(loop, controller=pid)
        record = settled(run(one, load))
        did, peak = assess(record), float(np.max(np.abs(record.error), initial=0.0))
        known = maximum_sensitivity(one), did.stem_travel, did.average_absolute_error, peak
        found.append(Tried(name, pid, *known, rejects_s(pid), record))
    return tuple(found)
