"""Experiments in words: their times, the model, settings from it, and what remains unknown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from analyzer.history.plant_clock import stamp
from analyzer.loop.experiments.found import ExperimentResults
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import as_stated
from analyzer.words import sentences
from analyzer.words.units import duration, number
from identification.controller.pid_regression import integral_time
from identification.experiments.columns import Kind
from identification.experiments.find import Course, Experiment
from identification.experiments.model import Pooled
from identification.models import Estimate, Pid

TEXTS = sentences("experiments")
TITLES: Mapping[str, str] = {
    "gain": "gain",
    "slope_pct_per_s": "gain over time",
    "lags_s": "sum of lags",
    "time_constant_s": "longest lag",
    "second_lag_s": "second lag",
    "dead_time_s": "dead time",
    "zero_s": "inverse response",
    "backlash_pct": "backlash",
    "drift_pct_per_h": "drift of PV, separated",
}
"""Constants in words, in reporting order."""


def name_of(x: Experiment) -> str:
    """An experiment in words: number and size of its moves."""
    if x.course is Course.SETPOINT:
        steps = "set point step" if x.moves == 1 else f"{x.moves} set point steps"
        return f"{steps} in automatic, up to {number(x.size)} %"
    if x.course is Course.WARM_UP:
        return f"warm-up in automatic, PV begins {number(x.size)} % away from SP"
    many = x.course not in (Course.STEP, Course.RAMP) and x.moves > 1
    return f"{x.course} of OP{f', {x.moves} moves' if many else ''} over {number(x.size)} %"


def found_lines(of: ExperimentResults, zone: str) -> Iterator[str]:
    """A line for each experiment: time and kind."""
    start_s, dt_s = of.prepared.record.start_s, of.prepared.record.dt_s
    for x in of.found:
        first, last = (stamp(start_s + dt_s * k, zone) for k in (x.first, x.last))
        yield f"experiment {first} to {last}: {name_of(x)}"


def estimate_text(name: str, e: Estimate) -> str:
    """A constant with its interval and unit."""
    title = TITLES.get(name) or f"gain of neighbour {name.split('_')[1]}'s OP"
    return f"{title}: {number(e.value)} ({number(e.low)} to {number(e.high)}) {e.unit}"


def model_text(model: Pooled) -> str:
    """A model in one clause, with 90 % intervals."""
    e, texts = model.estimates, []
    size = e.get("gain") or e["slope_pct_per_s"]
    name = "gain" if "gain" in e else "gain over time"
    texts.append(f"{name} {number(size.value)} ({number(size.low)} to {number(size.high)}) {size.unit}")
    if "second_lag_s" in e:
        texts.append(f"lags {duration(e['time_constant_s'].value)} and {duration(e['second_lag_s'].value)}")
    elif "lags_s" in e:
        lag = e["lags_s"]
        texts.append(f"time constant {duration(lag.value)} ({number(lag.low)} to {number(lag.high)} s)")
    if model.kind is Kind.INVERSE:
        texts.append(f"inverse response {duration(e['zero_s'].value)}")
    dead = e["dead_time_s"]
    texts.append(f"dead time {duration(dead.value)} ({number(dead.low)} to {number(dead.high)} s)")
    if "backlash_pct" in e:
        texts.append(f"backlash {number(e['backlash_pct'].value)} % of OP")
    return ", ".join(texts)


def in_a_clause(of: ExperimentResults) -> str:
    """Text on the experiments in a row; '' if they give no model."""
    if of.model is None:
        return ""
    used = of.model.used
    what = name_of(used[0].experiment) if len(used) == 1 else f"{len(used)} experiments"
    return f"model from {what}: {model_text(of.model)}"


def settings_text(pid: Pid, spec: LoopSpec, pv_span: float) -> str:
    """Settings in the units of loops.csv."""
    kp, ti = as_stated(pid, spec, pv_span)
    return f"kp {number(kp)}, ti {number(ti)} {spec.ti_unit} ({spec.gain_unit}, {spec.form})"


def settings_lines(of: ExperimentResults, spec: LoopSpec, present: Pid | None) -> Iterator[str]:
    """Settings from the model: ours, and SIMC's for comparison, each with its maximum sensitivity."""
    if of.settings is None:
        return
    s, span = of.settings, of.prepared.scale.span
    yield f"settings from the model: {settings_text(s.robust, spec, span)}; Ms {s.robust_ms:.2f}"
    yield f"  SIMC with tau_c = dead time: {settings_text(s.simc, spec, span)}; Ms {s.simc_ms:.2f}"
    if present is not None:
        yield f"  present: {settings_text(present, spec, span)}"


def lines(of: ExperimentResults, spec: LoopSpec, present: Pid | None, zone: str) -> Iterator[str]:
    """All results of a loop's experiments."""
    yield from found_lines(of, zone)
    for x, why in of.without_model:
        yield f"  gives no model ({name_of(x)}): {why}"
    yield from lone_lines(of, zone)
    if of.model is None:
        return
    if len(of.model.used) > 1:
        shares = ", ".join(f"{100 * w:.0f} %" for w in of.model.weights)
        yield f"model of {len(of.model.used)} experiments, weights {shares}"
    yield f"model: {of.model.kind}, 90 % intervals"
    e = of.model.estimates
    for name in (*TITLES, *(k for k in e if k not in TITLES)):
        if name in e and (name != "time_constant_s" or "second_lag_s" in e):
            yield f"  {estimate_text(name, e[name])}"
    if "gain" in e:
        scale = of.prepared.scale
        yield f"  gain in own units: {number(e['gain'].value * scale.span / scale.op_span)} of PV per unit of OP"
    yield from controller_lines(of)
    yield from settings_lines(of, spec, present)
    for text in left_open(of):
        yield f"  not identified by the experiment: {text}"


def controller_lines(of: ExperimentResults) -> Iterator[str]:
    """Results of an experiment in automatic on its controller."""
    seen = of.controlled
    if seen is None:
        return
    if seen.law is not None:
        law = seen.law
        ti_s = integral_time(law.kp, law.ki, law.residual.size) * seen.dt_s
        share = f"explains {100 * law.explained:.0f} % of OP"
        yield f"controller as recorded: Kp {number(law.kp)} %/%, Ti {number(ti_s)} s, {share}"
    if seen.overshoot_pct > 0.0:
        yield f"PV goes {number(seen.overshoot_pct)} % of span beyond SP"


def lone_lines(of: ExperimentResults, zone: str) -> Iterator[str]:
    """Excluded single values, each with its time."""
    start_s = of.prepared.record.start_s
    for m in of.models:
        for name, times in (("PV", m.lone_pv), ("OP", m.lone_op)):
            for at in times:
                yield f"excluded: one isolated {name} sample at {stamp(start_s + at, zone)}"


def left_open(of: ExperimentResults) -> tuple[str, ...]:
    """Properties not identified by the experiments, and so not in the settings."""
    model = of.model
    if model is None:
        return ()
    out = []
    if not any(m.backlash_identifiable for m in model.used):
        out.append(TEXTS["play"])
    if any(m.experiment.course.closed for m in model.used):
        out.append(TEXTS["closed"])
    ops = [m.op for m in model.used]
    low, high = min(float(x.min()) for x in ops), max(float(x.max()) for x in ops)
    out.append(TEXTS["range"].format(number(low), number(high)))
    return tuple(out)
