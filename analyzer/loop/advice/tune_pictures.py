"""The pictures of a tuning: describing-function curves, map of settings, simulated trends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analyzer.loop.advice.settings_side_by_side import middle_ti
from analyzer.loop.advice.tuned import Tuning
from identification.models import Pid
from reports.pages import Field, Line, Panels, Picture, Place, Plot
from tuning.describing import describe
from tuning.forecast import in_digits, loop_in_digits, run
from tuning.harmonic_balance import curves, travel_map

MAP_POINTS = 36
"""Points of the map along each axis."""
SPREAD = 20.0
"""Factor of the map's range below and above the present settings."""


def pictures(t: Tuning, title: str) -> tuple[Picture, ...]:
    """Describing functions, travel map and forecast, those that exist."""
    out: tuple[Picture, ...] = ()
    if t.model.valve is not None:
        out = (_curves(t, title), *([_map_field(t, title)] if t.model.controller.kp else []))
    return out if t.proposal.new is None else (*out, _trend_panels(t, t.proposal.new, title))


def _curves(t: Tuning, title: str) -> Plot:
    """Intersections of the describing function with the loop: limit cycles."""
    c = curves(t.model)
    reach = 1.4 * float(np.abs(c.valve).max(initial=1.0))
    re, im = c.linear.real, c.linear.imag
    inside = (re > -0.3 * reach) & (re < reach) & (im > -0.8 * reach) & (im < 0.25 * reach)
    proposal_lines = (
        Line("valve N(A)", c.valve.real, c.valve.imag, kind="op"),
        Line("−1/(G C)", re[inside], im[inside], kind="pv"),
    )
    at = [(describe(t.model.valve, b.op_amplitude), b) for b in c.crossings]
    places = tuple(
        Place(n.real, n.imag, f"{b.period_s:.3g} s{'' if b.stable else ', unstable'}", "cycle") for n, b in at
    )
    whole = f"{title}: N(A) and −1/(G C)"
    return Plot("limit-cycle", whole, "real", "imaginary", proposal_lines, reach=(0.0,), places=places)


def _map_field(t: Tuning, title: str) -> Field:
    """Valve travel of each pair of settings, those without a cycle, and those that are unstable."""
    from analyzer.pages.compared import travel_field

    c, new = t.model.controller, t.proposal.controller
    kp = c.kp * np.geomspace(1 / SPREAD, SPREAD, MAP_POINTS)
    now_s = middle_ti(t.model)
    top = max(SPREAD * now_s, 3 * new.ti_s if new else 0.0)
    found = travel_map(t.model, kp, np.geomspace(now_s / 4, top, MAP_POINTS))
    places = [Place(abs(c.kp), now_s, "now", "now")]
    places += [Place(abs(new.kp), new.ti_s, "proposed", "recommended")] if new else []
    return travel_field(found, places, f"{title}: predicted travel of OP", "OP")


def _trend_panels(t: Tuning, new: Pid, title: str) -> Panels:
    """Both tunings on the same reconstructed load."""
    pv: list[Line] = []
    op: list[Line] = []
    for name, kind, c in (("now", "pv", t.model.controller), ("proposed", "brought", new)):
        r = run(replace(loop_in_digits(t.model), controller=c), in_digits(t.load))
        last = slice(-min(len(r), int(15 * (t.period_s or 600) / r.dt_s)), None)
        hours, stem = r.time_s[last] / 3600.0, r.stem
        pv.append(Line(name, hours, r.pv[last], kind=kind))
        op.append(Line(name, hours, r.op[last], kind=kind))
        op.append(Line(f"stem, {name}", hours, stem[last], kind=f"{kind} stem"))
    plots = (
        Plot("forecast-pv", "Error", "hours", "PV − SP [%]", tuple(pv)),
        Plot("forecast-op", "Valve", "hours", "OP, stem [%]", tuple(op)),
    )
    return Panels("forecast", f"{title}: both tunings on the same load", plots)
