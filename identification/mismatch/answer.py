"""The answer in numbers: effects with parameters and intervals, where, fit before and after, what moved."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from identification.estimation.candidate import Fitted, Model, Problem
from identification.estimation.covariance import half_width
from identification.estimation.prediction_error import deviations
from identification.mismatch.catalogue import fault
from identification.mismatch.diagnosis import alternatives, restored
from identification.mismatch.effect import Block, exact
from identification.mismatch.explanation import Explanation
from identification.mismatch.identifiability import too_short, unanswered
from identification.mismatch.location.locate import Located
from identification.mismatch.location.where import located_in, where_of
from identification.mismatch.outside import about
from identification.mismatch.proof import HeldOut, Misfit
from identification.mismatch.recording import Finding, Recording
from identification.mismatch.starts.from_cycles import is_friction
from identification.models import Estimate
from identification.simulation.effect import Variant
from identification.simulation.parameters import Slot

LIVES = {
    "op_level": "valve",
    "after_reversals": "valve",
    "at_limits": "valve",
    "time_in_record": "load",
    "pv_level": "process",
}
"""Block in which a misfit without a name is looked for first, by the feature that carries it; else the process."""


STRAYS = (
    "Simulated with one constant friction PV strays all the same, as it does where friction differs from slip to "
    "slip: the stretches are the proof, not the misfit."
)
"""What is said of a valve that the cycles show and a simulation with constant friction does not."""
ONE_MOVE_ONLY = "rests on one move of OP, of which nothing is left to prove it on; another recording would"
"""What a recording of one experiment lacks."""


AT_REST = "flow_at_rest_pct"
"""Parameter of a supply: the flow that goes with it while OP is at its middle."""
WANDERS = "does not tell whether the gain wanders too, or a load alone is added"
"""Caution of a supply whose part in the gain an experiment does not show."""
STACKED = (
    "The loop does something that no known cause explains: only {names}, stacked on each other, come near it, and "
    "one cause is likelier than three."
)
"""Why a stack of effects is no name."""


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
    """What `triage explain` says of one loop, in numbers.

    note : why there is no name; caution : what the recording lacks although there is one; shown : what shows the
    first effect beside the fit; outside : what explains it best and has no name that could be the verdict.
    """

    verdict: str
    block: str
    effects: tuple[EffectFound, ...]
    where: dict[str, Any]
    fit: dict[str, Any]
    moved: dict[str, tuple[float, float]]
    remaining: float | None
    note: str = field(default="")
    caution: str = field(default="")
    shown: str = field(default="")
    outside: EffectFound | None = None


def finding_effect(finding: Finding | None, s: Recording) -> EffectFound | None:
    """A finding about recorder or controller as an effect."""
    if finding is None:
        return None
    own = fault(finding.name)
    return EffectFound(own.name, own.block, {n.name: n.estimate(finding, s) for n in own.numbers}, None)


def parameters_of(p: Problem, fit: Fitted, row: Variant) -> dict[str, Estimate]:
    """A row's constants with 90 % intervals (covariance.py)."""
    wide = dict(zip((q.slot for q in fit.model.params), deviations(p, fit), strict=True))
    out = {}
    for q in row.params:
        value, half = float(fit.model.c[q.slot]), half_width(float(wide[q.slot]))
        if q.log:
            spread = math.exp(min(half, 5.0))
            out[q.name] = Estimate(value, value / spread, value * spread, q.unit)
        else:
            out[q.name] = exact(value, q.unit, half)
    derived = about(row.name).derived
    return out | (derived(out) if derived is not None else {})


def told_by_cycles(found: Explanation, row: Variant) -> dict[str, Estimate]:
    """Figures of a valve that the loop's cycles show, as the night tells them: one estimate and one interval. A
    simulation with one friction over hours knows them less well than the cycles, and takes them for surer."""
    told = {} if found.cycles is None else dict(found.cycles.told)
    return told if told.keys() == {q.name for q in row.params} else {}


def effects_of(found: Explanation, s: Recording, proof: HeldOut | None) -> tuple[EffectFound, ...]:
    """Every effect found, the likeliest first: what is larger than a grid before the grid."""
    gates = [e for e in (finding_effect(f, s) for f in (found.recorder, found.controller)) if e is not None]
    rows = found.best.model.added
    physics = [
        EffectFound(
            row.name,
            row.block,
            parameters_of(found.p, found.best, row) | (told_by_cycles(found, row) if i == 0 else {}),
            proof.share if proof is not None and i == 0 and proof.share > 0.0 else None,
            alternatives(found) if i == 0 else (),
        )
        for i, row in enumerate(rows)
    ]
    return (*physics, *gates) if found.finding is None else (*gates, *physics)


def outside_of(found: Explanation) -> EffectFound | None:
    """What explains a loop better than anything that has a name."""
    if found.outside is None:
        return None
    row, fit = found.outside.row, found.outside.fit
    return EffectFound(row.name, row.block, parameters_of(found.p, fit, row), None)


def plain_loops(found: Explanation) -> dict[str, dict[str, float]]:
    """The plain loop that simulates best and the one that foretells best one step ahead, where they differ widely."""
    loops = {"simulated": found.proven.drawn[0], "one_step_ahead": found.plain.model.c}
    own = {name: restored(Model((), c)) for name, c in loops.items()}
    here, ahead = (Slot.K, Slot.T), own["one_step_ahead"]
    ratios = [abs(loops["simulated"][s]) / max(abs(loops["one_step_ahead"][s]), 1e-12) for s in here]
    alike = all(
        1.0 / found.p.limits.proof.optima_apart <= r <= found.p.limits.proof.optima_apart for r in ratios
    )
    same_sign = own["simulated"]["gain"] * ahead["gain"] > 0.0
    return {} if alike and same_sign else own


def ahead(found: Explanation) -> float | None:
    """Gain on held-out data [nat] of effects that innovations show and no smaller misfit; None of any other."""
    proof = found.proven
    return proof.gain if found.accepted and proof.share <= 0.0 and proof.seen_ahead else None


def fit_of(proof: HeldOut, dt_s: float) -> dict[str, Any]:
    """Misfit before and after, fitted and held out, and the horizon that simulations run over [s]; None: all."""
    both: dict[str, Any] = {
        name: {"fitted": _said(proof.fitted[i]), "held_out": _said(proof.held[i])}
        for i, name in enumerate(("baseline", "explained"))
    }
    return both | {"horizon_s": proof.window * dt_s if proof.window else None}


def _said(m: Misfit) -> dict[str, float]:
    return {"rmse": m.rmse, "fit_pct": m.fit_pct}


def moved(found: Explanation) -> dict[str, tuple[float, float]]:
    """The plain loop's constants before and after, where effects were added."""
    if not found.accepted:
        return {}
    before, after = restored(found.plain.model), restored(found.best.model)
    return {k: (before[k], after[k]) for k in before}


def answer(found: Explanation, s: Recording) -> Answer:
    """The answer of an explanation.

    Parameters
    ----------
    found : Explanation
    s : Recording
        What was explained.
    """
    proof = found.proven
    effects = effects_of(found, s, proof if found.accepted else None)
    asked = not any(found_first(found)) and not by_cycles(found)
    silent = unanswered(found) if asked else ""
    lacking = silent or (too_short(found, s) if asked else "")
    at = located_in(found.p, found.best if found.left > 0 else found.plain, s)
    verdict, block = verdict_of(found, effects, lacking, bool(silent), at)
    return Answer(
        verdict,
        block,
        effects,
        where_of(found, s, block, at),
        fit_of(proof, s.dt_s) | {"plain_loops": plain_loops(found), "ahead_nat": ahead(found)},
        moved(found),
        (1.0 - proof.overall[1].fit_pct / 100.0) ** 2,
        f"Not told: {lacking}." if lacking and (verdict, block) == ("unexplained", "none") else _note(found),
        (lacking or (ONE_MOVE_ONLY if found.unproven else untold_gain(found, effects))) if effects else "",
        shown_by(found),
        outside_of(found) if verdict == "unexplained" else None,
    )


def verdict_of(
    found: Explanation, effects: tuple[EffectFound, ...], lacking: str, insensitive: bool, at: Located
) -> tuple[str, str]:
    """The verdict and its block; what is left over, and what a record cannot tell, has no name."""
    if found.refuted and not found.accepted and not any(found_first(found)):
        return "unexplained", "none"
    none = (found.left > 0 or is_stack(found)) and not any(found_first(found)) and not by_cycles(found)
    if none and found.outside is not None:
        return "unexplained", found.outside.row.block
    if none:
        return "unexplained", LIVES.get(at.carrying[0].name, "process") if at.carrying else "process"
    if effects and not (insensitive and effects[0].block in (Block.VALVE, Block.PROCESS)):
        return effects[0].name, effects[0].block
    return ("unexplained", "none") if lacking else ("none", "none")


def untold_gain(found: Explanation, effects: tuple[EffectFound, ...]) -> str:
    """What an experiment does not tell of a supply whose flow at rest may be anything; empty of any other."""
    at_rest = next((e.parameters[AT_REST] for e in effects if AT_REST in e.parameters), None)
    open_ended = at_rest is not None and at_rest.low < 0.0 < at_rest.high
    return WANDERS if open_ended and found.p.by_simulation else ""


def is_stack(found: Explanation) -> bool:
    """Whether a loop is given as many effects as are looked for: one that the catalogue lacks comes out as a stack of
    those it has. Rigs in open loop do have several."""
    return len(found.accepted) >= found.p.limits.search.rounds and not found.p.by_simulation


def by_cycles(found: Explanation) -> bool:
    """Whether the first effect is a faulty valve that the loop's cycles show."""
    return found.cycles is not None and bool(found.accepted) and is_friction(found.accepted[0].name)


def shown_by(found: Explanation) -> str:
    """What the cycles show of the first effect, in a sentence; empty where they are not asked."""
    if not by_cycles(found) or found.cycles is None:
        return ""
    seen = found.cycles
    between = "turns of OP" if seen.cycling else "moves of the stem"
    text = (
        f"In {100 * seen.agreeing:.0f} % of {seen.stretches} stretches between {between}, PV goes as behind this "
        "valve and not as behind a free one."
    )
    return text if found.proof is None or found.proof.carries else f"{text} {STRAYS}"


def found_first(found: Explanation) -> tuple[bool, bool]:
    """Whether recorder and controller have an answer of their own, which nothing left over takes away."""
    return found.recorder is not None, found.controller is not None


def _note(found: Explanation) -> str:
    if found.refuted and not found.accepted:
        names = " and ".join(found.refuted)
        seen, rest = (
            ("the recording", "the other recordings") if found.others else ("its first part", "the rest")
        )
        return (
            f"What explains {seen} ({names}) does not carry over to {rest}, so nothing is told as found: another "
            "recording of this loop is needed."
        )
    if found.left <= 0:
        stacked = " and ".join(c.name for c in found.accepted)
        return STACKED.format(names=stacked) if is_stack(found) else ""
    if found.outside is not None:
        return ""
    return (
        "The loop does something that no known cause explains: a flexible model without a name does better "
        f"(log likelihood +{found.left:.0f})."
    )
