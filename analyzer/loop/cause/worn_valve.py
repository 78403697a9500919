"""Test for a worn valve, independent of the cause of the cycle: a joint model of load and backlash on the
whole record.

A periodic load has harmonics as a worn valve does, and where it moves OP by less than the backlash the stem is moved
only by the slower part of OP. Both are decided on the whole record: a stretch of a few dozen cycles holds a few such
moves of the stem.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from analyzer.config import CauseLimits
from analyzer.loop.decisions import Fault
from analyzer.loop.identification.candidates import SEARCHED, judged_count
from analyzer.loop.identification.fit_data import scans_of, whole_problem
from analyzer.loop.identification.measure import Measured
from identification.estimation.backlash_under_line import (
    BacklashUnderLine,
    fit_backlash_under_line,
    in_problem,
)
from identification.estimation.between_samples import with_scans
from identification.estimation.model import Fitted
from identification.estimation.problem import Problem
from identification.estimation.search import Dynamics
from identification.estimation.smooth_load import as_fit
from identification.mismatch.recording import held_move
from identification.record import LoopRecord

BLOCKS = 5400
"""Blocks of the whole record: ours; in 1800 blocks five of 16 worn valves of benchmarks/world (seeds 574, 575) lose
most of their evidence, because a block is longer than the response of their process."""
LAGS = (0.3, 2.0, 20.0)
"""Time constants at which a search begins, over the cycle's period [-]: ours."""
WHOLE_PCT = 90.0
"""Range of OP in a cycle from which it swings from limit to limit [%]: ours."""


@dataclass(frozen=True)
class WornValve:
    """The question of one record: is its valve worn? record; measured, of its cause; period_s, of its cycle, or its
    time scale without one [s]; limits."""

    record: LoopRecord
    measured: Measured
    period_s: float
    limits: CauseLimits

    @cached_property
    def found(self) -> BacklashUnderLine:
        """The joint model of process, backlash, load and line."""
        m = self.measured
        valves = [fit.valve for fit in (m.backlash, m.stick_slip) if fit is not None]
        return fit_backlash_under_line(self._problem, self._starts(), valves, self.period_s)

    @property
    def is_seen(self) -> bool:
        """Whether backlash is identified in addition to any load: OP crosses it, and it changes the stem's
        motion."""
        return self.has_evidence and self._is_crossed

    @property
    def has_evidence(self) -> bool:
        """Whether backlash of any width has enough evidence in addition to the load, and half-cycles agree
        on it."""
        if self._is_hidden:
            return False
        trials, limits = self.found.trials, self.limits
        agree = trials is not None and trials.signs >= limits.joint_signs
        return agree and self.found.evidence >= limits.joint_evidence

    @property
    def is_likelier(self) -> bool:
        """Whether the whole record is likelier with the fault than with an ideal valve, under a load with real poles:
        a free noise model of one stretch can take over the process at a single move of the set point. True if the
        whole record cannot answer."""
        return self.measured.problem.blocks.position is not None or self._is_thin or self.found.evidence > 0.0

    @property
    def shown(self) -> tuple[Fault, Measured]:
        """The fault of the likeliest valve, and the measures with its fit."""
        linear, valve = self._fits()
        measured = replace(self.measured, linear=linear, backlash=valve)
        if valve.valve.slip_jump < self.limits.least_jump * valve.valve.stickband:
            return Fault.BACKLASH, measured
        return Fault.STICTION, replace(measured, stick_slip=valve)

    def _fits(self) -> tuple[Fitted, Fitted]:
        """Process alone and behind the faulty valve. If the cycle of OP crosses the backlash it is fitted in the
        stretch of the measures, whose blocks are shorter: longer ones give a width that is too small."""
        m, found = self.measured, self.found
        if found.backlash.valve.stickband > self.limits.widest * m.problem.reach:
            return as_fit(found.ideal, found.backlash.p), found.backlash
        return m.linear, as_fit(in_problem(found, m.problem, self.period_s), m.problem)

    @property
    def _is_hidden(self) -> bool:
        """Whether the record cannot answer: its stem is recorded, the load was not compared, OP swings from limit to
        limit, few blocks are good, or the loop rings with few samples per cycle."""
        m, limits = self.measured, self.limits
        if m.ringing is None or m.problem.blocks.position is not None or m.problem.cycle_range >= WHOLE_PCT:
            return True
        if self._is_thin or self.is_recorded_by_exception:
            return True
        return self.period_s < limits.least_samples * self.record.dt_s and m.ringing.rings(limits)

    @property
    def _is_thin(self) -> bool:
        """Whether too few blocks of the whole record follow good ones: those of the stretch are shorter."""
        return judged_count(self._problem) < self.limits.judged

    @cached_property
    def is_recorded_by_exception(self) -> bool:
        """Whether a historian recorded only changes of PV of some size: what it keeps lags behind PV in either
        direction, as a stem does behind OP."""
        return held_move(self.record.pv[~self.record.bad]) > 0.0

    @property
    def _is_crossed(self) -> bool:
        """Whether OP crosses the backlash at least once in the record, the backlash is no small share of its range in
        a cycle, and the process gain has the controller's sign."""
        m, backlash = self.measured, self.found.backlash
        right_way = m.controller is None or m.controller.sign * backlash.gain > 0.0
        width = backlash.valve.stickband
        crossed = width <= self.limits.widest * backlash.p.op_range
        return right_way and crossed and width >= self.limits.joint_size * m.problem.reach

    @cached_property
    def _problem(self) -> Problem:
        """The whole record, with OP at the controller's scan if the measures have it there."""
        m = self.measured
        problem = whole_problem(self.record, m.problem, BLOCKS, self.period_s)
        scans = None if m.problem.blocks.steps == 1 else scans_of(self.record, problem, m.controller)
        if scans is None:
            return problem
        return with_scans(replace(m.backlash, p=problem), scans, SEARCHED).p

    def _starts(self) -> list[Dynamics]:
        """Time constants and dead times [s] at which the search begins."""
        m = self.measured
        starts = [(x.time_constant_s, max(x.dead_time_s, 0.0)) for x in (m.linear, m.backlash)]
        return starts + [(share * self.period_s, 0.05 * self.period_s) for share in LAGS]
