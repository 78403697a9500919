"""Effect of a change under equal load: the loops of before and after, each simulated under the loads of both weeks.

A night stores the spectrum of its error, the identified process and the settings in force. The load of a night is
that spectrum over the loop's sensitivity (e = S d); with it any settings and any valve can be simulated under the
same load, which separates the effect of settings from that of the load.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analyzer.comparison.block_bootstrap import Floats
from analyzer.comparison.loop_night import LoopNight, night_of, pid_of
from analyzer.comparison.shared_process import Spectra, shared_process
from analyzer.config import ComparisonLimits, FigureLimits
from analyzer.loop.oscillation.figures import travel_of
from identification.models import Backlash, Fopdt, Loop, Pid, Stiction, Valve
from identification.signals.robust import robust_deviation
from tuning.forecast import in_digits, loop_in_digits, run, settled
from tuning.frequency_response import loop_response, maximum_sensitivity

DRAWS = 24
"""Number of models and loads drawn: their spread is then known within 15 %; ours."""
MOST_TRIED = 3 * DRAWS
"""Maximum number of models drawn: some are unstable under settings with which the plant was stable."""
LEAST_DEVIATION = np.array([0.07, 0.1, 0.07])
"""Minimum standard deviations of the logs of slope, time constant and dead time; ours: one lag approximates all."""
MOST_MISFIT_DB, MOST_SPREAD = 1.5, 0.5
"""Misfit of the spectra of both weeks [dB], and deviation of the slope's log, up to which they identify the process;
ours: known loops give 0.4 to 1.1 dB."""
STEPS = 8192
"""Samples of each simulation; ours: 22 hours at 10 s."""
WINDOW_POWER = 0.375
"""Mean square of the Hann window in the stored spectrum."""
HARMONICS = (1, 2, 3, 5)
"""Multiples of a valve's cycle that are removed from the load, because the simulated valve produces them."""
CYCLE_OCTAVES = 0.5
"""Width about each of them [octaves]; ours: a cycle disturbed by a load is as wide."""
WHOLE = 0.9
"""Share of a night inside a span that assigns it to the span; ours: the hour after a change is excluded."""
CALIBRATED = 3
"""Number of corrections of a load's size; ours: the error is then within 5 % of the recorded one."""
FIGURES = ("average_absolute_error_pct", "variability_pct", "stem_travel", "valve_travel_pct_per_h")
"""Simulated figures; stem_travel is that of the stem, valve_travel_pct_per_h that of OP [%/h]."""


@dataclass(frozen=True, slots=True)
class LogRatio:
    """A logarithm of a ratio with its standard deviation [-]."""

    value: float
    deviation: float

    def interval(self, times: float) -> tuple[float, float]:
        """Its ends at so many standard deviations."""
        return self.value - times * self.deviation, self.value + times * self.deviation


NO_RATIO = LogRatio(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class EqualLoad:
    """Simulated effect of a change, by name of the figure (FIGURES).

    change, under the loads of both weeks, by settings or repair; load, effect of the loads on both loops; promised,
    the change under the load of before; stem, of the stem's travel over OP's, after over before, zero behind a
    fault-free valve, and stem_share, its value before [-]; same, whether neither settings nor valve changed.
    """

    change: Mapping[str, LogRatio]
    load: Mapping[str, LogRatio]
    promised: Mapping[str, LogRatio]
    stem: LogRatio
    stem_share: float = 1.0
    same: bool = False


@dataclass(frozen=True, slots=True)
class Weeks:
    """A loop's nights before and after a change, the settings in force, and whether the valve was repaired."""

    before: tuple[LoopNight, ...]
    after: tuple[LoopNight, ...]
    old: Pid
    new: Pid
    repaired: bool = False

    @property
    def same(self) -> bool:
        """Whether neither settings nor valve changed."""
        return self.old == self.new and not self.repaired

    @property
    def noise_increase_db(self) -> float:
        """Increase of PV's fastest noise after the change [dB]."""
        before, after = (float(np.median([n.noise_db for n in side])) for side in (self.before, self.after))
        return after - before

    @property
    def fault_removed(self) -> bool:
        """Whether the fault of a valve was removed: most nights before the change show it, and few nights
        after it. A night with a cycle after the change counts as one with the fault, because a cycle hides
        it."""
        was = sum(n.faulty_this_night for n in self.before) / len(self.before)
        is_now = sum(n.faulty_this_night or n.cycles for n in self.after) / len(self.after)
        return any(n.at_fault for n in self.before) and was > 0.5 and is_now <= 0.5 * was


def equal_load(weeks: Weeks, limits: ComparisonLimits, figures: FigureLimits) -> EqualLoad | None:
    """Both loops under both weeks' loads; None if no process was identified, or if the simulation with present
    settings does not reproduce the recorded error."""
    if weeks.same:
        nothing = dict.fromkeys(FIGURES, NO_RATIO)
        return EqualLoad(nothing, {}, nothing, NO_RATIO, same=True)
    rng, drawn = np.random.default_rng(0), []
    models = _models(weeks, rng)
    for k, model in zip(range(MOST_TRIED), models, strict=False):
        found = _simulated(weeks, model, k, rng, figures)
        drawn += [] if found is None else [found]
        if len(drawn) == DRAWS:
            break
    if len(drawn) < DRAWS // 2:
        return None
    table = np.array([d[0] for d in drawn])  # draws, loops, loads, figures
    recorded = np.array([d[1] for d in drawn])
    present = table[:, [0, 1], [0, 1]][..., [0, 3]]  # error and OP travel of each loop on its own load
    missed = np.abs(np.median(present - recorded, axis=0))
    if missed.max() > math.log(limits.agree_error):
        return None
    own = table[:, 1] - table[:, 0]
    change, load = own.mean(axis=1), (table[:, :, 1] - table[:, :, 0]).mean(axis=1)
    ratio = table[..., 2] - table[..., 3]
    off = np.hypot(*missed)[[0, 0, 1, 1]]
    most = float(np.abs(np.median(change, axis=0)).max())
    hardly = min(most / limits.full_change, 1.0)  # for nearly equal settings errors of the model cancel
    named = [
        {n: _part(x[:, i], share * off[i], limits) for i, n in enumerate(FIGURES)}
        for x, share in ((change, hardly), (load, 1.0), (own[:, 0], hardly))
    ]
    return EqualLoad(
        named[0],
        named[1],
        named[2],
        _part(ratio[:, 1, 1] - ratio[:, 0, 0], 0.0, limits) if np.any(ratio) else NO_RATIO,
        math.exp(float(np.median(ratio[:, 0, 0]))),
    )


def _part(x: Floats, missed: float, limits: ComparisonLimits) -> LogRatio:
    """The median of draws; their spread, plus the simulation error of each present loop against the record, and a
    share of the part itself for unmodelled effects."""
    value = float(np.median(x))
    spread = max(robust_deviation(x - value), 0.5 * float(np.std(np.clip(x, -4, 4))))
    return LogRatio(value, math.hypot(spread, missed, limits.model_share * abs(value), limits.model_floor))


Model = tuple[Fopdt, LoopNight | None]
"""A drawn process, and the night with its valve, None for a fault-free one."""


def _models(weeks: Weeks, rng: np.random.Generator) -> Iterator[Model]:
    """Models drawn from the knowledge of the process: from nights in which the valve's fault was found; for a loop
    without a fault from the spectra under both settings; otherwise from the nights, each by its precision."""
    faulty = [n for n in (*weeks.before, *weeks.after) if n.at_fault and n.constants is not None]
    shared = None
    if not faulty and weeks.old != weeks.new:
        shared = shared_process([_spectra(weeks.before, weeks.old), _spectra(weeks.after, weeks.new)])
    if (
        shared is not None
        and shared.misfit_db <= MOST_MISFIT_DB
        and shared.covariance[0, 0] <= MOST_SPREAD**2
    ):
        spread = np.clip(np.sqrt(np.diag(shared.covariance)), LEAST_DEVIATION, 0.5)
        unit = shared.covariance / np.sqrt(np.outer(*[np.diag(shared.covariance)] * 2))
        root = spread[:, None] * np.linalg.cholesky(unit + 1e-6 * np.eye(3))
        while True:
            yield _process(shared.mean + root @ rng.standard_normal(3), shared.sign), None
    among = faulty or [n for n in (*weeks.before, *weeks.after) if n.constants is not None]
    known = [n.constants for n in among if n.constants is not None]
    weight = np.array([1.0 / (deviation[0] ** 2 + 0.05**2) for _, deviation in known])
    while known:
        k = int(rng.choice(len(among), p=weight / weight.sum()))
        mean, deviation = known[k]
        spread = np.clip(deviation, LEAST_DEVIATION, 0.5)
        yield _process(mean + spread * rng.standard_normal(3), among[k].sign), among[k]


def _process(logs: Floats, sign: float) -> Fopdt:
    slope, lag, dead = np.exp(logs)
    return Fopdt(sign * slope * lag, lag, dead)


def _spectra(side: Sequence[LoopNight], pid: Pid) -> Spectra:
    """Mean levels of some nights, from the longest period that occurs eight times in a night."""
    f = side[0].frequency[side[0].frequency > 8.0 / side[0].duration_s]
    levels = [np.interp(np.log(f), np.log(n.frequency), n.level) for n in side]
    return Spectra(f, np.mean(levels, axis=0), replace(pid, scan_s=max(n.dt_s for n in side)))


def _simulated(
    weeks: Weeks, model: Model, k: int, rng: np.random.Generator, figures: FigureLimits
) -> tuple[Floats, Floats] | None:
    """Logs of the figures of a drawn model on two drawn nights, shape (2 loops, 2 loads, figures), and of the
    recorded errors and OP travels, shape (2 nights, 2); None if the model is unstable under settings in force."""
    process, night = model
    nights = tuple(side[int(rng.integers(len(side)))] for side in (weeks.before, weeks.after))
    h = max(n.dt_s for n in nights)
    valve = None if night is None else _valve(night)
    loops = tuple(
        loop_in_digits(Loop(process, replace(pid, scan_s=h, op_lo=0.0, op_hi=100.0), behind))
        for pid, behind in ((weeks.old, valve), (weeks.new, None if weeks.repaired else valve))
    )
    loads: list[Floats] = []
    for loop, one in zip(loops, nights, strict=True):
        if process.slope * loop.controller.kp <= 0.0 or math.isinf(maximum_sensitivity(loop)):
            return None
        loads.append(_calibrated(one, loop, h, np.random.default_rng([k, len(loads)]), figures))
    found = [[_figures(loop, load, figures) for load in loads] for loop in loops]
    kept = [(n.error, max(n.op_travel, 1e-4)) for n in nights]
    return np.log(np.maximum(found, 1e-4)), np.log(kept)


def _valve(night: LoopNight) -> Valve:
    if not night.at_fault or night.width <= 0.0:
        return None
    return Stiction(night.width, min(night.jump, night.width)) if night.jump > 0.0 else Backlash(night.width)


def _calibrated(
    night: LoopNight, loop: Loop, h: float, rng: np.random.Generator, figures: FigureLimits
) -> Floats:
    """A load like that of a night, with the moves of its set point [% PV], shape (STEPS,), scaled so that the loop in
    force has the recorded error: a valve's own part of the error is not load."""
    (load, noise), size = _load(night, loop, h, rng), 1.0
    moved = rng.random(STEPS) < night.moves * h / 3600.0
    rest = noise - np.cumsum(night.size * np.where(np.cumsum(moved) % 2, -1.0, 1.0) * moved)
    for _ in range(CALIBRATED):
        error = _figures(loop, in_digits(size * load + rest), figures)[0]
        size *= min(max(night.error / max(error, 1e-9), 0.5), 2.0)
    return in_digits(size * load + rest)


def _load(night: LoopNight, loop: Loop, h: float, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """A load like that of a night and its noise [% PV], shape (STEPS,) each: the error's spectrum over the
    sensitivity, less the level at its highest frequencies, and that level; with random phases."""
    level = night.level
    if night.cycle_s > 0.0 and loop.valve is not None:
        level = _without_cycle(night)
    f: Floats = np.fft.rfftfreq(STEPS, h)[1:].astype(np.float64)
    seen = 10.0 ** (np.interp(np.log(f), np.log(night.frequency), level) / 10.0)
    white = np.full(f.size, 10.0 ** (night.noise_db / 10.0))
    power = np.maximum(seen * np.abs(1.0 + loop_response(loop, 2 * np.pi * f)) ** 2 - white, 0.0)
    scale = STEPS * np.sqrt(night.duration_s / (STEPS * h) / (2.0 * WINDOW_POWER)) / 2.0
    lines = (scale * np.sqrt(x) * (rng.standard_normal((f.size, 2)) @ [1.0, 1.0j]) for x in (power, white))
    load, noise = (np.fft.irfft(np.r_[0.0, x], STEPS) for x in lines)
    return load, noise


def _without_cycle(night: LoopNight) -> Floats:
    """The levels interpolated linearly across the valve's cycle and its harmonics [dB]."""
    octave = np.log2(night.frequency * night.cycle_s)
    near = np.min([np.abs(octave - math.log2(k)) for k in HARMONICS], axis=0) < CYCLE_OCTAVES
    if near.all() or not near.any():
        return night.level
    return np.where(near, np.interp(octave, octave[~near], night.level[~near]), night.level)


def _figures(loop: Loop, load: Floats, figures: FigureLimits) -> tuple[float, float, float, float]:
    """FIGURES of a loop under a load."""
    r = settled(run(loop, load))
    use, step = np.ones(len(r), dtype=bool), max(round(figures.travel_grid_s / r.dt_s), 1)
    hours = r.duration_s / 3600.0
    stem, op = (travel_of(x, use, step, figures.travel_deadband_pct)[0] / hours for x in (r.stem, r.op))
    return float(np.mean(np.abs(r.error))), 2.0 * float(np.std(r.error)), stem, op


def weeks_of(
    rows: Sequence[Mapping[str, Any]],
    spans: Sequence[tuple[float, float]],
    old: tuple[float | None, float | None],
    new: tuple[float | None, float | None],
    limits: ComparisonLimits,
) -> Weeks | None:
    """A loop's nights within two spans [s], with nine tenths of each inside one, and the settings in force: those of
    a stated change, otherwise the nights' own; None if a side has no night, or settings are unknown."""
    sides: list[list[Mapping[str, Any]]] = [[], []]
    for row in rows:
        if row["start_s"] is None or not row["duration_s"] or row["kp"] is None:
            continue
        for side, (first, last) in zip(sides, spans, strict=True):
            inside = min(row["start_s"] + row["duration_s"], last) - max(row["start_s"], first)
            if inside >= WHOLE * row["duration_s"]:
                side.append(row)
    nights = [tuple(filter(None, map(night_of, side))) for side in sides]
    if not all(nights):
        return None
    pids = pid_of(sides[0][-1], *old), pid_of(sides[1][-1], *new)
    if pids[0] is None or pids[1] is None:
        return None
    weeks = Weeks(nights[0], nights[1], pids[0], pids[1])
    quiet = abs(weeks.noise_increase_db) <= limits.noise_db  # strong noise moves a stem within its backlash
    return replace(weeks, repaired=pids[0] == pids[1] and quiet and weeks.fault_removed)
