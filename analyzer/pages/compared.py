"""The page on which settings are compared and simulated: recommended and other settings, and a slider."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from analyzer.loop.advice.settings_side_by_side import SPREAD, Comparison
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import as_stated, derivative_as_stated, unit_ratio
from analyzer.pages.words import CellContent, number, page_table, signed, texts
from analyzer.words.units import duration, gain_unit
from identification.models import Integrator, Pid
from identification.simulation.closed_loop import scan_step
from identification.simulation.lag import discretize
from identification.simulation.pi import per_scan
from identification.simulation.valve import law_of
from reports import pages as parts
from reports.texts import slug
from tuning.describing import band, is_backlash
from tuning.forecast import (
    CALMER,
    DERIVATIVE,
    LEAST_PRELUDE,
    NOW,
    PRELUDE,
    RECOMMENDED,
    REPAIRED,
    SMALLER,
    WARM_UP,
    Tried,
)
from tuning.frequency_response import slowest_s
from tuning.harmonic_balance import TravelMap
from tuning.limit_cycle import KICK
from tuning.rules import simc

SHOWN_RATIO = 3.0
"""Times the present travel or error beyond which settings are omitted from the picture of costs."""
MANY_TIMES = 100.0  # Multiple of the present figure beyond which no number is shown
BETTER = 0.97  # Ratio to the present settings below which a figure is called better
WORSE = 1.03  # The same above which it is called worse

OFFERED = (CALMER, SMALLER, DERIVATIVE)
"""Alternative settings to choose from, besides the recommended ones."""
PLACED = {NOW: "now", RECOMMENDED: "recommended"}
"""Colours of settings in a picture; others have that of a rule."""


def _against(value: float, now: float) -> str:
    return "better" if value < BETTER * now else "worse" if value > WORSE * now else ""


def opening(c: Comparison, spec: LoopSpec, unit: str) -> str:
    """Gains and losses of the recommended settings, in a sentence; otherwise the list of what is compared."""
    now, new = c.tried[0], next((t for t in c.tried if t.name == RECOMMENDED), None)
    if new is None:
        offers = "; ".join(
            _offers(
                c,
                [f"{n}: {_gains_and_losses(c, n)}" for n in OFFERED if n in c.shown],
                "a repaired valve",
                unit,
            )
        )
        sentence = (
            "No settings are recommended: on all loops that the data allow, none is better without a cost."
        )
        return f"{sentence} {f'To choose between: {offers}.' if offers else ''}"
    scale, ratio = c.pv_span / 100.0, _times(new, now)
    travel, error = (
        f"{number(a)} to {number(b)}"
        for a, b in ((now.stem_travel, new.stem_travel), (scale * now.error, scale * new.error))
    )
    text = (
        f"On the night's load {_typed(c, RECOMMENDED, spec)} take the stem's travel from {travel} %/h and the "
        f"average absolute error from {error} {unit}"
    )
    if ratio is None:
        return f"{text}."
    link = "; the cost is that" if ratio > WORSE else ", and"
    return f"{text}{link} the integral of the error after a load step is {number(ratio)} times as large."


def choices(c: Comparison, spec: LoopSpec) -> list[str]:
    """The settings from which an engineer may choose, one line each, and the effect of a repair."""
    named = [t.name for t in c.tried if t.name in (RECOMMENDED, *OFFERED) and t.name in c.everywhere]
    unit = spec.pv_unit or "PV"
    offered = [f"{name}: {_typed(c, name, spec)}: {_gains_and_losses(c, name)}" for name in named]
    lines = _offers(c, offered, REPAIRED, unit)
    return ["to choose between, on all possible loops:", *(f"  {x}" for x in lines)] if lines else []


def _offers(c: Comparison, settings: list[str], repair: str, unit: str) -> list[str]:
    """Settings with their gains and losses, and the effect of a repair, on the identified loop."""
    if c.repaired is None:
        return settings
    t, now, scale = c.repaired, c.tried[0], c.pv_span / 100.0
    travel = f"stem travel {number(now.stem_travel)} to {number(t.stem_travel)} %/h"
    error = f"average absolute error {number(scale * now.error)} to {number(scale * t.error)} {unit}"
    return [*settings, f"{repair}: {travel}, {error}"]


def _typed(c: Comparison, name: str, spec: LoopSpec) -> str:
    """Settings in the units of entry."""
    pid = next(t.controller for t in c.tried if t.name == name)
    kp, ti = as_stated(pid, spec, c.pv_span)
    gain = gain_unit(spec.gain_unit, spec.pv_unit, spec.op_unit)
    derivative = "" if name != DERIVATIVE else f" and {_td(c, pid, spec)}"
    integral = f"and Ti {number(ti)} {spec.ti_unit}" if ti else "without integral action"
    return f"Kp {number(kp)} {gain} {integral}{derivative}"


def _td(c: Comparison, pid: Pid, spec: LoopSpec) -> str:
    """A derivative time in the units of entry."""
    td = derivative_as_stated(pid, spec, c.pv_span)
    return f"Td {number(td)} {'s' if spec.ti_unit == 's' else 'min'}"


def _gains_and_losses(c: Comparison, name: str) -> str:
    """Gains and losses of settings, on the worst of all loops consistent with the data, and on a load step."""
    found = c.everywhere[name]
    travel, error = map(_against_now_pct, (found.worst_travel, found.worst_error))
    peak = f"peak after a load step {number(c.peaks[name])} times the present one"
    return f"stem travel {travel}, error {error} at worst, {peak}"


def _against_now_pct(ratio: float) -> str:
    """A change relative to now; no percentage if now is nearly zero."""
    if ratio > MANY_TIMES:
        return f"over {MANY_TIMES:g} times"
    return f"{signed(100.0 * (ratio - 1.0))} %"


def _times(t: Tried, now: Tried) -> float | None:
    """Integral of the error after a load step, over that of the present settings; None if one is infinite."""
    known = math.isfinite(t.integral_s) and math.isfinite(now.integral_s)
    return t.integral_s / now.integral_s if known else None


def table(c: Comparison, spec: LoopSpec, unit: str) -> parts.Table:
    """The settings with their effects under the load."""
    labels, lasts = texts("settings_tried"), duration(c.load.size * scan_step(c.loop))
    note = labels["note"].format(lasts=lasts) + labels["derivative"] * (c.loop.controller.td_s > 0.0)
    return page_table(
        "settings",
        (_tried_row(t, c, spec, unit) for t in parts.without_none(*c.tried, c.repaired)),
        note=note,
    )


def _tried_row(t: Tried, c: Comparison, spec: LoopSpec, unit: str) -> tuple[CellContent, ...]:
    scale, now, (kp, ti) = c.pv_span / 100.0, c.tried[0], as_stated(t.controller, spec, c.pv_span)
    found = c.everywhere.get(t.name) if t is not now else None
    worst = "" if found is None else ", ".join(map(_against_now_pct, (found.worst_travel, found.worst_error)))
    ms = "unstable" if math.isinf(t.ms) else f"{t.ms:.2f}"
    derivative = f", {_td(c, t.controller, spec)}" if t.name == DERIVATIVE else ""
    rejected = (c.peaks.get(t.name, 1.0), _times(t, now))
    return (
        parts.Cell(t.name, kind="strong" if t.name == RECOMMENDED else ""),
        parts.Cell(f"{number(kp)} {gain_unit(spec.gain_unit, spec.pv_unit, spec.op_unit)}", kp),
        parts.Cell("none" if ti == 0 else f"{number(ti)} {spec.ti_unit}{derivative}", ti),
        parts.Cell(number(t.stem_travel), t.stem_travel, _against(t.stem_travel, now.stem_travel)),
        parts.Cell(f"{number(scale * t.error)} {unit}", t.error, _against(t.error, now.error)),
        parts.Cell(f"{number(scale * t.peak)} {unit}", t.peak, _against(t.peak, now.peak)),
        worst,
        *("–" if x is None else parts.Cell(number(x), x, _against(x, 1.0)) for x in rejected),
        parts.Cell(ms, None if math.isinf(t.ms) else t.ms),
    )


def panels(c: Comparison, unit: str) -> parts.Panels:
    """The end of each simulation on the same axes."""
    scale, plots = c.pv_span / 100.0, []
    most = scale * max(float(np.abs(s.error).max(initial=0.0)) for s in c.shown.values())
    for t in c.tried:
        shown = c.shown[t.name]
        line = parts.Line("SP − PV", shown.time_s / 60.0, scale * shown.error)
        words = f"stem travel {number(t.stem_travel)} %/h, error {number(scale * t.error)} {unit}"
        name, axis = f"tried-{slug(t.name)}", f"SP − PV [{unit}]"
        plots.append(parts.Plot(name, t.name, "minutes", axis, (line,), (), words, reach=(-most, most)))
    return parts.Panels("tried", "Error with each of the settings, on the same load", tuple(plots))


def travel_field(
    found: TravelMap, places: Sequence[parts.Place], title: str, moves: str, rest: str = ""
) -> parts.Field:
    """The travel of the limit cycle over Kp and Ti, with settings as points.

    moves, rest : what travels, and the text for settings at rest.
    """
    swings = f"limit cycle (darker: {moves} travels more)"
    keys = (("swings", swings), ("calm", f"no limit cycle{rest}"), ("unstable", "unstable"))
    cells = np.abs(found.kp), found.ti_s, 3600.0 * found.travel, found.at_rest, found.unstable
    return parts.Field("travel-map", title, "Kp [%/%]", "Ti [s]", *cells, tuple(places), keys)


def _place(x: float, y: float, t: Tried) -> parts.Place:
    return parts.Place(x, y, t.name, PLACED.get(t.name, "rule"))


def trade_off_plot(c: Comparison, unit: str) -> parts.Plot | None:
    """Travel over error of the settings that are not inferior in both, and of those compared; None without such."""
    if len(c.curve) < 2:
        return None
    now, scale, most = c.tried[0], c.pv_span / 100.0, SHOWN_RATIO
    shown = [t for t in c.tried if t.stem_travel < most * now.stem_travel and t.error < most * now.error]
    places = tuple(_place(scale * t.error, t.stem_travel, t) for t in shown)
    found = [(x.error, x.travel) for x in c.curve if x.travel < most and x.error < most]
    error, travel = np.array(found, float).reshape(-1, 2).T
    at = np.array([(p.x, p.y) for p in places], float).reshape(-1, 2)
    lines = (
        parts.Line("no robust settings are better", scale * now.error * error, now.stem_travel * travel),
        parts.Line("compared", at[:, 0], at[:, 1], joined=False),
    )
    title = "Error and stem travel of each: lower left is better"
    axes = f"average absolute error [{unit}]", "stem travel [%/h]"
    return parts.Plot("price", title, *axes, lines, reach=(0.0,), places=places)


def field(c: Comparison) -> parts.Field | None:
    """The travel map with all compared settings; None for an ideal valve."""
    if c.travel is None:
        return None
    known = [t for t in c.tried if math.isfinite(t.controller.ti_s)]
    places = [_place(abs(t.controller.kp), t.controller.ti_s, t) for t in known]
    rest = "" if is_backlash(c.loop.valve) else " (seldom with stick-slip)"
    title = "Travel by describing function, without load"
    caption = "Kp in percent of OP over percent of PV, independently of the controller's unit."
    return replace(travel_field(c.travel, places, title, "the stem", rest), caption=caption)


def _kick(c: Comparison) -> dict[str, float]:
    """The start of motion of a loop with a faulty valve, as in tuning.forecast.run.

    Kick [% PV times gain], the slowest time besides Ti [s], multiples of it without a kick, minimum scans.
    """
    width = band(c.loop.valve)
    free = replace(c.loop, controller=replace(c.loop.controller, ti_s=math.inf))
    kick = KICK * max(width, 0.0)
    return {
        "kick": kick,
        "slowest_s": slowest_s(free),
        "times": PRELUDE,
        "least": LEAST_PRELUDE,
    }


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None


def model(c: Comparison, spec: LoopSpec, unit: str) -> str:
    """Data with which a page simulates the loop with other settings, as JSON."""
    loop, h = c.loop, scan_step(c.loop)
    d, pid = discretize(loop.process, h), c.loop.controller
    breakaway, sliding, tolerance = law_of(loop.valve)
    law = per_scan(pid, h)
    alike = [t for t in c.tried if t.controller.td_s == pid.td_s]  # the sliders change Kp and Ti only
    found: dict[str, Any] = {
        "process": {"pole": d.pole, "now": d.now, "before": d.before, "delay": d.delay},
        "valve": {"breakaway": breakaway, "sliding": sliding, "tolerance": _finite(tolerance)},
        "scan_s": h,
        "td_s": pid.td_s,
        "controller": {
            "slope": law.kd / law.kp,
            "slope_keep": law.slope_keep,
            "pv_keep": law.pv_keep,
            "gap": law.gap,
            "gap_gain": law.gap_gain,
            "squared": law.squared > 0.0,
            "most": _finite(law.most),
        },
        "op_lo": pid.op_lo,
        "op_hi": pid.op_hi,
        "op_start": 0.5 * (pid.op_lo + pid.op_hi),
        "warm_up": WARM_UP,
        "prelude": _kick(c),
        "settings": [
            {"name": t.name, "kp": t.controller.kp, "ti_s": _finite(t.controller.ti_s)} for t in alike
        ],
        "ti_middle_s": simc(loop.process, scan_s=h).ti_s,
        "spread": SPREAD,
        "opening_h": max(float(s.time_s[-1]) for s in c.shown.values()) / 3600.0,
        "pv_scale": c.pv_span / 100.0,
        "pv_unit": unit,
    }
    found["law"] = {
        "form": str(spec.form),
        "band": spec.gain_unit == "band",
        "ratio": unit_ratio(spec, c.pv_span),
        "kp_unit": gain_unit(spec.gain_unit, spec.pv_unit, spec.op_unit),
        "ti_unit": spec.ti_unit,
    }
    return json.dumps(found)


def settings_page(loop: str, night: str, c: Comparison, spec: LoopSpec) -> parts.Page:
    """The settings page of a loop. Its errors are in the unit of PV, also if percent is of the recorded range."""
    unit, labels = spec.pv_unit or "own unit", texts("settings_tried")
    meant = texts("settings") | (
        texts("settings_of_integrators") if isinstance(c.loop.process, Integrator) else {}
    )
    first = (parts.Text((opening(c, spec, unit),), "lead"), panels(c, unit), table(c, spec, unit))
    tried = parts.WhatIf("try", labels["title"], model(c, spec, unit), c.load, labels["caption"])
    named = parts.Listing(
        tuple((f"{t.name}:", meant[t.name]) for t in parts.without_none(*c.tried, c.repaired))
    )
    sections = (
        parts.Section("Settings compared", parts.without_none(*first, trade_off_plot(c, unit), field(c))),
        parts.Section("Try settings", (parts.Text((labels["hint"],)), tried)),
        parts.Section("What the settings are, for experts", (named,), closed=True),
    )
    subtitle = f"settings compared and simulated on night {night}"
    return parts.Page(f"{slug(loop)}-settings", f"{loop}: settings", subtitle, sections)
