"""Pictures of an explanation as blocks of a page: trends with marked spans, misfit before and after, the shape."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import welch

from analyzer.explain.one_loop import Explained
from analyzer.explain.page_words import AXES, BROUGHT, CURVES, FEATURES, KINDS, caption
from analyzer.pages.words import number
from identification.estimation.prediction_error import Fitted, Problem
from identification.mismatch.catalogue import EFFECTS, fault
from identification.mismatch.cross_validation import anchored
from identification.mismatch.curves.controller import by_stated_law
from identification.mismatch.curves.drawn import Drawing, Shape
from identification.mismatch.curves.stretches import busiest
from identification.mismatch.location.features import Group, groups
from identification.mismatch.location.locate import Located, profile
from identification.mismatch.location.where import won_over
from identification.record import Floats
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot
from reports.pages import Area, Band, Line, Mark, Panels, Plot, Trend

WHOLE = 1500
"""Buckets of the trend over the whole recording: a screen's width."""
CLOSE = 900
"""Samples of the close look at most."""
CLOSE_MEMORIES = 15.0
"""Length of the close look in memories of the loop (dead time and time constant)."""
LEAST_CLOSE = 240
"""Samples of the close look at least."""
SEGMENTS = 8
"""Parts that a spectrum is averaged over."""
POWERS = ("op_rate", "after_reversals")
"""Features drawn over powers of ten: most of a record is near zero of them."""
NEARLY_ALL = 0.9
"""Spans that hold more than this share of a recording are not marked: they tell nothing."""
SEEN = 0.2
"""Errors are drawn on an axis that reaches this part of their size to either side at least."""
ERRORS = 2.0
"""Half width of a profile's band in standard errors."""


def simulations(e: Explained) -> dict[str, Floats]:
    """PV as simulated [% of span], anchored as for the proof, shape (n,) each, by colour."""
    p = e.found.p
    fits = {"baseline": e.found.plain} | ({"model": e.found.best} if e.found.accepted else {})
    out = {}
    window = e.found.proof.window if e.found.proof is not None else 0
    for kind, fit in fits.items():
        out[kind] = p.inputs.level + anchored(p.y, simulate(p.inputs, fit.model.c), window)
    if e.brought is not None:
        out["brought"] = e.brought.simulated
    return out


LABELS = {"baseline": "plain loop", "model": "improved", "brought": BROUGHT}


def signals(e: Explained) -> list[tuple[str, str, int, Floats]]:
    """Label, colour, panel and values of all that is drawn over time."""
    s, p = e.case.subject, e.found.p
    recorded = p.inputs.level + p.y
    sims = simulations(e)
    out = [] if s.sp is None else [("SP", "sp", 0, s.sp)]
    label = "PV, clock set right" if e.found.late_s else "PV recorded"
    out.append((label, "recorded", 0, recorded))
    out += [(LABELS[k], k, 0, x) for k, x in sims.items()]
    out += [(f"left by {LABELS[k]}", k, 1, recorded - x) for k, x in sims.items()]
    return [*out, ("OP", "op", 2, s.op)]


def trend(e: Explained, name: str, title: str, part: slice, buckets: int, caption: str) -> Trend:
    """Recording, simulations, what they leave, and OP, with the spans that matter marked."""
    r = e.case.prepared.record
    n = part.stop - part.start
    edges = (np.arange(min(buckets, n)) * n) // min(buckets, n)
    bands = []
    for label, kind, panel, x in signals(e):
        low, high = (f.reduceat(x[part], edges) for f in (np.minimum, np.maximum))
        bands.append(Band(label, kind, panel, low, high))
    gap = np.logical_and.reduceat(~e.case.subject.usable[part], edges)
    spans = tuple((r.start_s + a, r.start_s + b) for a, b in e.said.where.get("spans", []))
    length = e.case.subject.pv.size * r.dt_s
    whole = sum(b - a for a, b in spans) > NEARLY_ALL * length
    time = r.start_s + (part.start + edges) * r.dt_s
    panels = ("PV [% of span]", "left over [%]", "OP [%]")
    return Trend(name, title, time, gap, tuple(bands), panels, (), caption, () if whole else spans)


def weight(e: Explained, at: Located) -> Floats:
    """How much each sample matters for the verdict, shape (n,)."""
    n = e.case.subject.pv.size
    marked = e.found.recorder or e.found.controller
    if marked is not None and not marked.where.all():
        return np.concatenate((marked.where.astype(float), np.zeros(n)))[:n]
    if e.found.accepted:
        return np.maximum(won_over(e.found.p, e.found.plain, e.found.best)[0], 0.0)
    return at.local if e.found.left > 0 else np.zeros(n)


def close_part(e: Explained, at: Located) -> slice:
    """The stretch of the close look: where the verdict rests most, or where OP travels most."""
    s, c = e.case.subject, e.found.plain.model.c
    memory = CLOSE_MEMORIES * float(c[Slot.T] + c[Slot.L]) / s.dt_s
    length = min(int(np.clip(memory, LEAST_CLOSE, CLOSE)), s.pv.size)
    w = weight(e, at)
    return busiest(np.cumsum(w), length) if w.any() else busiest(s.op, length, s.usable)


def trends(e: Explained, at: Located) -> tuple[Trend, ...]:
    """The whole recording, and the stretch that tells most at full resolution."""
    n = e.case.subject.pv.size
    marked = "Shaded: the spans that carry the misfit. " if e.said.where.get("spans") else ""
    how = "Wheel or drag zooms, shift-drag or arrows move, double click shows all; UTC."
    whole = trend(e, "recording", "The whole recording", slice(0, n), WHOLE, marked + how)
    part = close_part(e, at)
    if part.stop - part.start >= n:
        return (whole,)
    title = "A closer look where the misfit is" if marked else "A closer look where OP moves most"
    return whole, trend(e, "closer", title, part, CLOSE, "Each sample, as recorded.")


def feature_plot(g: Group, fits: Sequence[tuple[str, str, Fitted]], p: Problem, by: str, note: str) -> Plot:
    """Mean (or size) of the one-step errors along one feature, before and after, with two standard errors."""
    judged = p.weight > 0
    log = "x" if g.name in POWERS and float(g.signal[judged].max()) > 0 else ""
    lines, areas = [], []
    for label, kind, fit in fits:
        errors = fit.e[judged] if by == "power" or g.sense is None else fit.e[judged] * g.sense[judged]
        found = profile(g.signal[judged], errors)
        y = np.sqrt(found.power) if by == "power" else found.mean
        half = ERRORS * np.sqrt(found.power / found.count) / (np.sqrt(2.0) if by == "power" else 1.0)
        at = 0.5 * (found.low + found.high)
        if log:
            at = np.maximum(at, 0.5 * np.min(at[at > 0], initial=np.inf))
        lines.append(Line(label, at, y, kind=kind))
        areas.append(Area(at, y - half, y + half, kind))
    along = " along OP's direction" if by == "sign" and g.sense is not None else ""
    y_label = "size of errors [% PV]" if by == "power" else f"mean error{along} [% PV]"
    size = float(np.sqrt(np.mean(fits[-1][2].e[judged] ** 2)))
    reach = ((1 - SEEN) * size, (1 + SEEN) * size) if by == "power" else (-SEEN * size, SEEN * size)
    return Plot(
        f"misfit-{g.name}",
        FEATURES[g.name],
        AXES[g.name],
        y_label,
        tuple(lines),
        (),
        note,
        tuple(areas),
        log,
        reach,
    )


def spectrum_plot(e: Explained) -> Plot:
    """Spectrum of what the simulations leave, as its part of the rms per octave of period."""
    s, p = e.case.subject, e.found.p
    recorded, lines = p.inputs.level + p.y, []
    for kind, x in simulations(e).items():
        if kind == "brought":
            continue
        f, power = welch(recorded - x, 1.0 / s.dt_s, nperseg=max(min(s.pv.size // SEGMENTS, 4096), 64))
        size = np.sqrt(np.log(2.0) * f[1:] * power[1:])
        keep = np.unique(np.geomspace(1, size.size, 120).astype(int)) - 1
        smooth = np.sqrt([np.mean(size[max(k - k // 8, 0) : k + k // 8 + 1] ** 2) for k in keep])
        lines.append(Line(SHORT[kind], 1.0 / f[1:][keep], smooth, kind=kind))
    note = "Load and noise are in it as well: they stay."
    return Plot(
        "misfit-spectrum",
        "Spectrum of what is left",
        "period [s]",
        "% PV per octave",
        tuple(lines),
        (),
        note,
        (),
        "x",
    )


SHORT = {"baseline": "plain loop", "model": "improved loop"}


def misfit_panels(e: Explained, at: Located) -> Panels:
    """The one-step errors along each feature, and the spectrum, before and after."""
    s, p, c = e.case.subject, e.found.p, e.found.plain.model.c
    late, memory = float(c[Slot.L]) / s.dt_s, float(c[Slot.L] + c[Slot.T]) / s.dt_s
    fits = [("plain loop", "baseline", e.found.plain)]
    fits += [("improved loop", "model", e.found.best)] if e.found.accepted else []
    known = {f.name: f for f in at.features}
    plots = []
    for g in groups(s.pv, s.op, s.dt_s, min(round(late), s.pv.size // 4), max(round(memory), 2)):
        f = known.get(g.name)
        if g.name in ("op_direction", "at_limits"):
            continue
        by, note = (f.of, note_of(f.p, f.carries)) if f is not None else ("sign", "")
        plots.append(feature_plot(g, fits, p, by, note))
    caption = (
        "One-step errors: simulation plus noise model against PV, sample by sample; bands are two standard errors. "
        "A sound model lies flat."
    )
    return Panels("misfit", "The misfit along what the loop was doing", (*plots, spectrum_plot(e)), caption)


def note_of(p: float, carries: bool) -> str:
    """Whether a feature carries the misfit, under its plot."""
    return f"Carries the misfit (chance {max(p, 0.01):.2g})." if carries else "Does not carry the misfit."


def found_shape(e: Explained) -> Shape | None:
    """The shape of the first effect found."""
    f, s = e.found, e.case.subject
    finding = f.recorder or f.controller
    if finding is not None:
        free = f.plain.model.c.copy()
        free[Slot.CLIP_HI], free[Slot.CLIP_LO] = np.inf, -np.inf
        drawn = fault(finding.name).drawn
        return None if drawn is None else drawn(finding, s, f.p.inputs.level + simulate(f.p.inputs, free))
    if not f.accepted:
        return None
    added, known = f.best.model.added[0], e.said.effects[0].parameters
    curve = EFFECTS[added.name].curve
    drawing = Drawing(f.p.inputs, added, known, f.best.model.c, f.plain.model.c)
    return None if curve is None else curve(drawing)


def shape_plot(shape: Shape, name: str = "shape") -> Plot:
    """A shape as a plot: what was recorded below, what was found above."""
    order = {
        "recorded": 0,
        "plain": 1,
        "stated": 1,
        "limit": 1,
        "least": 2,
        "most": 2,
        "points": 3,
        "found": 4,
    }
    lines, areas = [], []
    for d in sorted(shape.curves, key=lambda d: order[d.name]):
        kind = KINDS.get(d.name, "recorded" if d.name == "recorded" else "model")
        lines.append(Line(CURVES[d.name], d.x, d.y, d.name != "points", kind))
        if d.low is not None and d.high is not None:
            areas.append(Area(d.x, d.low, d.high, kind))
    marks = tuple(Mark(x, number(x)) for x in shape.places)
    across, along = (f"{a.what} [{a.unit}]" if a.unit else a.what for a in (shape.x, shape.y))
    what = f"{shape.y.what} over {shape.x.what}"
    title = what[:1].upper() + what[1:] if name == "shape" else "OP rebuilt and recorded"
    return Plot(
        name, title, across, along, tuple(lines), marks, caption(shape.effect, shape.kind), tuple(areas)
    )


def controller_plot(e: Explained) -> Plot | None:
    """OP rebuilt by the stated settings, where they are known and nothing is wrong with them."""
    if e.found.controller is not None or e.found.law is None:
        return None
    shape = by_stated_law("controller", e.case.subject)
    return None if shape is None else shape_plot(shape, "law")
