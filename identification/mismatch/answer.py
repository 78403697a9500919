"""The answer in numbers: effects with parameters and intervals, location, fit before and after, moved constants."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from identification.estimation.descent import half_width, nats
from identification.estimation.model import Fitted
from identification.estimation.prediction_error import bounds, deviations, residual_fit
from identification.estimation.problem import Problem
from identification.mismatch import words
from identification.mismatch.catalogue import EFFECTS, fault
from identification.mismatch.catalogue.supply_variation import AT_REST
from identification.mismatch.effect import TIE, Block
from identification.mismatch.explanation import Explanation, by_cycles, is_stack
from identification.mismatch.outside import about
from identification.mismatch.proof import HeldOut
from identification.mismatch.recording import Recording
from identification.mismatch.where import Located, located_in, where_of
from identification.models import Estimate
from identification.record import Floats
from identification.simulation.parameters import Slot, Variant

ANSWERS = 12.5
"""Log likelihood by OP from which PV responds to it [nat]: chance brings three constants under 8.5 in 999 of
1,000 records, and the model without OP is not fitted to the end."""
TIME_CONSTANTS = 5.0
"""Time constants that a recording of a process that settles must hold. Source: the catalogue's need; a step
has then settled to 0.7 %."""
OPTIMA_APART = 2.0
"""Ratio of gains or time constants from which both baseline models are reported: that with the best
simulation and that with the best prediction: where neither load nor feedback biases one of them they are
within a tenth."""

INTEGRATING = ("level",)
"""Loop types that need not settle; a short record still determines their slope."""


@dataclass(frozen=True, slots=True)
class EffectFound:
    """One effect: name, block, parameters, the part of the held-out misfit it removes, and its alternatives."""

    name: str
    block: str
    parameters: dict[str, Estimate]
    held_out_share: float | None
    alternatives: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Answer:
    """The result of `triage explain` for one loop, in numbers.

    note : why there is no name; caution : what the recording does not determine although there is a name; shown :
    what supports the first effect besides the fit; outside : the best explanation whose name cannot be the verdict.
    """

    verdict: str
    block: str
    effects: tuple[EffectFound, ...]
    where: dict[str, Any]
    fit: dict[str, Any]
    moved: dict[str, tuple[float, float]]
    remaining: float | None
    note: str = ""
    caution: str = ""
    shown: str = ""
    outside: EffectFound | None = None


def answer(found: Explanation, s: Recording) -> Answer:
    """The answer of an explanation of a recording."""
    effects, outside, note, caution = effects_of(found, s), None, words.note(found), ""
    silent = unanswered(found) if is_by_fit(found) else ""
    lacking = silent or (too_short(found, s) if is_by_fit(found) else "")
    at = located_in(found.p, found.best if found.residual_nat > 0 else found.plain, s)
    verdict, block = verdict_of(found, effects, lacking, bool(silent), at)
    if lacking and (verdict, block) == ("unexplained", "none"):
        note = f"Not identified: {lacking}."
    if effects:
        one_move = words.TEXTS["one_move"] if found.unproven else open_gain_note(found, effects)
        caution = lacking or one_move
    if verdict == "unexplained" and found.outside is not None:
        row, fit = found.outside.row, found.outside.fit
        outside = EffectFound(row.name, row.block, parameters_of(found.p, fit, row), None)
    return Answer(
        verdict,
        block,
        effects,
        where_of(found, s, block, at),
        fit_of(found, s.dt_s),
        constants_moved(found),
        (1.0 - (found.proven.overall[1].fit_pct or 0.0) / 100.0) ** 2,
        note,
        caution,
        words.cycles_text(found) if by_cycles(found) else "",
        outside,
    )


def verdict_of(
    found: Explanation, effects: tuple[EffectFound, ...], lacking: str, insensitive: bool, at: Located
) -> tuple[str, str]:
    """The verdict and its block; a residual, or what the record cannot determine, has no name."""
    if found.refuted and not found.accepted and is_by_fit(found):
        return "unexplained", "none"
    if (found.residual_nat > 0 or is_stack(found)) and is_by_fit(found):
        if found.outside is not None:
            return "unexplained", found.outside.row.block
        features = words.TEXTS["features"]
        return "unexplained", features[at.carrying[0].name]["lives"] if at.carrying else "process"
    if effects and not (insensitive and effects[0].block in (Block.VALVE, Block.PROCESS)):
        return effects[0].name, effects[0].block
    return ("unexplained", "none") if lacking else ("none", "none")


def is_by_fit(found: Explanation) -> bool:
    """Whether the answer depends on fits alone. Recorder, controller and the loop's cycles give answers of their own,
    which a residual does not cancel."""
    return found.recorder is None and found.controller is None and not by_cycles(found)


def gain_by_op(p: Problem, fit: Fitted) -> float:
    """Log likelihood [nat] that OP adds to a fit, over the same with zero gain, its mean and start as recorded."""
    c = fit.model.c.copy()
    c[Slot.K], c[Slot.BIAS], c[Slot.START] = 0.0, float(np.mean(p.y)), float(p.y[0])
    return nats(fit.count, residual_fit(p, replace(fit.model, c=c)).loss, fit.loss)


def unanswered(found: Explanation) -> str:
    """Requirement where PV does not respond to OP; empty where it does.

    Innovations decide, in an experiment too: a wandering load leaves few independent simulation errors.
    """
    found = found.by_innovations or found
    loaded = any(row.block == Block.LOAD for row in found.best.model.added)  # counted relative to the gain
    moves = gain_by_op(found.p, found.plain if loaded else found.best)
    return "" if moves >= ANSWERS else words.TEXTS["insensitive"]


def too_short(found: Explanation, s: Recording) -> str:
    """Requirement where the record is short compared with the time constant; empty where it is not."""
    lag, length = float(found.plain.model.c[Slot.T]), s.pv.size * s.dt_s
    if s.kind in INTEGRATING or any(v.replaces for v in found.best.model.added):
        return ""
    return "" if length >= TIME_CONSTANTS * lag else words.too_short_text(TIME_CONSTANTS, length, lag)


def open_gain_note(found: Explanation, effects: tuple[EffectFound, ...]) -> str:
    """What an experiment cannot determine of a supply whose flow at rest is free; empty for others."""
    at_rest = next((e.parameters[AT_REST.name] for e in effects if AT_REST.name in e.parameters), None)
    open_ended = at_rest is not None and at_rest.low < 0.0 < at_rest.high
    return words.TEXTS["wanders"] if open_ended and found.p.by_simulation else ""


def effects_of(found: Explanation, s: Recording) -> tuple[EffectFound, ...]:
    """All effects found, most likely first; those larger than the grid precede the grid.

    A valve identified from the loop's cycles keeps the figures of the cycle analysis in the batch run: one estimate
    and one interval. A simulation with constant friction over hours is less accurate, with too small intervals.
    """
    gates = [
        EffectFound(f.name, own.block, own.numbers(f, s), None)
        for f in (found.recorder, found.controller)
        if f is not None and (own := fault(f.name))
    ]
    physics = [
        EffectFound(row.name, row.block, parameters_of(found.p, found.best, row), None)
        for row in found.best.model.added
    ]
    for first in physics[:1]:
        share = found.proven.share_in_band
        estimates = {} if found.cycles is None else dict(found.cycles.estimates)
        if estimates.keys() == {q.name for q in found.best.model.added[0].params}:
            first.parameters.update(estimates)
        held_out_share = share if share > 0.0 else None
        physics[0] = replace(first, held_out_share=held_out_share, alternatives=alternatives(found))
    return (*physics, *gates) if found.finding is None else (*gates, *physics)


def parameters_of(p: Problem, fit: Fitted, row: Variant) -> dict[str, Estimate]:
    """A row's constants with 90 % intervals (descent.py), which end where their ranges do."""
    wide = dict(zip((q.slot for q in fit.model.params), deviations(p, fit), strict=True))
    out = {}
    for q in row.params:
        value, half = float(fit.model.c[q.slot]), half_width(float(wide[q.slot]))
        low, high = bounds(p.inputs, fit.model.c, q)
        if q.log:
            spread = math.exp(min(half, 5.0))
            out[q.name] = Estimate(value, value / spread, value * spread, q.unit)
        else:
            out[q.name] = Estimate(value, max(value - half, low), min(value + half, high), q.unit)
    derived = about(row.name).derived
    return out | (derived(out) if derived is not None else {})


SIZES = (
    *("coupling_gain", "gain_drift", "gain_slope", "curve", "opposing_share", "flow_share", "slow_share"),
    *("sine_pct", "cosine_pct", "size_1_pct", "size_2_pct", "size_3_pct"),
)
"""Parameters that give the size of an effect: where all of them are zero there is no effect."""


def holds_zero(p: Problem, fit: Fitted, row: Variant) -> bool:
    """Whether the intervals of all sizes of an effect include zero, so that there is no evidence of the effect.

    An effect of size zero has no other constants: they are present under the alternative alone (Davies 1987), and are
    held.
    """
    sizes = [q for q in row.params if q.name in SIZES]
    held = {int(q.slot) for q in row.params} - {int(q.slot) for q in sizes}
    wide = dict(zip((q.slot for q in fit.model.params), deviations(p, fit, held), strict=True))
    return bool(sizes) and all(abs(fit.model.c[q.slot]) < half_width(float(wide[q.slot])) for q in sizes)


def alternatives(found: Explanation) -> tuple[str, ...]:
    """Names that the data cannot distinguish from the first effect: as likely, or indistinguishable in principle."""
    if not found.accepted:
        return ()
    winner = found.accepted[0]
    least = max(winner.penalised - TIE, 0.0)
    is_single = len(winner.fit.names) == 1  # else its gain is not over the baseline model
    close = [c.name for c in found.first if is_single and c.penalised > least]
    names = dict.fromkeys((*close, *EFFECTS[winner.name].indistinguishable))
    return tuple(n for n in names if n not in found.best.names)


def plain_loops(found: Explanation) -> dict[str, dict[str, float]]:
    """The baseline models with the best simulation and with the best one-step-ahead prediction, if they differ
    widely."""
    drawn, ahead, most = found.proven.drawn[0], found.plain.model.c, OPTIMA_APART
    ratios = [abs(drawn[slot]) / max(abs(ahead[slot]), 1e-12) for slot in (Slot.K, Slot.T)]
    if drawn[Slot.K] * ahead[Slot.K] > 0.0 and all(1.0 / most <= ratio <= most for ratio in ratios):
        return {}
    return {"simulated": restored(drawn), "one_step_ahead": restored(ahead)}


def fit_of(found: Explanation, dt_s: float) -> dict[str, Any]:
    """Misfit before and after, fitted and held out, and held out in the loop's band, None where no band is known.

    horizon_s : length of the simulations, None: all; ahead_nat : gain of the effects on held-out data if innovations
    show it and the simulation misfit does not fall, otherwise None.
    """
    proof = found.proven
    ahead = found.accepted and proof.share_in_band <= 0.0 and proof.seen_ahead
    return {
        **{
            name: {"fitted": asdict(proof.fitted[i]), "held_out": asdict(proof.held[i])}
            for i, name in enumerate(("baseline", "explained"))
        },
        "in_band": in_band_of(proof),
        "horizon_s": proof.window * dt_s if proof.window else None,
        "plain_loops": plain_loops(found),
        "ahead_nat": proof.gain if ahead else None,
    }


def in_band_of(proof: HeldOut) -> dict[str, Any] | None:
    """Misfits on held-out data in the loop's band, and its shortest and longest period [s]."""
    if proof.in_band is None:
        return None
    (shortest, longest), x = proof.in_band.band, proof.in_band
    misfits = {"baseline": asdict(x.plain), "explained": asdict(x.better)}
    return {"shortest_s": shortest, "longest_s": longest, **misfits}


def constants_moved(found: Explanation) -> dict[str, tuple[float, float]]:
    """Constants of the baseline model before and after, where effects were added."""
    if not found.accepted:
        return {}
    before, after = restored(found.plain.model.c), restored(found.best.model.c)
    return {k: (before[k], after[k]) for k in before}


def restored(c: Floats) -> dict[str, float]:
    """Baseline constants of a model, shape (SIZE,): gain, time constant [s], dead time [s]."""
    return {"gain": float(c[Slot.K]), "time_constant_s": float(c[Slot.T]), "dead_time_s": float(c[Slot.L])}
