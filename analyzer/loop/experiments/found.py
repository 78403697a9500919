"""Experiments in a loop's record: their times, their common model, and settings from it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.decisions import Cell
from analyzer.loop.record.judged_stretch import controller_of
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.loop.record.sample_clock import constant_stretches, snapped
from analyzer.loops.spec import LoopSpec
from identification.controller.pi_regression import ControlLaw, Trends, unstated_law
from identification.errors import NotAssessedError, TriageError
from identification.experiments.find import Experiment, in_automatic, in_manual
from identification.experiments.model import Modelled, Pooled, modelled, pooled
from identification.limits import LIMITS
from identification.models import Pid
from identification.record import Floats, LoopRecord, Mask
from identification.signals.robust import robust_deviation
from tuning.from_test import FromTest, corners, settings_from

MOST = 6  # Largest number of modelled experiments of a record [experiments]; each takes a second
AS_GOOD = 1.3
"""Factor between present and new gain, or integral time, from which new ones are proposed: less is within the
accuracy of a test."""
POINTS = 120  # Points of a response that a night stores for its page [points]: a picture shows no more
MOST_A_NIGHT = 2
"""Largest number of experiments of a loop that a night models [experiments]; each takes two seconds, in
one loop of many."""

CONSTANTS = {"gain": "gain", "slope_pct_per_s": "slope", "lags_s": "time_constant_s"}
"""Constants of a model, and their names in the belief."""


@dataclass(frozen=True, slots=True)
class Controlled:
    """The controller in an experiment in automatic: overshoot of PV beyond SP [% of span], and the law that explains
    OP, None if none does."""

    overshoot_pct: float
    law: ControlLaw | None
    dt_s: float


@dataclass(frozen=True, slots=True)
class ExperimentResults:
    """Results of a record's experiments.

    found, all of them; prepared, the record that contains them; models, of those that determine a process; model,
    all of these combined, None if there are none; settings from it, None if it gives none; without_model,
    experiments without a model, each with the reason; controlled, the controller in the model's own experiment in
    automatic.
    """

    found: tuple[Experiment, ...]
    prepared: Prepared
    models: tuple[Modelled, ...] = ()
    model: Pooled | None = None
    settings: FromTest | None = None
    without_model: tuple[tuple[Experiment, str], ...] = ()
    controlled: Controlled | None = None


def manual_of(spec: LoopSpec, prepared: Prepared, series: Mapping[str, Series], config: Config) -> Mask:
    """True where OP is moved by an operator or a script, shape (n,): in manual; without a mode also where OP is
    constant at a limit for long."""
    record = prepared.record
    constant = constant_stretches(
        record.op, record.dt_s, config.quality.manual_s, config.quality.manual_samples
    )
    if spec.mode in series:
        return record.mask("manual")
    return record.mask("manual") | (constant & record.mask("saturated"))


def on_even_clock(
    spec: LoopSpec, series: Mapping[str, Series], prepared: Prepared, config: Config
) -> Prepared:
    """The record without the samples that a clock repeats or loses if stamps scatter a little."""
    even = snapped(dict(series), spec.pv or "")
    return (
        prepared
        if even.get(spec.pv or "") is series.get(spec.pv or "")
        else prepare(spec, even, config.quality)
    )


def found_in(
    spec: LoopSpec, prepared: Prepared, series: Mapping[str, Series], config: Config
) -> tuple[Experiment, ...]:
    """The experiments of a record, those by hand first."""
    if not prepared.op_known or not prepared.op_scaled or prepared.shared is not None:
        return ()
    manual = manual_of(spec, prepared, series, config)
    return (*in_manual(prepared.record, manual), *(() if manual.all() else in_automatic(prepared.record)))


def experiment_results(
    spec: LoopSpec,
    series: Mapping[str, Series],
    prepared: Prepared,
    config: Config,
    closed: bool = True,
    neighbours: Sequence[Floats] = (),
) -> ExperimentResults | None:
    """Results of a loop's experiments; None if there are none.

    closed : whether those in automatic are modelled too, which a night leaves to its routine; neighbours : OPs of
    neighbours on the record's clock, shape (n,) each.
    """
    found = found_in(spec, prepared, series, config)
    if not found:
        return None
    even = prepared if neighbours else on_even_clock(spec, series, prepared, config)
    if even is not prepared:
        found = found_in(spec, even, series, config)
    models, without_model, stated = [], [], controller_of(spec, even)
    wanted = [x for x in sorted(found, key=lambda x: -x.size) if closed or not x.course.closed]
    for x in wanted[: MOST if closed else MOST_A_NIGHT]:
        try:
            models.append(_checked_sign(modelled(even.record, x, neighbours), stated))
        except NotAssessedError as error:
            without_model.append((x, str(error)))
        except (ArithmeticError, ValueError) as error:  # a fit that diverges costs nothing else of the loop
            without_model.append((x, f"no fit: {error}"))
    models.sort(key=lambda m: m.experiment.first)
    if not models:
        return ExperimentResults(found, even, without_model=tuple(without_model))
    open_ones = [m for m in models if not m.experiment.course.closed]
    whole = pooled(open_ones or models)
    first = whole.used[0].experiment
    seen = controlled(even.record.span(first.first, first.last)) if first.course.closed else None
    return ExperimentResults(
        found, even, tuple(models), whole, _settings(whole, spec, even), tuple(without_model), seen
    )


def _checked_sign(model: Modelled, stated: Pid | None) -> Modelled:
    """The model; NotAssessedError for one of an experiment in automatic whose gain has the wrong sign for the stated
    controller: such a loop would be unstable, so a load has moved PV."""
    closed = model.experiment.course.closed
    if closed and stated is not None and stated.kp * model.process.slope < 0.0:
        raise NotAssessedError("the fitted gain has the opposite sign of its controller: a load moved PV")
    return model


def controlled(part: LoopRecord) -> Controlled:
    """The overshoot of an experiment in automatic, without noise, and the law that explains OP in it."""
    sign = float(np.sign(np.median(part.error[:5]))) or 1.0
    beyond = -sign * part.error
    reached = np.flatnonzero(beyond >= 0.0)
    noise = 3.0 * robust_deviation(np.diff(part.pv)) / math.sqrt(2.0)
    most = float(beyond[reached[0] :].max()) - noise if reached.size else 0.0
    q = LIMITS.controller
    free = part.usable & (part.op > q.at_limit) & (part.op < 100.0 - q.at_limit)
    law = unstated_law(Trends(part.sp, part.pv, part.op, free, q))
    return Controlled(max(most, 0.0), law if law is not None and law.kp * law.ki > 0.0 else None, part.dt_s)


def _settings(model: Pooled, spec: LoopSpec, prepared: Prepared) -> FromTest | None:
    """Settings from a model; None if its process gives none."""
    stated = controller_of(spec, prepared)
    scan_s = stated.scan_s if stated is not None else spec.scan_s or prepared.record.dt_s
    process = model.process
    try:
        return settings_from(process, corners(process, dict(model.estimates)), scan_s)
    except (ValueError, TriageError):
        return None


def farther(present: Pid, new: Pid) -> float:
    """Ratio of new and present settings, the larger of gain and integral time, at least 1; inf for another sign, or
    where the present integral is off."""
    if present.kp * new.kp <= 0.0 or not math.isfinite(present.ti_s) or present.ti_s <= 0.0:
        return math.inf
    return max(*(max(a / b, b / a) for a, b in ((present.kp, new.kp), (present.ti_s, new.ti_s))))


def constants_known(model: Pooled) -> Mapping[str, tuple[float, float]]:
    """Constants with the deviation of their logarithms, by their names in the belief."""
    out = {}
    for name, known in CONSTANTS.items():
        e = model.estimates.get(name)
        if e is not None and e.value * e.low > 0.0 and e.value * e.high > 0.0:
            out[known] = (e.value, abs(math.log(e.high / e.low)) / 3.29)
    dead = model.estimates["dead_time_s"]
    if dead.value > 0.0:
        out["dead_time_s"] = (dead.value, (dead.high - dead.low) / 3.29 / dead.value)
    if "gain" in out and "time_constant_s" in out:
        (k, a), (t, b) = out["gain"], out["time_constant_s"]
        out["slope"] = (k / t, math.hypot(a, b))
    return out


def with_constants(witness: str | None, model: Pooled) -> str:
    """A night's evidence about its valve, with the constants that experiments determine better, or these alone."""
    constants = json.loads(witness) if witness else {}
    for name, (value, deviation) in constants_known(model).items():
        if name not in constants or deviation < constants[name][1]:
            constants[name] = [float(f"{value:.4g}"), float(f"{deviation:.4g}")]
    return json.dumps(constants, separators=(",", ":"))


def model_row(model: Pooled) -> dict[str, Cell]:
    """The constants of a row: gain, slope, the longest lag and dead time, backlash."""
    e = model.estimates
    value = {name: x.value for name, x in e.items()}
    lag = value.get("time_constant_s") if "second_lag_s" in e else value.get("lags_s")
    slope = value["slope_pct_per_s"] if "gain" not in e else value["gain"] / (lag or 1.0)
    out: dict[str, Cell] = {
        "gain": value.get("gain"),
        "time_constant_s": lag,
        "slope_pct_per_s": slope,
        "dead_time_s": value["dead_time_s"],
    }
    return out | ({"backlash_pct": value["backlash_pct"]} if "backlash_pct" in e else {})


def as_rows(of: ExperimentResults) -> str:
    """The experiments as the store keeps them (JSON): span [s since 1970-01-01 UTC], course, moves, results of each,
    and its response in a few hundred points, PV in % of span."""
    record = of.prepared.record
    by_experiment = {m.experiment: m for m in of.models}
    why = dict(of.without_model)
    return json.dumps(
        [_as_row(record, x, by_experiment.get(x), why.get(x)) for x in of.found], separators=(",", ":")
    )


def _as_row(record: LoopRecord, x: Experiment, m: Modelled | None, why: str | None) -> dict[str, object]:
    start_s = record.start_s
    row: dict[str, object] = {
        "first_s": round(start_s + x.first * record.dt_s, 3),
        "last_s": round(start_s + x.last * record.dt_s, 3),
        "course": str(x.course),
        "moves": x.moves,
        "size_pct": float(f"{x.size:.4g}"),
    }
    if m is None:
        return row | ({"untold": why} if why else {})
    at = np.unique(np.linspace(0, m.pv.size - 1, POINTS).round().astype(int))
    short = {k: [float(f"{v:.5g}") for v in getattr(m, k)[at]] for k in ("pv", "simulated", "op")}
    times = [round(float(t), 2) for t in m.time_s[at]]
    known = {
        k: [float(f"{v:.5g}") for v in (e.value, e.low, e.high)] + [e.unit] for k, e in m.estimates.items()
    }
    lone = {"lone_pv": m.lone_pv, "lone_op": m.lone_op}
    return row | {"kind": str(m.kind), "constants": known, "time_s": times, **short, **lone}


def chosen(of: ExperimentResults, present: Pid | None) -> Pid | None:
    """New settings in place of the present ones; None if these are as good, or there are none."""
    if of.settings is None or present is None:
        return None
    new = replace(of.settings.robust, scan_s=present.scan_s, gain_share=present.gain_share)
    return new if farther(present, new) > AS_GOOD else None
