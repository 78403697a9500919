"""What an explanation shows, computed once: simulations, the telling stretch, spectra, errors by feature, shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from analyzer.explain.user_model import Brought
from identification.estimation.candidate import Fitted
from identification.mismatch.answer import Answer
from identification.mismatch.catalogue import fault
from identification.mismatch.explanation import Explanation
from identification.mismatch.fault_pictures import busiest, by_stated_law
from identification.mismatch.location import Group, Located, groups, profile
from identification.mismatch.outside import about
from identification.mismatch.pictures import Drawing, Shape
from identification.mismatch.proof import course
from identification.mismatch.recording import Recording
from identification.mismatch.where import located_in, won_over
from identification.record import Floats
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

CLOSE = 900
"""Samples of the close look at most."""
CLOSE_MEMORIES = 15.0
"""Length of the close look in memories of the loop (dead time and time constant)."""
LEAST_CLOSE = 240
"""Samples of the close look at least."""
SEGMENTS = 8
"""Parts that a spectrum is averaged over."""
LONGEST_SEGMENT, SHORTEST_SEGMENT = 4096, 64
"""Samples of such a part at most and at least; ours."""
SPECTRUM_POINTS = 120
"""Points of a spectrum."""
POWERS = ("op_rate", "after_reversals")
"""Features drawn over powers of ten: most of a record is near zero of them."""
UNDRAWN = ("op_direction", "at_limits")
"""Features of two or three values, which a table says better."""
ERRORS = 2.0
"""Half width of a profile's band in standard errors."""


@dataclass(frozen=True, slots=True)
class Profile:
    """One-step errors along a feature: where (x), their mean or size (y), and two standard errors about it, (m,)."""

    kind: str
    x: Floats
    y: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class FeatureView:
    """The errors along one feature, before and after.

    by : "power" (their size) or "sign" (their mean); directed : whether the mean is along OP's direction; log :
    whether the feature is drawn over powers of ten; size : rms of the last model's errors [% PV]; p : p-value of the
    misfit's tie to it, None where it was not tested; carries : whether the misfit is tied to it.
    """

    name: str
    by: str
    directed: bool
    log: bool
    size: float
    profiles: tuple[Profile, ...]
    p: float | None = None
    carries: bool = False


@dataclass(frozen=True, slots=True)
class Spectrum:
    """What a simulation leaves, as its part of the rms per octave [% PV], over the period [s], shape (m,) each."""

    kind: str
    period_s: Floats
    size: Floats


@dataclass(frozen=True, slots=True)
class Tried:
    """A name that was tried: log likelihood [nat] that it gains, that less its penalty, whether it was taken."""

    name: str
    gain: float
    penalised: float
    taken: bool


@dataclass(frozen=True, slots=True)
class Views:
    """All that an explanation's page draws.

    recorded : PV, its clock set right, shape (n,); simulated : PV by baseline, model and brought, anchored as for
    the proof, shape (n,) each; misfit : their rms [% PV]; close : first and last (excluded) sample of the close look,
    None where it would be the whole; shape : picture of the first effect; obeyed : OP rebuilt by the stated settings
    where nothing is wrong with them.
    """

    recorded: Floats = field(repr=False)
    simulated: Mapping[str, Floats] = field(repr=False)
    misfit: Mapping[str, float]
    close: tuple[int, int] | None
    spectra: tuple[Spectrum, ...] = field(repr=False)
    features: tuple[FeatureView, ...] = field(repr=False)
    tried: tuple[Tried, ...]
    shape: Shape | None = field(repr=False)
    obeyed: Shape | None = field(repr=False)


def simulations(found: Explanation, brought: Brought | None) -> dict[str, Floats]:
    """PV as simulated [% of span], anchored as for the proof, shape (n,) each."""
    p = found.p
    proof = found.proven
    drawn = dict(zip(("baseline", "model") if found.accepted else ("baseline",), proof.drawn, strict=False))
    out = {k: p.inputs.level + course(p, c, proof.window, proof.placed) for k, c in drawn.items()}
    return out if brought is None else out | {"brought": brought.simulated}


def weight(found: Explanation, s: Recording, at: Located) -> Floats:
    """How much each sample matters for the verdict, shape (n,)."""
    n = s.pv.size
    marked = found.finding
    if marked is not None and not marked.where.all():
        return np.concatenate((marked.where.astype(float), np.zeros(n)))[:n]
    if found.accepted:
        return np.maximum(won_over(found.p, found.plain, found.best)[0], 0.0)
    return at.local if found.left > 0 else np.zeros(n)


def close_part(found: Explanation, s: Recording, at: Located) -> tuple[int, int] | None:
    """The stretch of the close look: where the verdict rests most, or where OP travels most."""
    c = found.plain.model.c
    memory = CLOSE_MEMORIES * float(c[Slot.T] + c[Slot.L]) / s.dt_s
    length = min(int(np.clip(memory, LEAST_CLOSE, CLOSE)), s.pv.size)
    w = weight(found, s, at)
    part = busiest(np.cumsum(w), length) if w.any() else busiest(s.op, length, s.usable)
    return None if part.stop - part.start >= s.pv.size else (part.start, part.stop)


def spectra(left: Mapping[str, Floats], dt_s: float) -> tuple[Spectrum, ...]:
    """Spectrum of what each simulation leaves."""
    from scipy.signal import welch  # its import takes longer than most explanations

    out = []
    for kind, x in left.items():
        segment = max(min(x.size // SEGMENTS, LONGEST_SEGMENT), SHORTEST_SEGMENT)
        f, power = welch(x, 1.0 / dt_s, nperseg=min(segment, x.size))
        size = np.sqrt(np.log(2.0) * f[1:] * power[1:])
        keep = np.unique(np.geomspace(1, size.size, SPECTRUM_POINTS).astype(int)) - 1
        smooth = np.sqrt([np.mean(size[max(k - k // 8, 0) : k + k // 8 + 1] ** 2) for k in keep])
        out.append(Spectrum(kind, 1.0 / f[1:][keep], smooth))
    return tuple(out)


def profile_of(g: Group, kind: str, fit: Fitted, judged: np.ndarray, by: str, log: bool) -> Profile:
    """Mean (or size) of a fit's one-step errors along one feature, with two standard errors."""
    errors = fit.e[judged] if by == "power" or g.sense is None else fit.e[judged] * g.sense[judged]
    found = profile(g.signal[judged], errors)
    y = np.sqrt(found.power) if by == "power" else found.mean
    half = ERRORS * np.sqrt(found.power / found.count) / (np.sqrt(2.0) if by == "power" else 1.0)
    x = 0.5 * (found.low + found.high)
    if log:
        x = np.maximum(x, 0.5 * np.min(x[x > 0], initial=np.inf))
    return Profile(kind, x, y, y - half, y + half)


def feature_views(found: Explanation, s: Recording, at: Located) -> tuple[FeatureView, ...]:
    """The one-step errors along each feature that a table does not say better."""
    p, c = found.p, found.plain.model.c
    late, memory = float(c[Slot.L]) / s.dt_s, float(c[Slot.L] + c[Slot.T]) / s.dt_s
    fits = [("baseline", found.plain), *([("model", found.best)] if found.accepted else [])]
    judged, known, out = p.weight > 0, {f.name: f for f in at.features}, []
    for g in groups(s.pv, s.op, s.dt_s, min(round(late), s.pv.size // 4), max(round(memory), 2)):
        if g.name in UNDRAWN:
            continue
        f = known.get(g.name)
        by = f.of if f is not None else "sign"
        log = g.name in POWERS and float(g.signal[judged].max(initial=0.0)) > 0
        drawn = tuple(profile_of(g, kind, fit, judged, by, log) for kind, fit in fits)
        size = float(np.sqrt(np.mean(fits[-1][1].e[judged] ** 2)))
        told = (None, False) if f is None else (f.p, f.carries)
        out.append(FeatureView(g.name, by, g.sense is not None, log, size, drawn, *told))
    return tuple(out)


def found_shape(found: Explanation, s: Recording, said: Answer) -> Shape | None:
    """The picture of what has no name and explains the loop best, else of the first effect found."""
    inputs, finding = found.p.inputs, found.finding
    if finding is not None:
        free = found.plain.model.c.copy()
        free[Slot.CLIP_HI], free[Slot.CLIP_LO] = np.inf, -np.inf
        drawn = fault(finding.name).drawn
        return None if drawn is None else drawn(finding, s, inputs.level + simulate(inputs, free))
    if said.outside is not None and found.outside is not None:
        fit, added, known = found.outside.fit, found.outside.row, said.outside.parameters
    elif found.accepted:
        fit, added, known = found.best, found.best.model.added[0], said.effects[0].parameters
    else:
        return None
    curve = about(added.name).curve
    drawing = Drawing(inputs, added, known, fit.model.c, found.plain.model.c)
    return None if curve is None else curve(drawing)


def tried(found: Explanation) -> tuple[Tried, ...]:
    """What was tried in the first round, the best of each name, the likeliest first."""
    best = {c.name: c for c in sorted(found.first, key=lambda c: c.penalised)}
    taken = {c.name for c in found.accepted}
    ranked = sorted(best.values(), key=lambda c: -c.penalised)
    return tuple(Tried(c.name, c.gain, c.penalised, c.name in taken) for c in ranked)


def views(found: Explanation, s: Recording, said: Answer, brought: Brought | None = None) -> Views:
    """All that a page draws of an explanation.

    Parameters
    ----------
    found : Explanation
    s : Recording
    said : Answer
        Its answer in numbers.
    brought : Brought or None
        The user's own model.
    """
    at = located_in(found.p, found.plain, s)
    recorded, shown = found.p.inputs.level + found.p.y, simulations(found, brought)
    own: Sequence[str] = [k for k in shown if k != "brought"]
    sound = found.controller is None and found.law is not None
    return Views(
        recorded,
        shown,
        {k: float(np.std(recorded - x)) for k, x in shown.items()},
        close_part(found, s, at),
        spectra({k: recorded - shown[k] for k in own}, s.dt_s),
        feature_views(found, s, at),
        tried(found),
        found_shape(found, s, said),
        by_stated_law("controller", s) if sound else None,
    )
