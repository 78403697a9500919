"""The candidate models of one problem: a process behind an ideal valve, with backlash, and with stick-slip."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from analyzer.config import CauseLimits
from identification.errors import NotAssessedError
from identification.estimation.backlash_stiction import (
    SHORT,
    better_linear,
    fit_backlash,
    fit_linear,
    fit_stick_slip,
)
from identification.estimation.between_samples import Scans, settled, with_scans
from identification.estimation.evidence import evidence, with_load_step, with_second_lag
from identification.estimation.gauss_newton import descend
from identification.estimation.model import Fitted
from identification.estimation.noise import AR_ORDER, judged
from identification.estimation.problem import Problem
from identification.estimation.stem_position import ValveFromPosition, valve_from_position
from identification.record import Mask

Candidates = tuple[Fitted, Fitted, Fitted | None]
"""Fits with an ideal valve, with backlash, and with stick-slip if that was tried."""
Fits = tuple[Fitted, Fitted, Fitted | None, Fitted, float, float]
"""Fits: no fault, backlash, stick-slip if tried, the better valve; its evidence and the jump's [nat]."""


SEARCHED = 2
"""Paths of OP during the search of valves: ours, for time; the valves found are evaluated on all paths."""


class FitInputs(NamedTuple):
    """Inputs of the fits of a problem: the period or another time scale of the loop [s], where a set point
    response of PV is expected, the controller's scans within its rows (None: unknown), and whether the loop is
    calm."""

    scale_s: float
    due: Mask
    scans: Scans | None
    calm: bool
    limits: CauseLimits


def fits_of(problem: Problem, q: FitInputs) -> Fits:
    """The candidates' fits, by a recorded stem if it shows a fault; with OP at the controller's scan if its scans
    within a row are known."""
    shown = (
        None
        if problem.blocks.position is None
        else valve_from_position(problem.blocks.op, problem.blocks.position)
    )
    if shown is not None:
        return _stem_shown(problem, shown, q)
    problem = problem.with_blocks(position=None)
    found = None if q.scans is None or q.calm else _at_scans(problem, q, q.scans)
    found = found or _candidates(problem, q)
    return *found, *_compared(found, q)


def judged_count(problem: Problem) -> int:
    """Number of blocks that follow as many good ones as the noise model's order."""
    return int(judged(problem.usable, AR_ORDER).sum())


def check_judged(problem: Problem, limits: CauseLimits) -> None:
    """Raise NotAssessedError if too few blocks follow as many good ones as the noise model's order."""
    count = judged_count(problem)
    if count < limits.judged:
        raise NotAssessedError(
            f"needs {limits.judged} stretches of {AR_ORDER + 1} good samples in a row, has {count}"
        )


def refined(fits: Candidates, best: Fitted, hopeless: bool) -> Candidates:
    """Fits at the record's own interval, if the dead time is no shorter than a block; the valve's are not refined if
    a search for its fault is `hopeless`."""
    if best.p.blocks.factor == 1 or best.dead_time_s + best.p.half_block_s < best.p.dt_s:
        return fits
    linear, backlash = (f.within(fine=True) for f in fits[:2])
    stick = None if fits[2] is None else fits[2].within(fine=True)
    if not hopeless:
        backlash = descend(backlash, free_width=best.p.blocks.position is None)
        stick = None if stick is None else descend(stick)
    return descend(linear), backlash, stick


def hopeful(problem: Problem, q: FitInputs) -> float:
    """Evidence [nat] from which a search for a valve fault is worthwhile in a loop that does not oscillate."""
    return q.limits.hopeless * q.limits.needed(judged_count(problem), bool(q.due.any()), False)


def _is_searched(linear: Fitted, backlash: Fitted, q: FitInputs) -> bool:
    """Whether the complete search for a valve fault is worthwhile: in a loop that oscillates always, because a stem
    that jumps by nearly its stickband resembles no backlash; in a calm one if backlash explains enough."""
    if not q.calm or backlash.p.y.size < SHORT:
        return True
    return backlash.log_likelihood - linear.log_likelihood >= hopeful(backlash.p, q)


def _candidates(problem: Problem, q: FitInputs) -> Candidates:
    """The fits of one problem."""
    linear = fit_linear(problem, q.scale_s)
    short = q.calm and problem.y.size < SHORT
    backlash = fit_backlash(linear, q.scale_s, hopeful(problem, q) if q.calm and not short else None)
    if not _is_searched(linear, backlash, q):
        return linear, backlash, None
    gained = backlash.log_likelihood - linear.log_likelihood
    wide = backlash.valve.stickband > 0.25 * problem.reach
    sticks = short or not q.calm or (wide and gained >= q.limits.evidence)
    return better_linear(linear, backlash), backlash, fit_stick_slip(backlash, q.scale_s) if sticks else None


def _at_scans(problem: Problem, q: FitInputs, scans: Scans) -> Candidates | None:
    """The fits with OP at the controller's scan, each computed by its own model; None if those with OP at the rows
    are clearly more likely: a controller with no faster scan holds OP between rows."""
    linear = fit_linear(problem, q.scale_s)
    rows = _likeliest((linear, fit_backlash(linear, q.scale_s), None))
    within = with_scans(settled(rows, scans), scans, SEARCHED).p
    linear, backlash, stick = _candidates(within, q)
    stick = None if stick is None else settled(stick, scans)
    found = settled(linear, scans), settled(backlash, scans), stick
    gained = _likeliest(found).log_likelihood - rows.log_likelihood
    return found if gained > -q.limits.evidence else None


def _likeliest(fits: Candidates) -> Fitted:
    return max((f for f in fits if f is not None), key=lambda f: f.log_likelihood)


def _compared(found: Candidates, q: FitInputs) -> tuple[Fitted, float, float]:
    """The better valve, its evidence over an ideal one, and that of the jump over backlash [nat]."""
    linear, backlash, stick = found
    if stick is None and not _is_searched(linear, backlash, q):
        return backlash, backlash.log_likelihood - linear.log_likelihood, 0.0
    best, jump = backlash, 0.0
    if stick is not None:
        jump = evidence(stick, backlash) - max(backlash.log_likelihood - stick.log_likelihood, 0.0)
        best = stick if jump > q.limits.evidence_jump else backlash
    gained = evidence(best, with_load_step(linear, q.due, best.ar))
    if gained > q.limits.evidence:
        gained = min(gained, evidence(best, with_second_lag(linear)))
    return best, gained - (q.limits.evidence_jump if best is stick else 0.0), jump


def _stem_shown(problem: Problem, shown: ValveFromPosition, q: FitInputs) -> Fits:
    """The same with a recorded stem: its fault is visible, and PV responds to the stem itself."""
    linear = fit_linear(problem, q.scale_s)
    behind = problem if problem.blocks.position is None else problem.with_blocks(op=problem.blocks.position)
    backlash = descend(replace(fit_linear(behind, q.scale_s), p=problem).moved(valve=shown.backlash))
    stick = None if shown.stick_slip is None else backlash.moved(valve=shown.stick_slip)
    best = backlash if stick is None else stick
    gained = evidence(best, with_load_step(linear, q.due, best.ar))
    return linear, backlash, stick, best, gained, 0.0 if stick is None else math.inf
