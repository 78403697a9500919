"""Drawings of an explanation's page: recording and simulations, misfit by feature and period, findings."""

from __future__ import annotations

import numpy as np

from analyzer.explain.explained import Explained
from analyzer.explain.words import CURVES, FEATURES, NOTES, ROWS, TEXTS
from analyzer.pages.words import number
from identification.estimation.model import Fitted
from identification.mismatch.catalogue import fault
from identification.mismatch.location import Feature, Group, profile
from identification.mismatch.outside import about
from identification.mismatch.pictures import Drawing, Picture, by_stated_law, most_active
from identification.mismatch.proof import course
from identification.mismatch.where import located_in, won_over
from identification.record import Floats, Mask
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot
from reports.pages import Area, Band, Line, Mark, Panels, Plot, Trend

WHOLE = 1500
"""Buckets of the trend over the whole recording: a screen's width."""
CLOSE, LEAST_CLOSE = 900, 240
"""Maximum and minimum samples of the close-up."""
CLOSE_MEMORIES = 15.0
"""Length of the close-up in settling times of the loop (dead time and time constant)."""
NEARLY_ALL = 0.9
"""Spans above this share of a recording are not marked, because they give no information."""
SEEN = 0.2
"""Errors are drawn on an axis that includes at least this part of their size on either side."""
SEGMENTS = 8
"""Parts over which a spectrum is averaged."""
LONGEST_SEGMENT, SHORTEST_SEGMENT = 4096, 64
"""Maximum and minimum samples of such a part; ours."""
SPECTRUM_POINTS = 120
"""Points of a spectrum."""
ERRORS = 2.0
"""Half width of a profile's band in standard errors."""
LABELS = {"baseline": ROWS["baseline"], "model": "improved", "brought": ROWS["brought"]}
SHORT = {"baseline": ROWS["baseline"], "model": ROWS["explained"]}


def recorded_pv(e: Explained) -> Floats:
    """PV with its clock corrected [% of span], shape (n,)."""
    return e.found.p.inputs.level + e.found.p.y


def simulations(e: Explained) -> dict[str, Floats]:
    """PV by baseline, improved and user's model [% of span], anchored as for the proof, shape (n,) each."""
    p, proof = e.found.p, e.found.proven
    names = ("baseline", "model") if e.found.accepted else ("baseline",)
    drawn = dict(zip(names, proof.drawn, strict=False))
    out = {k: p.inputs.level + course(p, c, proof.window, proof.placed) for k, c in drawn.items()}
    return out if e.user_model is None else out | {"brought": e.user_model.simulated}


def drawn_trends(e: Explained) -> tuple[Trend, ...]:
    """The whole recording, and the most informative stretch at full resolution."""
    marked = bool(e.said.where.get("spans"))
    drawn, n, part = signals(e), e.case.recording.pv.size, close_part(e)
    how = NOTES["shaded"] * marked + NOTES["zoom"]
    whole = trend(e, drawn, slice(0, n), WHOLE, ("recording", "The whole recording", how))
    if part.stop - part.start >= n:
        return (whole,)
    title = "A closer look where the misfit is" if marked else "A closer look where OP moves most"
    return whole, trend(e, drawn, part, CLOSE, ("closer", title, "Each sample, as recorded."))


def signals(e: Explained) -> list[tuple[str, str, int, Floats]]:
    """Label, colour, panel and values of everything drawn over time."""
    s, pv, simulated = e.case.recording, recorded_pv(e), simulations(e)
    out = [] if s.sp is None else [("SP", "sp", 0, s.sp)]
    out.append(("PV, clock set right" if e.found.late_s else "PV recorded", "recorded", 0, pv))
    out += [(LABELS[k], k, 0, x) for k, x in simulated.items()]
    out += [(f"residual of {LABELS[k]}", k, 1, pv - x) for k, x in simulated.items()]
    return [*out, ("OP", "op", 2, s.op)]


def trend(
    e: Explained,
    drawn: list[tuple[str, str, int, Floats]],
    part: slice,
    buckets: int,
    words: tuple[str, str, str],
) -> Trend:
    """A part of the time courses, with relevant spans marked; its name, title and caption."""
    r, usable = e.case.prepared.record, e.case.recording.usable
    n = part.stop - part.start
    edges = (np.arange(min(buckets, n)) * n) // min(buckets, n)
    bands = []
    for label, kind, panel, x in drawn:
        low, high = (f.reduceat(x[part], edges) for f in (np.minimum, np.maximum))
        bands.append(Band(label, kind, panel, low, high))
    gap = np.logical_and.reduceat(~usable[part], edges)
    spans = tuple((r.start_s + a, r.start_s + b) for a, b in e.said.where.get("spans", []))
    whole = sum(b - a for a, b in spans) > NEARLY_ALL * usable.size * r.dt_s
    time = r.start_s + (part.start + edges) * r.dt_s
    panels = ("PV [% of span]", "residual [%]", "OP [%]")
    name, title, caption = words
    return Trend(name, title, time, gap, tuple(bands), panels, (), caption, () if whole else spans)


def close_part(e: Explained) -> slice:
    """The stretch of the close-up: where the evidence is largest, or where OP travels most."""
    s, c = e.case.recording, e.found.plain.model.c
    memory = CLOSE_MEMORIES * float(c[Slot.T] + c[Slot.L]) / s.dt_s
    length = min(int(np.clip(memory, LEAST_CLOSE, CLOSE)), s.pv.size)
    w = weight(e)
    return most_active(np.cumsum(w), length) if w.any() else most_active(s.op, length, s.usable)


def weight(e: Explained) -> Floats:
    """Weight of each sample in the verdict, shape (n,)."""
    found, n = e.found, e.case.recording.pv.size
    if found.finding is not None and not found.finding.where.all():
        return np.concatenate((found.finding.where.astype(float), np.zeros(n)))[:n]
    if found.accepted:
        return np.maximum(won_over(found.p, found.plain, found.best)[0], 0.0)
    return located_in(found.p, found.plain, e.case.recording).local if found.residual_nat > 0 else np.zeros(n)


def misfit_panels(e: Explained) -> Panels:
    """The one-step errors along each feature that needs a plot, and the spectrum, before and after."""
    at = located_in(e.found.p, e.found.plain, e.case.recording)
    known = {f.name: f for f in at.features}
    along = (feature_plot(e, g, known.get(g.name)) for g in at.groups if "axis" in FEATURES[g.name])
    plots = *along, spectrum_plot(e)
    return Panels("misfit", "Misfit over each feature, and its spectrum", plots, NOTES["misfit"])


def feature_plot(e: Explained, g: Group, f: Feature | None) -> Plot:
    """Mean (or size) of the one-step errors along one feature, before and after, with two standard errors."""
    judged, by = e.found.p.weight > 0, "sign" if f is None else f.by
    fits = {"baseline": e.found.plain} | ({"model": e.found.best} if e.found.accepted else {})
    known = FEATURES[g.name]
    log = "powers" in known and float(g.signal[judged].max(initial=0.0)) > 0
    lines, areas = [], []
    for kind, fit in fits.items():
        x, y, half = errors_along(g, fit, judged, by)
        if log:
            x = np.maximum(x, 0.5 * np.min(x[x > 0], initial=np.inf))
        lines.append(Line(SHORT[kind], x, y, kind=kind))
        areas.append(Area(x, y - half, y + half, kind))
    along = " along OP's direction" if g.sense is not None else ""
    middle, label = (1.0, "size of errors") if by == "power" else (0.0, f"mean error{along}")
    size = float(np.sqrt(np.mean(fit.e[judged] ** 2)))
    ends = (middle - SEEN) * size, (middle + SEEN) * size
    words = f"misfit-{g.name}", known["title"], known["axis"], f"{label} [% PV]"
    return Plot(*words, tuple(lines), (), note_of(f), tuple(areas), "x" if log else "", ends)


def errors_along(g: Group, fit: Fitted, judged: Mask, by: str) -> tuple[Floats, Floats, Floats]:
    """Places along a feature, mean (or size) of a fit's one-step errors there, and two standard errors, (m,) each."""
    errors = fit.e[judged] if by == "power" or g.sense is None else fit.e[judged] * g.sense[judged]
    found = profile(g.signal[judged], errors)
    half, place = ERRORS * np.sqrt(found.power / found.samples), 0.5 * (found.low + found.high)
    return (place, np.sqrt(found.power), half / np.sqrt(2.0)) if by == "power" else (place, found.mean, half)


def note_of(f: Feature | None) -> str:
    """Whether the misfit depends on a feature, as a note below its plot; empty if it was not tested."""
    if f is None:
        return ""
    return f"Significant (p-value {max(f.p, 0.01):.2g})." if f.carries else "Not significant."


def spectrum_plot(e: Explained) -> Plot:
    """Spectrum of the simulation errors, as the share of the rms per octave of period."""
    pv, dt_s = recorded_pv(e), e.case.recording.dt_s
    residuals = {k: pv - x for k, x in simulations(e).items() if k != "brought"}
    lines = tuple(Line(SHORT[k], *spectrum(x, dt_s), kind=k) for k, x in residuals.items())
    words = "misfit-spectrum", "Spectrum of the residual", "period [s]", "% PV per octave"
    return Plot(*words, lines, (), NOTES["spectrum"], (), "x")


def spectrum(x: Floats, dt_s: float) -> tuple[Floats, Floats]:
    """Periods [s] and a signal's share of the rms per octave there [its unit], shape (m,) each."""
    from scipy.signal import welch  # its import takes longer than most explanations

    segment = max(min(x.size // SEGMENTS, LONGEST_SEGMENT), SHORTEST_SEGMENT)
    f, power = welch(x, 1.0 / dt_s, nperseg=min(segment, x.size))
    size = np.sqrt(np.log(2.0) * f[1:] * power[1:])
    keep = np.unique(np.geomspace(1, size.size, SPECTRUM_POINTS).astype(int)) - 1
    smooth = np.sqrt([np.mean(size[max(k - k // 8, 0) : k + k // 8 + 1] ** 2) for k in keep])
    return 1.0 / f[1:][keep], smooth


def found_plot(e: Explained) -> Plot | None:
    """The picture of an unnamed effect that explains the loop best, otherwise of the first effect found."""
    found, answer, finding = e.found, e.said, e.found.finding
    inputs, plain = found.p.inputs, found.plain.model.c
    if finding is not None:
        free, shown = plain.copy(), fault(finding.name)
        free[Slot.CLIP_HI], free[Slot.CLIP_LO] = np.inf, -np.inf
        model = inputs.level + simulate(inputs, free)
        return shape_plot(shown.drawn and shown.drawn(finding, e.case.recording, model), shown.caption)
    if answer.outside is not None and found.outside is not None:
        fit, known = found.outside.fit, answer.outside.parameters
        added = found.outside.row
    elif found.accepted:
        fit, known = found.best, answer.effects[0].parameters
        added = fit.model.added[0]
    else:
        return None
    effect = about(added.name)
    drawing = Drawing(inputs, added, known, fit.model.c, plain)
    return shape_plot(effect.curve and effect.curve(drawing), effect.caption)


def law_plot(e: Explained) -> Plot | None:
    """OP recomputed by the stated settings if no fault was found in them."""
    if e.found.controller is not None or e.found.law is None:
        return None
    shape, caption = by_stated_law(e.case.recording), NOTES["sound_controller"]
    return shape_plot(shape, caption, "law", "OP rebuilt and recorded")


def shape_plot(shape: Picture | None, caption: str, name: str = "shape", title: str = "") -> Plot | None:
    """A picture as a plot: the recorded curve below, the finding above; `caption`, or that of its kind."""
    if shape is None:
        return None
    lines, areas = [], []
    for d in sorted(shape.curves, key=lambda d: CURVES[d.name]["above"]):
        kind = CURVES[d.name]["kind"]
        lines.append(Line(CURVES[d.name]["label"], d.x, d.y, d.name != "points", kind))
        if d.low is not None and d.high is not None:
            areas.append(Area(d.x, d.low, d.high, kind))
    marks = tuple(Mark(x, number(x)) for x in shape.places)
    across, along = (f"{a.what} [{a.unit}]" if a.unit else a.what for a in (shape.x, shape.y))
    what = f"{shape.y.what} over {shape.x.what}"
    words = name, title or what[:1].upper() + what[1:], across, along
    return Plot(*words, tuple(lines), marks, caption or TEXTS["shapes"].get(shape.kind, ""), tuple(areas))
