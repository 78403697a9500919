"""The kind and size of a valve fault slip by slip: regular stick-slip, or slips that differ."""

from __future__ import annotations

from dataclasses import replace

from analyzer.config import Config
from analyzer.loop.cause.verdict import Verdict, fault_of
from analyzer.loop.decisions import (
    Cause,
    Fault,
)
from analyzer.loop.identification.agreement import closest
from analyzer.loop.identification.measure import Measured
from identification.estimation.backlash_stiction import SHORT, refined
from identification.estimation.gauss_newton import descend
from identification.estimation.irregular_slips import SlipPath, fit_irregular, near_path, path_evidence
from identification.estimation.model import Fitted
from identification.estimation.noise import generic_noise
from identification.simulation.valve import HALTS, RESTS


def refine_stick_slip(verdict: Verdict, period_s: float, config: Config) -> Verdict:
    """The verdict on a loop that cycles, its valve's fault replaced if slips at variable distances explain PV better.

    The cause is unchanged: the test is for the kind of fault of a valve already identified by PV and OP. If the
    stem is identified slip by slip, the problem contains it as if recorded. Settings are searched with one
    friction for all slips: that of the likeliest fit with regular slips, or the mean one of the slips, with a stem
    that rests after each slip or follows OP until it stops. The simulation at the present settings that is closest
    to the record decides. The cycle has a period of period_s [s].
    """
    m, limits = verdict.measured, config.cause
    if (
        verdict.cause is not Cause.VALVE
        or m is None
        or m.problem.blocks.position is not None
        or m.problem.y.size < SHORT
    ):
        return verdict
    problem = m.backlash.p
    blocks = replace(m.backlash, p=problem.of_rows.with_blocks(fine=False))
    backlash = (
        descend(blocks, free_width=True) if problem.blocks.fine or problem.blocks.steps > 1 else m.backlash
    )
    path = fit_irregular(backlash, generic_noise(), period_s, verdict.fault is not Fault.STICTION)
    if path is None:
        return verdict
    jump = path_evidence(path, backlash)
    more = jump - max(m.jump, 0.0)
    new = verdict.fault is Fault.BACKLASH  # for other faults a jump is known, or nearly
    share = limits.jump_share if new else 0.0
    if more < max(limits.evidence_jump, share * (m.evidence + more)):
        return verdict
    improved = _with_path(m, path, jump, more)
    fault = fault_of(improved, limits)
    law = _finely(refined(near_path(backlash, path)), m)
    best = max((x for x in (m.stick_slip, law) if x is not None), key=lambda fit: fit.log_likelihood)
    slips = improved.stick_slip
    if m.controller is not None and slips is not None:
        laws = (slips.valve._replace(tolerance=motion) for motion in (RESTS, HALTS))
        fits = (best, *(slips.moved(valve=law) for law in laws))
        best = closest(fits, m.controller, config.advice)
    steady = replace(verdict, measured=replace(m, stick_slip=best), fault=fault)
    return replace(verdict, measured=improved, fault=fault, steady=steady)


def _finely(fit: Fitted, m: Measured) -> Fitted:
    """A fit in blocks, refined at the resolution of the measures."""
    return descend(fit.within(fine=True)) if m.problem.blocks.fine else fit


def _with_path(m: Measured, path: SlipPath, jump: float, more: float) -> Measured:
    """The measures, with the path's stem and the friction and process of its fit."""
    fit = _finely(path.fit, m)
    linear, backlash = (replace(x, p=fit.p) for x in (m.linear, m.backlash))
    return replace(m, linear=linear, backlash=backlash, stick_slip=fit, jump=jump, evidence=m.evidence + more)
