"""An explanation put to the proof on other recordings of the same loop, on which nothing was fitted but a bias."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.estimation.prediction_error import problem
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.explanation import Explanation, by_cycles
from identification.mismatch.model_file import carried, constants, inputs_for, to_data
from identification.mismatch.proof import HeldOut, Misfit, OnOther, anchored, course, misfit
from identification.mismatch.recording import Recording
from identification.mismatch.selection import without
from identification.record import Floats
from identification.simulation.parameters import Slot


def simulated_there(found: Explanation, c: Floats, s: Recording, window: int) -> Floats:
    """PV [% PV], shape (n,), that constants give for another recording's OP, anchored in windows."""
    data = to_data("", found.p.inputs, c, found.best.names, found.late_s, None)
    if window and found.proven.placed:
        c, here = constants(data), inputs_for(data, s.op, s.pv, s.dt_s)
        c[Slot.START] = float(s.pv[0]) - here.level
        return here.level + course(problem(here, s.pv - here.level, s.usable), c, window, True)
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


def window_of(found: Explanation, s: Recording) -> int:
    """Samples there over which models are compared where the whole shows the load alone, as own proof or loop ask."""
    if found.proven.window:
        return max(round(found.proven.window * found.p.inputs.dt_s / s.dt_s), 1)
    c, limits = found.plain.model.c, found.p.limits.proof
    memory = limits.window_times * float(c[Slot.T] + c[Slot.L]) / s.dt_s
    return max(math.ceil(min(memory, 1e9)), limits.window_samples)


def compared(found: Explanation, others: Sequence[Recording]) -> tuple[HeldOut, tuple[OnOther, ...]]:
    """The proof on other recordings: over the whole of each, or over windows where the whole shows the load alone."""
    whole = _compared(found, others, [0] * len(others), False)
    if whole[0].carries:
        return whole
    return _compared(found, others, [window_of(found, s) for s in others], found.proven.placed)


def _compared(
    found: Explanation, others: Sequence[Recording], windows: Sequence[int], placed: bool
) -> tuple[HeldOut, tuple[OnOther, ...]]:
    """The same over windows of each recording, 0 for the whole."""
    p, drawn = found.p, found.proven.drawn
    each = tuple(on_other(found, s, window) for s, window in zip(others, windows, strict=True))
    samples = [x.samples for x in each]
    held = together([x.baseline for x in each], samples), together([x.explained for x in each], samples)
    window = round(windows[0] * others[0].dt_s / p.inputs.dt_s)
    plain, better = (misfit(p.y, course(p, c, window, placed), window) for c in drawn)
    seen = plain, better
    return HeldOut(0.0, seen, held, seen, drawn, window, placed, limits=p.limits.proof), each


def proven_on(found: Explanation, others: Sequence[Recording]) -> Explanation:
    """The explanation, kept where it carries over to other recordings, given up where it does not.

    An effect bound to a time says nothing of another recording; a valve that the cycles there show too keeps its
    name. The others are of the same loop, in the percent of the recording that was fitted.
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
