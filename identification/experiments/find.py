"""Location of experiments in a record: manual moves of OP, steps of the set point, and warm-ups."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from identification.record import Floats, LoopRecord, Mask
from identification.signals.robust import robust_deviation

SAMPLES = 40  # Good samples that an experiment needs [samples]: ten for each constant of a lag with dead time
LEAST_MOVE = 0.2
"""Range of OP below which a span in manual is no experiment [% of OP]: less is a rounding of OP."""
LEAST_PART = 0.05  # Part of OP's range from which a change is a move by itself [of OP's range]
REACH = 1.5
"""Part of a span in manual before and after the moves that belongs to the experiment [of the moves' span]:
hours at rest show only drift."""
SWITCHES = 8  # Moves from which an experiment in manual is a random sequence, or an on/off controller [moves]
RESTLESS = 0.5
"""Share of samples with up and down moves, from which OP is a controller's, independently of the mode: a
random sequence holds its level for several samples; a feedback law answers each sample of PV's noise."""
SWITCHED_AT = 0.1
"""Scatter of PV where OP goes up, over how far apart PV is where it goes up and down, below which PV switches
OP: by hand and by a clock it is a half and more."""
EXPERIMENTS_STROKE = 60.0
"""Range of OP from which moves in manual with a recorded stem are a valve stroke [% of OP]."""
EXPERIMENTS_PULSE = 0.25  # Time between two opposite moves below which they are a pulse [of the experiment]
MOST_MOVES = 12
"""Moves of a set point beyond which it follows something else and is no experiment [moves]: as of moves kept
of a night."""
OVER_NOISE = 10.0  # Size of a set point step, or of a warm-up, over PV's noise from sample to sample
EXPERIMENTS_WARM_UP = 3.0
"""Distance of PV from its set point at the start, over that in nine tenths of the second half, from which it
is a warm-up."""
COLD = 10.0
"""Distance of PV from its set point at the start from which it is a warm-up [% of PV's span]: less is made by
a load, or by a change to automatic."""

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


def in_manual(record: LoopRecord, manual: Mask) -> tuple[Experiment, ...]:
    """Experiments in spans in which only an operator or a script moves OP; manual, True there, shape (n,)."""
    found = (_in_span(record, first, last) for first, last in runs_of(manual & record.at_work))
    return tuple(x for x in found if x is not None)


def _in_span(record: LoopRecord, first: int, last: int) -> Experiment | None:
    """The experiment of one manual span, with margins before and after its moves as long as they last; n
    switches when PV crosses a level, or moves up and down at most samples."""
    op, pv = record.op[first:last], record.pv[first:last]
    moves = np.flatnonzero(np.diff(op) != 0.0) + 1
    size = float(np.ptp(op))
    if last - first < SAMPLES or size < LEAST_MOVE or float(np.ptp(pv)) == 0.0:
        return None
    large = moves[np.abs(op[moves] - op[moves - 1]) > LEAST_PART * size]
    if switched_by_pv(op, pv, moves) or _moves_often(op, moves):
        return None
    span = int(moves[-1] - moves[0])
    reach = max(REACH * span, SAMPLES) if moves.size > 1 else last - first
    begin, end = max(int(moves[0] - reach), 0), min(int(moves[-1] + reach), last - first)
    course = _course(op, moves, large, record.position is not None)
    return Experiment(course, first + begin, first + end, max(large.size, 1), size)


def _moves_often(op: Floats, moves: Places) -> bool:
    """Whether OP moves up and down at most samples, unlike an operator or a test; a ramp moves in one direction."""
    up = float((op[moves] > op[moves - 1]).mean()) if moves.size else 1.0
    return moves.size > RESTLESS * op.size and 0.1 < up < 0.9


def switched_by_pv(op: Floats, pv: Floats, moves: Places) -> bool:
    """Whether OP has two levels and switches up, and down, at one PV each: the hysteresis of an on/off controller."""
    if moves.size < SWITCHES or np.unique(op).size > 2:
        return False
    up = op[moves] > op[moves - 1]
    spread = float(np.ptp(pv)) or 1.0
    at = [pv[moves - 1][up], pv[moves - 1][~up]]
    difference = abs(float(np.median(at[0]) - np.median(at[1]))) if all(x.size for x in at) else 0.0
    scatter = max((robust_deviation(x - np.median(x)) for x in at), default=spread)
    return scatter < SWITCHED_AT * max(difference, 0.1 * spread)


def _course(op: Floats, moves: Places, large: Places, has_stem: bool) -> Course:
    """The course of OP in a manual experiment."""
    steps = op[moves] - op[moves - 1]
    if has_stem and float(np.ptp(op)) >= EXPERIMENTS_STROKE:
        return Course.STROKE
    if large.size < max(0.5 * moves.size, 1) and (np.sign(steps) == np.sign(steps[0])).mean() > 0.9:
        return Course.RAMP
    if moves.size >= SWITCHES:
        return Course.SWITCHING
    if large.size == 1:
        return Course.STEP
    back = abs(float(op[-1] - op[0])) < LEAST_PART * float(np.ptp(op))
    short = moves[-1] - moves[0] < EXPERIMENTS_PULSE * op.size
    return Course.PULSE if large.size == 2 and back and short else Course.STEPS


def in_automatic(record: LoopRecord) -> tuple[Experiment, ...]:
    """Steps of a set point that is constant between them, as one experiment; otherwise a warm-up at the start.

    Neither is found if SP was not recorded.
    """
    if record.sp_estimated or not record.usable.any():
        return ()
    steps = np.flatnonzero(np.abs(np.diff(record.sp)) > 1e-6) + 1
    steps = steps[record.usable[steps]]
    if steps.size > MOST_MOVES:
        return ()
    noise = robust_deviation(np.diff(record.pv)) if len(record) > 2 else 0.0
    large = steps[np.abs(record.sp[steps] - record.sp[steps - 1]) > OVER_NOISE * noise]
    if large.size:
        return _setpoint_steps(record, large)
    return _warm_up(record, noise)


def _setpoint_steps(record: LoopRecord, steps: Places) -> tuple[Experiment, ...]:
    """All steps of the set point in the automatic run with the most steps."""
    runs = [(a, b, steps[(steps > a) & (steps < b)]) for a, b in runs_of(record.usable)]
    first, last, inside = max(runs, key=lambda run: run[2].size)
    if last - first < SAMPLES or not inside.size:
        return ()
    span = int(inside[-1] - inside[0])
    reach = REACH * span if inside.size > 1 else last - first
    begin, end = max(first, int(inside[0] - reach)), min(last, int(inside[-1] + reach))
    size = float(np.abs(record.sp[inside] - record.sp[inside - 1]).max())
    return (Experiment(Course.SETPOINT, begin, end, int(inside.size), size),)


def _warm_up(record: LoopRecord, noise: float) -> tuple[Experiment, ...]:
    """A PV that approaches its set point from far away at the record's start, and stays near it."""
    first, last = max(runs_of(record.usable), key=lambda run: run[1] - run[0])
    error = record.error[first:last]
    if last - first < SAMPLES:
        return ()
    away, later = abs(float(np.median(error[:5]))), np.abs(error[(last - first) // 2 :])
    usual = float(np.quantile(later, 0.9))
    least = max(OVER_NOISE * noise, EXPERIMENTS_WARM_UP * usual, COLD)
    if away < least:
        return ()
    return (Experiment(Course.WARM_UP, first, last, 1, away),)
