"""Location of experiments in a record: manual moves of OP, steps of the set point, and warm-ups."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from identification.limits import EXPERIMENTS
from identification.record import Floats, LoopRecord, Mask
from identification.signals.robust import robust_deviation

Places = NDArray[np.intp]
"""Samples at which a signal moves."""


class Course(StrEnum):
    """Type of experiment."""

    STEP = "step"
    STEPS = "steps"
    PULSE = "pulse"
    RAMP = "ramp"
    SWITCHING = "PRBS"
    STROKE = "valve stroke"
    SETPOINT = "set point steps"
    WARM_UP = "warm-up"

    @property
    def closed(self) -> bool:
        """Whether a controller moves OP in it."""
        return self in (Course.SETPOINT, Course.WARM_UP)


@dataclass(frozen=True, slots=True)
class Experiment:
    """One experiment: its course, its samples from first to last (excluded), its moves, and the range of OP, or SP,
    in it [% of span]."""

    course: Course
    first: int
    last: int
    moves: int
    size: float


def runs_of(mask: Mask) -> list[tuple[int, int]]:
    """Runs of True: first sample and the one after the last."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.view(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def by_hand(record: LoopRecord, manual: Mask) -> tuple[Experiment, ...]:
    """Experiments in spans in which only an operator or a script moves OP; manual, True there, shape (n,)."""
    found = (_in_span(record, first, last) for first, last in runs_of(manual & record.at_work))
    return tuple(x for x in found if x is not None)


def _in_span(record: LoopRecord, first: int, last: int) -> Experiment | None:
    """The experiment of one manual span, with margins before and after its moves as long as they last; None where OP
    or PV is constant, or where a controller moves OP whatever the mode signal: OP switches when PV crosses a level,
    or moves to and fro at most samples."""
    op, pv = record.op[first:last], record.pv[first:last]
    moves = np.flatnonzero(np.diff(op) != 0.0) + 1
    size = float(np.ptp(op))
    if last - first < EXPERIMENTS.samples or size < EXPERIMENTS.least_move or float(np.ptp(pv)) == 0.0:
        return None
    large = moves[np.abs(op[moves] - op[moves - 1]) > EXPERIMENTS.least_part * size]
    if switched_by_pv(op, pv, moves) or _restless(op, moves):
        return None
    span = int(moves[-1] - moves[0])
    reach = max(EXPERIMENTS.reach * span, EXPERIMENTS.samples) if moves.size > 1 else last - first
    begin, end = max(int(moves[0] - reach), 0), min(int(moves[-1] + reach), last - first)
    course = _course(op, moves, large, record.position is not None)
    return Experiment(course, first + begin, first + end, max(large.size, 1), size)


def _restless(op: Floats, moves: Places) -> bool:
    """Whether OP moves up and down at most samples, unlike an operator or a test; a ramp moves in one direction."""
    up = float((op[moves] > op[moves - 1]).mean()) if moves.size else 1.0
    return moves.size > EXPERIMENTS.restless * op.size and 0.1 < up < 0.9


def switched_by_pv(op: Floats, pv: Floats, moves: Places) -> bool:
    """Whether OP has two levels and switches up, and down, at one PV each: the hysteresis of an on/off controller."""
    if moves.size < EXPERIMENTS.switches or np.unique(op).size > 2:
        return False
    up = op[moves] > op[moves - 1]
    spread = float(np.ptp(pv)) or 1.0
    at = [pv[moves - 1][up], pv[moves - 1][~up]]
    apart = abs(float(np.median(at[0]) - np.median(at[1]))) if all(x.size for x in at) else 0.0
    scatter = max((robust_deviation(x - np.median(x)) for x in at), default=spread)
    return scatter < EXPERIMENTS.switched_at * max(apart, 0.1 * spread)


def _course(op: Floats, moves: Places, large: Places, has_stem: bool) -> Course:
    """The course of OP in a manual experiment."""
    steps = op[moves] - op[moves - 1]
    if has_stem and float(np.ptp(op)) >= EXPERIMENTS.stroke:
        return Course.STROKE
    if large.size < max(0.5 * moves.size, 1) and (np.sign(steps) == np.sign(steps[0])).mean() > 0.9:
        return Course.RAMP
    if moves.size >= EXPERIMENTS.switches:
        return Course.SWITCHING
    if large.size == 1:
        return Course.STEP
    back = abs(float(op[-1] - op[0])) < EXPERIMENTS.least_part * float(np.ptp(op))
    short = moves[-1] - moves[0] < EXPERIMENTS.pulse * op.size
    return Course.PULSE if large.size == 2 and back and short else Course.STEPS


def in_automatic(record: LoopRecord) -> tuple[Experiment, ...]:
    """Steps of a set point that is constant between them, as one experiment; otherwise a warm-up at the start.

    Neither is found if SP was not recorded.
    """
    if record.sp_estimated or not record.usable.any():
        return ()
    steps = np.flatnonzero(np.abs(np.diff(record.sp)) > 1e-6) + 1
    steps = steps[record.usable[steps]]
    if steps.size > EXPERIMENTS.most_moves:
        return ()
    noise = robust_deviation(np.diff(record.pv)) if len(record) > 2 else 0.0
    large = steps[np.abs(record.sp[steps] - record.sp[steps - 1]) > EXPERIMENTS.over_noise * noise]
    if large.size:
        return _setpoint_steps(record, large)
    return _warm_up(record, noise)


def _setpoint_steps(record: LoopRecord, steps: Places) -> tuple[Experiment, ...]:
    """All steps of the set point in the automatic run with the most steps."""
    runs = [(a, b, steps[(steps > a) & (steps < b)]) for a, b in runs_of(record.usable)]
    first, last, inside = max(runs, key=lambda run: run[2].size)
    if last - first < EXPERIMENTS.samples or not inside.size:
        return ()
    span = int(inside[-1] - inside[0])
    reach = EXPERIMENTS.reach * span if inside.size > 1 else last - first
    begin, end = max(first, int(inside[0] - reach)), min(last, int(inside[-1] + reach))
    size = float(np.abs(record.sp[inside] - record.sp[inside - 1]).max())
    return (Experiment(Course.SETPOINT, begin, end, int(inside.size), size),)


def _warm_up(record: LoopRecord, noise: float) -> tuple[Experiment, ...]:
    """A PV that approaches its set point from far away at the record's start, and stays near it."""
    first, last = max(runs_of(record.usable), key=lambda run: run[1] - run[0])
    error = record.error[first:last]
    if last - first < EXPERIMENTS.samples:
        return ()
    away, later = abs(float(np.median(error[:5]))), np.abs(error[(last - first) // 2 :])
    usual = float(np.quantile(later, 0.9))
    least = max(EXPERIMENTS.over_noise * noise, EXPERIMENTS.warm_up * usual, EXPERIMENTS.cold)
    if away < least:
        return ()
    return (Experiment(Course.WARM_UP, first, last, 1, away),)
