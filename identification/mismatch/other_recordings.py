"""An explanation put to the proof on other recordings of the same loop, on which nothing was fitted but a bias."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.estimation.candidate import problem
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.explanation import Explanation, by_cycles
from identification.mismatch.model_file import carried, constants, to_data
from identification.mismatch.proof import HeldOut, Misfit, OnOther, anchored, course, misfit
from identification.mismatch.recording import Recording
from identification.mismatch.selection import without
from identification.record import Floats
from identification.simulation.open_loop import ModelInputs
from identification.simulation.parameters import Slot


def simulated_there(found: Explanation, c: Floats, s: Recording, window: int) -> Floats:
    """PV [% PV], shape (n,), that constants give for another recording's OP, anchored in windows."""
    data = to_data("", found.p.inputs, c, found.best.names, found.late_s, None)
    if window and found.proven.placed:
        inputs = found.p.inputs
        here = ModelInputs(s.op, s.dt_s, inputs.middle, inputs.level, (float(s.pv.min()), float(s.pv.max())))
        c = constants(data)
        c[Slot.START] = float(s.pv[0]) - inputs.level
        return inputs.level + course(problem(here, s.pv - inputs.level, s.usable), c, window, True)
    return anchored(s.pv, carried(data, s.op, s.pv, s.dt_s), window)


def on_other(found: Explanation, s: Recording, window: int) -> OnOther:
    """Both models on another recording, the plain one by either criterion, and the better without its effects."""
    best = found.best.model
    models = (found.plain.model.c, found.proven.drawn[0], best.c, without(best, best.added).c)
    own, drawn, better, cleared = (misfit(s.pv, simulated_there(found, c, s, window), window) for c in models)
    return OnOther(min(own, drawn, key=lambda x: x.rmse), better, cleared, s.pv.size)


def together(parts: Sequence[Misfit], samples: Sequence[int]) -> Misfit:
    """Misfits of several recordings as one, each sample counting alike."""
    n = np.array(samples, dtype=np.float64)
    rmse = np.array([m.rmse for m in parts])
    moves = np.array([m.rmse / max(1.0 - m.fit_pct / 100.0, 1e-9) for m in parts])
    left, own = (float(np.sqrt(np.sum(n * x**2) / n.sum())) for x in (rmse, moves))
    return Misfit(left, 100.0 * (1.0 - left / max(own, 1e-12)))


def windows_of(found: Explanation, s: Recording) -> tuple[int, ...]:
    """Windows in which models are compared there [samples]: the whole, and what own proof or loop ask for."""
    if found.proven.window:
        return 0, max(round(found.proven.window * found.p.inputs.dt_s / s.dt_s), 1)
    c = found.plain.model.c
    limits = found.p.limits.proof
    memory = limits.window_times * float(c[Slot.T] + c[Slot.L]) / s.dt_s
    return 0, max(math.ceil(min(memory, 1e9)), limits.window_samples)


def compared(found: Explanation, others: Sequence[Recording]) -> tuple[HeldOut, tuple[OnOther, ...]]:
    """The proof on other recordings: over the whole of each, or over windows where the whole shows the load alone."""
    whole, windowed = (_compared(found, others, at) for at in (0, 1))
    return whole if whole[0].carries else windowed


def _compared(
    found: Explanation, others: Sequence[Recording], at: int
) -> tuple[HeldOut, tuple[OnOther, ...]]:
    """The same over the whole (0) or over windows (1)."""
    p = found.p
    each = tuple(on_other(found, s, windows_of(found, s)[at]) for s in others)
    samples = [x.samples for x in each]
    held = together([x.baseline for x in each], samples), together([x.explained for x in each], samples)
    window = round(windows_of(found, others[0])[at] * others[0].dt_s / p.inputs.dt_s)
    placed = bool(at and found.proven.placed)
    drawn = found.proven.drawn
    courses = [course(p, c, window, placed) for c in drawn]
    seen = misfit(p.y, courses[0], window), misfit(p.y, courses[1], window)
    return HeldOut(0.0, seen, held, seen, drawn, window, placed, limits=p.limits.proof), each


def proven_on(found: Explanation, others: Sequence[Recording]) -> Explanation:
    """The explanation, kept where it carries over to other recordings, given up where it does not.

    An effect bound to a time says nothing of another recording; a valve that the cycles there show too keeps its
    name.

    Parameters
    ----------
    found : Explanation
    others : sequence of Recording
        Of the same loop, in the percent of the recording that was fitted.
    """
    if not others or not found.accepted:
        return found
    proof, each = compared(found, others)
    names = tuple(c.name for c in found.accepted)
    cycling = by_cycles(found) and any(s.cycles is not None for s in others)
    samples = [x.samples for x in each]
    there, bare = (together([getattr(x, k) for x in each], samples).rmse for k in ("explained", "without"))
    if (proof.share > 0.0 and proof.follows and there < bare) or cycling:
        return replace(found, proof=proof, others=each, unproven=False)
    if all(EFFECTS[name].timed for name in names):
        return replace(found, others=each)
    plain = replace(found, best=found.plain, accepted=(), refuted=names, unproven=False)
    proof, _ = compared(plain, others)
    return replace(plain, proof=proof, others=each)
