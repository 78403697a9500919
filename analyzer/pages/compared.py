"""The page on which settings are compared and tried: what engineers know beside what is recommended, and a slider."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np

from analyzer.loop.settings_side_by_side import SPREAD, Comparison, Shown
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import unit_ratio
from analyzer.pages.words import number
from analyzer.words.units import duration, gain_unit
from identification.models import Integrator, Pid
from identification.simulation.closed_loop import scan_step
from identification.simulation.lag import discretize
from identification.simulation.valve import constants_of
from reports.pages import (
    Block,
    Cell,
    Column,
    Field,
    Line,
    Page,
    Panels,
    Place,
    Plot,
    Section,
    Table,
    Text,
    WhatIf,
)
from reports.texts import slug
from tuning.describing import band, is_play
from tuning.forecast import LAMBDA, LEAST_PRELUDE, LONGER, NOW, PRELUDE, RECOMMENDED, SIMC, Tried
from tuning.frequency_response import slowest_s
from tuning.limit_cycle import KICK
from tuning.limits import WARM_UP
from tuning.rules import simc

INTEGRATOR = {
    SIMC: "Kp = 1/(slope (tau + L)), Ti = 4 (tau + L), tau = 1.5 L; knows no valve",
    LAMBDA: "Kp = Ti/(slope (lambda + L)^2), Ti = 2 lambda + L, lambda = 3 L; knows no valve",
}
"""What the rules are for a process whose time constant is not known."""
MEANING = {
    NOW: "as stated",
    RECOMMENDED: "the least travel and error within the limits, on the load and on what else the loop may be",
    SIMC: "Kp = T/(K (tau + L)), Ti = min(T, 4 (tau + L)), tau = 1.5 L; knows no valve",
    LAMBDA: "Kp = T/(K (lambda + L)), Ti = T, lambda = T, 3 L at least; knows no valve",
    LONGER: "the present gain, Ti raised to the time constant: the source study's rule for play",
}
COLUMNS = (
    Column("name", "Settings"),
    Column("kp", "Kp", True),
    Column("ti", "Ti", True),
    Column("travel", "Stem travel %/h", True),
    Column("error", "Average absolute error", True),
    Column("peak", "Largest error", True),
    Column(
        "rejection",
        "After a load step, times now",
        True,
        "Integral of the error that a step of the load leaves, Ti/Kp, over that of the present settings",
    ),
    Column("ms", "Ms", True, "Maximum sensitivity of the linear loop: 1.4 to 2 is robust"),
    Column("meaning", "What it is", wide=True),
)
CAUTION = (
    "Recommended are only settings that keep robustness, load rejection and error on all that the night's data "
    "allow, with little more gain: a valve that jumps looks like one with play behind a process of less gain."
)
HINT = "Move a slider, or begin from one of the settings; drag over a trend to zoom, double click for all."
BETTER, WORSE = 0.97, 1.03
"""Ratios to the present settings from which a figure is coloured [-]; ours."""


def _against(value: float, now: float) -> str:
    return "better" if value < BETTER * now else "worse" if value > WORSE * now else ""


def _rejection(t: Tried, now: Tried) -> Cell:
    """How much of the error a load step leaves, against now."""
    if not (math.isfinite(t.integral_s) and math.isfinite(now.integral_s)):
        return Cell("–")
    ratio = t.integral_s / now.integral_s
    return Cell(number(ratio), ratio, _against(ratio, 1.0))


def _ti(seconds_or_none: float, unit: str) -> str:
    return "none" if seconds_or_none == 0 else f"{seconds_or_none:.3g} {unit}"


def table(c: Comparison, spec: LoopSpec, unit: str) -> Table:
    """The settings with what they do on the load."""
    scale, now = c.pv_span / 100.0, c.tried[0]
    gain = gain_unit(spec.gain_unit, spec.pv_unit, spec.op_unit)
    meaning = MEANING | (INTEGRATOR if isinstance(c.loop.process, Integrator) else {})
    rows = []
    for t in c.tried:
        kp, ti = c.stated[t.name]
        ms = "unstable" if math.isinf(t.ms) else f"{t.ms:.2f}"
        rows.append(
            (
                Cell(t.name, kind="strong" if t.name == RECOMMENDED else ""),
                Cell(f"{kp:.3g} {gain}", kp),
                Cell(_ti(ti, spec.ti_unit), ti),
                Cell(number(t.stem_travel), t.stem_travel, _against(t.stem_travel, now.stem_travel)),
                Cell(f"{number(scale * t.error)} {unit}", t.error, _against(t.error, now.error)),
                Cell(f"{number(scale * t.peak)} {unit}", t.peak, _against(t.peak, now.peak)),
                _rejection(t, now),
                Cell(ms, None if math.isinf(t.ms) else t.ms),
                Cell(meaning[t.name]),
            )
        )
    note = (
        f"Each simulated on the {duration(c.load.size * scan_step(c.loop))} of load that the night leaves behind the "
        f"identified loop. {CAUTION}"
    )
    return Table("settings", "", COLUMNS, tuple(rows), note)


def _plot(t: Tried, shown: Shown, scale: float, unit: str, reach: float) -> Plot:
    line = Line("SP − PV", shown.time_s / 60.0, scale * shown.error)
    words = f"travel {number(t.stem_travel)} %/h, error {number(scale * t.error)} {unit}"
    return Plot(
        f"tried-{slug(t.name)}",
        t.name,
        "minutes",
        f"SP − PV [{unit}]",
        (line,),
        (),
        words,
        reach=(-reach, reach),
    )


def panels(c: Comparison, unit: str) -> Panels:
    """The end of each simulation on the same axes."""
    scale = c.pv_span / 100.0
    most = scale * max(float(np.abs(s.error).max(initial=0.0)) for s in c.shown.values())
    plots = tuple(_plot(t, c.shown[t.name], scale, unit, most) for t in c.tried)
    return Panels("tried", "The error under each of them, on the same load", plots)


def field(c: Comparison) -> Field | None:
    """The travel of the limit cycle over Kp and Ti, with the settings as points; None where the valve is free."""
    if c.travel is None:
        return None
    sign = math.copysign(1.0, c.loop.controller.kp)
    inside = [t for t in c.tried if math.isfinite(t.controller.ti_s)]
    kinds = {NOW: "now", RECOMMENDED: "recommended"}
    places = tuple(
        Place(abs(t.controller.kp), t.controller.ti_s, t.name, kinds.get(t.name, "rule")) for t in inside
    )
    sticks = not is_play(c.loop.valve)
    swings = "limit cycle, the darker the more the stem travels"
    calm = ("calm", "comes to rest") if not sticks else ("calm", "comes to rest (seldom with stick-slip)")
    return Field(
        "travel-map",
        "Travel by describing function, without load",
        "Kp [%/%]",
        "Ti [s]",
        sign * c.travel.kp,
        c.travel.ti_s,
        3600.0 * c.travel.travel,
        c.travel.rests,
        c.travel.unstable,
        places,
        (("swings", swings), calm, ("unstable", "unstable")),
        "Kp in percent of OP over percent of PV, whatever unit the controller has.",
    )


def _kick(c: Comparison) -> dict[str, float]:
    """What sets a loop with play going, as tuning.forecast.run does it.

    Kick [% PV times gain], the slowest time beside Ti [s], times of it that the loop is left alone, scans at least.
    """
    width = band(c.loop.valve)
    free = replace(c.loop, controller=replace(c.loop.controller, ti_s=math.inf))
    return {
        "kick": KICK * width if is_play(c.loop.valve) and width > 0.0 else 0.0,
        "slowest_s": slowest_s(free),
        "times": PRELUDE,
        "least": LEAST_PRELUDE,
    }


def _named(name: str, pid: Pid) -> dict[str, Any]:
    return {"name": name, "kp": pid.kp, "ti_s": pid.ti_s if math.isfinite(pid.ti_s) else None}


def model(c: Comparison, spec: LoopSpec, unit: str) -> str:
    """What a page needs to simulate the loop with other settings, as JSON."""
    loop, h = c.loop, scan_step(c.loop)
    d, pid = discretize(loop.process, h), c.loop.controller
    breakaway, sliding, tolerance = constants_of(loop.valve)
    return json.dumps(
        {
            "process": {"pole": d.pole, "now": d.now, "before": d.before, "delay": d.delay},
            "valve": {
                "breakaway": breakaway,
                "sliding": sliding,
                "tolerance": tolerance if math.isfinite(tolerance) else None,
            },
            "scan_s": h,
            "td_s": pid.td_s,
            "op_lo": pid.op_lo,
            "op_hi": pid.op_hi,
            "op_start": 0.5 * (pid.op_lo + pid.op_hi),
            "warm_up": WARM_UP,
            "prelude": _kick(c),
            "settings": [_named(t.name, t.controller) for t in c.tried],
            "ti_middle_s": simc(loop.process, scan_s=h).ti_s,
            "spread": SPREAD,
            "opening_h": max(float(s.time_s[-1]) for s in c.shown.values()) / 3600.0,
            "pv_scale": c.pv_span / 100.0,
            "pv_unit": unit,
            "law": {
                "form": str(spec.form),
                "band": spec.gain_unit == "band",
                "ratio": unit_ratio(spec, c.pv_span),
                "kp_unit": gain_unit(spec.gain_unit, spec.pv_unit, spec.op_unit),
                "ti_unit": spec.ti_unit,
            },
        }
    )


def page(loop: str, night: str, c: Comparison, spec: LoopSpec) -> Page:
    """A loop's page of settings."""
    known = spec.pv_lo is not None and spec.pv_hi is not None
    unit = (spec.pv_unit or "own unit") if known else "%"
    drawn = field(c)
    first: list[Block] = [table(c, spec, unit), panels(c, unit)]
    first += [] if drawn is None else [drawn]
    said = "The load adds to PV as it did in the night; what the model lacks, and a load that changes, are not in it."
    tried = WhatIf("try", "Kp and Ti moved, the night simulated again", model(c, spec, unit), c.load, said)
    hint = Text((HINT,))
    return Page(
        f"{slug(loop)}-settings",
        f"{loop}: settings",
        f"settings compared and tried on night {night}",
        (Section("Settings compared", tuple(first)), Section("Try settings", (hint, tried))),
    )
