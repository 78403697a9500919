"""Pictures of an explanation as blocks of a page, from what was computed: trends, misfit before and after, shapes."""

from __future__ import annotations

import numpy as np

from analyzer.explain.one_loop import Explained
from analyzer.explain.page_words import AXES, BROUGHT, CURVES, FEATURES, KINDS, caption
from analyzer.explain.views import CLOSE, FeatureView, Spectrum
from analyzer.pages.words import number
from identification.mismatch.pictures import Shape
from identification.record import Floats
from reports.pages import Area, Band, Line, Mark, Panels, Plot, Trend

WHOLE = 1500
"""Buckets of the trend over the whole recording: a screen's width."""
NEARLY_ALL = 0.9
"""Spans that hold more than this share of a recording are not marked: they tell nothing."""
SEEN = 0.2
"""Errors are drawn on an axis that reaches this part of their size to either side at least."""
LABELS = {"baseline": "plain loop", "model": "improved", "brought": BROUGHT}
SHORT = {"baseline": "plain loop", "model": "improved loop"}


def signals(e: Explained) -> list[tuple[str, str, int, Floats]]:
    """Label, colour, panel and values of all that is drawn over time."""
    s, v = e.case.subject, e.views
    out = [] if s.sp is None else [("SP", "sp", 0, s.sp)]
    label = "PV, clock set right" if e.found.late_s else "PV recorded"
    out.append((label, "recorded", 0, v.recorded))
    out += [(LABELS[k], k, 0, x) for k, x in v.simulated.items()]
    out += [(f"left by {LABELS[k]}", k, 1, v.recorded - x) for k, x in v.simulated.items()]
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


def trends(e: Explained) -> tuple[Trend, ...]:
    """The whole recording, and the stretch that tells most at full resolution."""
    marked = "Shaded: the spans that carry the misfit. " if e.said.where.get("spans") else ""
    how = "Drag, or the wheel with Ctrl, zooms; shift-drag or arrows move, double click shows all."
    whole = slice(0, e.case.subject.pv.size)
    first = trend(e, "recording", "The whole recording", whole, WHOLE, marked + how)
    if e.views.close is None:
        return (first,)
    title = "A closer look where the misfit is" if marked else "A closer look where OP moves most"
    return first, trend(e, "closer", title, slice(*e.views.close), CLOSE, "Each sample, as recorded.")


def feature_plot(f: FeatureView) -> Plot:
    """Mean (or size) of the one-step errors along one feature, before and after, with two standard errors."""
    lines = tuple(Line(SHORT[p.kind], p.x, p.y, kind=p.kind) for p in f.profiles)
    areas = tuple(Area(p.x, p.low, p.high, p.kind) for p in f.profiles)
    along = " along OP's direction" if f.by == "sign" and f.directed else ""
    label = "size of errors [% PV]" if f.by == "power" else f"mean error{along} [% PV]"
    reach = (1 - SEEN, 1 + SEEN) if f.by == "power" else (-SEEN, SEEN)
    ends = (reach[0] * f.size, reach[1] * f.size)
    note, log = note_of(f.p, f.carries), "x" if f.log else ""
    return Plot(f"misfit-{f.name}", FEATURES[f.name], AXES[f.name], label, lines, (), note, areas, log, ends)


def note_of(p: float | None, carries: bool) -> str:
    """Whether a feature carries the misfit, under its plot."""
    if p is None:
        return ""
    return f"Carries the misfit (chance {max(p, 0.01):.2g})." if carries else "Does not carry the misfit."


def spectrum_plot(spectra: tuple[Spectrum, ...]) -> Plot:
    """Spectrum of what the simulations leave, as its part of the rms per octave of period."""
    lines = tuple(Line(SHORT[s.kind], s.period_s, s.size, kind=s.kind) for s in spectra)
    note = "Load and noise are in it as well: they stay."
    title = "Spectrum of what is left"
    return Plot("misfit-spectrum", title, "period [s]", "% PV per octave", lines, (), note, (), "x")


def misfit_panels(e: Explained) -> Panels:
    """The one-step errors along each feature, and the spectrum, before and after."""
    plots = (*(feature_plot(f) for f in e.views.features), spectrum_plot(e.views.spectra))
    caption = (
        "One-step errors: simulation plus noise model against PV, sample by sample; bands are two standard errors. "
        "A sound model lies flat."
    )
    return Panels("misfit", "The misfit along what the loop was doing", plots, caption)


ORDER = {"recorded": 0, "plain": 1, "stated": 1, "limit": 1, "least": 2, "most": 2, "points": 3, "found": 4}
"""What is drawn above what."""


def shape_plot(shape: Shape, name: str = "shape") -> Plot:
    """A shape as a plot: what was recorded below, what was found above."""
    lines, areas = [], []
    for d in sorted(shape.curves, key=lambda d: ORDER[d.name]):
        kind = KINDS.get(d.name, "recorded" if d.name == "recorded" else "model")
        lines.append(Line(CURVES[d.name], d.x, d.y, d.name != "points", kind))
        if d.low is not None and d.high is not None:
            areas.append(Area(d.x, d.low, d.high, kind))
    marks = tuple(Mark(x, number(x)) for x in shape.places)
    across, along = (f"{a.what} [{a.unit}]" if a.unit else a.what for a in (shape.x, shape.y))
    what = f"{shape.y.what} over {shape.x.what}"
    title = what[:1].upper() + what[1:] if name == "shape" else "OP rebuilt and recorded"
    said = caption(shape.effect, shape.kind)
    return Plot(name, title, across, along, tuple(lines), marks, said, tuple(areas))
