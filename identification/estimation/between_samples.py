"""OP at the controller's scan interval, between the rows of a record.

A stem behind backlash follows the extremes of OP, but a historian may keep one row in ten. Between two rows OP
follows the control law on PV. PV follows a model of the loop: valve and process driven by that OP, a load whose level
and slope are predicted from earlier rows, and noise of the measured size. Each row corrects OP and PV. No row is used
before its time; otherwise OP would react to PV before PV moves, and no dead time could be identified.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identification.estimation.gauss_newton import descend
from identification.estimation.model import Fitted
from identification.models import Pid
from identification.record import Floats
from identification.simulation.lag import Lag, stepped, unit_lag
from identification.simulation.pi import Law, next_op, per_scan
from identification.simulation.valve import StemLaw, first_slip, stem_step

Gains = tuple[float, float]
"""Shares of a prediction error that are added to the load's level and to its slope per row [-]."""
_LEVEL = [0.05 + 0.1 * k for k in range(10)]
_GAINS = [(a, b) for a in _LEVEL for b in (0.0, 2.0 * (2.0 - a) - 4.0 * math.sqrt(1.0 - a))]
"""Candidate gains: steady-state Kalman filters of a load that is a random walk, or whose slope is one (Kalata 1984),
under white noise. The gains with the best prediction of the next row are used."""
ROUNDS = 3
"""Alternations of OP and model: ours; in ten worn valves of shared plants sizes change by < .03 after the third."""
PATHS = 6
"""Paths of OP whose stems are averaged, so that one random draw of the unknown noise does not decide."""
SEED = 11
"""Seed of the drawn noise: the same record gives the same answer."""


class Rows(NamedTuple):
    """Rows of a record, PV, SP and OP [%], each of shape (n,)."""

    pv: Floats
    sp: Floats
    op: Floats


class Scans(NamedTuple):
    """What between-row simulation needs: the rows of a problem, the control law, and the scans per row."""

    rows: Rows
    law: Pid
    per_row: int


class LoopAtScan(NamedTuple):
    """A loop simulated at its controller's scan: control law, valve, process of unit gain, and its gain."""

    law: Law
    valve: StemLaw
    lag: Lag
    gain: float


def scans_per_row(law: Pid | None, row_s: float) -> int:
    """Controller scans per row of a record; 1 if unknown or if the scan is not faster than the record."""
    if law is None or not law.scan_s > 0.0:
        return 1
    return max(round(row_s / law.scan_s), 1)


def settled(fit: Fitted, scans: Scans) -> Fitted:
    """Fit the model and the OP between rows alternately; return the most likely fit."""
    best = None
    for _ in range(ROUNDS):
        fit = descend(with_scans(fit, scans), free_width=fit.valve.stickband > 0.0)
        best = fit if best is None or fit.log_likelihood > best.log_likelihood else best
    return best or fit


def with_scans(fit: Fitted, scans: Scans, count: int = PATHS) -> Fitted:
    """A fit whose problem has `count` paths of OP at the controller's scan, simulated by its model."""
    problem, paths = fit.p, op_at_scans(fit, scans, count)
    turn = problem.blocks.turn // problem.blocks.steps * scans.per_row
    return fit.within(op=paths[0], paths=paths, steps=scans.per_row, turn=turn)


def op_at_scans(fit: Fitted, scans: Scans, paths: int = PATHS) -> Floats:
    """An even number of equally probable paths of OP at every scan [% OP], shape (paths, n * scans): the recorded OP
    at each row and, between rows, the control law on simulated PV with its own noise. The noise has a fixed seed;
    each draw is used with both signs.
    """
    rows, count = scans.rows, scans.per_row
    step_s, process = fit.p.row_s / count, fit.process
    lag = unit_lag(process.time_constant_s, max(process.dead_time_s, 0.0), step_s)
    valve = StemLaw(*(float(x) for x in fit.valve))
    loop = LoopAtScan(per_scan(scans.law, step_s), valve, lag, process.gain)
    gains, noise_sd = _predictor(rows, loop, count)
    out = np.empty((paths, rows.pv.size * count))
    drawn = noise_sd * np.random.default_rng(SEED).standard_normal((paths // 2, rows.pv.size, count))
    for i, noise in enumerate((*drawn, *-drawn)):
        out[i] = _stepped(rows, loop, gains, noise)[0].ravel()
    return out


def without_noise(x: Floats) -> Floats:
    """A load [% PV], shape (n,), without its white noise: the mean of the forward and the backward prediction."""
    losses = [(float(np.mean(_tracked(x, g)[1] ** 2)), g) for g in _GAINS]
    gains = min(losses)[1]
    return 0.5 * (_tracked(x, gains)[0] + _tracked(x[::-1].copy(), gains)[0][::-1])


@njit(cache=True)
def _tracked(x: Floats, gains: Gains) -> tuple[Floats, Floats]:
    """Level estimated from the values up to each sample, and the prediction errors, both of shape (n,)."""
    out, surprise = np.empty_like(x), np.empty_like(x)
    level, slope = x[0], 0.0
    for k in range(x.size):
        e = x[k] - level - slope
        level, slope = level + slope + gains[0] * e, slope + gains[1] * e
        out[k], surprise[k] = level, e
    return out, surprise


def _predictor(rows: Rows, loop: LoopAtScan, scans: int) -> tuple[Gains, float]:
    """The gains with the best prediction of the next row, and the standard deviation of PV's noise [% PV]."""
    none = np.zeros((rows.pv.size, scans))
    loss, gains = min((float(np.mean(_stepped(rows, loop, g, none)[1] ** 2)), g) for g in _GAINS)
    return gains, math.sqrt((1.0 - gains[0]) * loss)


@njit(cache=True)
def _stepped(rows: Rows, loop: LoopAtScan, gains: Gains, noise: Floats) -> tuple[Floats, Floats]:
    """One path of OP, shape of noise, (n, scans), and the prediction error of each row [% PV], shape (n,)."""
    n, scans = noise.shape
    out, surprise, stems = np.empty_like(noise), np.empty(n), np.empty(n * scans)
    rest = first_slip(rows.op, loop.valve)
    stem, x, k = (rest, 0.0, rows.op[0]), 0.0, 0
    memory = (rows.op[0], rows.sp[0], rows.pv[0], 0.0)
    level, slope = rows.pv[0], 0.0
    for i in range(n):
        e = rows.pv[i] - loop.gain * x - level - slope
        level, slope, surprise[i] = level + slope + gains[0] * e, slope + gains[1] * e, e
        for j in range(scans):
            pv = rows.pv[i] if j == 0 else loop.gain * x + level + slope * j / scans + noise[i, j]
            memory = next_op(memory, loop.law, rows.sp[i], pv)
            if j == 0:
                memory = (rows.op[i], memory[1], memory[2], memory[3])
            out[i, j] = memory[0]
            stem = stem_step(stem, memory[0], loop.valve)
            stems[k] = stem[0] - rest
            late, later = max(k - loop.lag.delay, 0), max(k - loop.lag.delay - 1, 0)
            x = stepped(x, loop.lag, stems[late], stems[later])
            k += 1
    return out, surprise
