"""Process identification from an experiment in automatic, by simulation error and with the known sign of the gain.

In closed loop the inverse of the control law also gives PV from OP: PV = SP - OP/kp, without lag and with the
opposite sign. A simulation from rest over the whole response, and the sign shown by OP's first move, exclude this
solution (Forssell, Ljung 1999, on direct identification and the bias from a wrong noise model).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from identification.experiments.columns import Kind, Trial
from identification.experiments.fit import RAMP_FROM, Fitted, Shape, descended
from identification.experiments.wander import Wander, wander_of, whitened


def shown_sign(trial: Trial) -> float:
    """The gain's sign from the balance dPV/dt ~ K (OP - OP at the end): with a positive gain PV rises while OP is
    above its final value; 0 where PV or OP does not move."""
    blocks = trial.op.reshape(-1, trial.factor).mean(axis=1)
    rest = float(np.median(blocks[-max(blocks.size // 10, 1) :]))
    width = max(blocks.size // 50, 1)
    risen = trial.pv[width:] - trial.pv[:-width]
    above = blocks[: risen.size] - rest
    inside = trial.usable[width:] & trial.usable[:-width]
    return float(np.sign(np.sum(above[inside] * risen[inside])))


def closed_candidates(trial: Trial, sign: float, from_rest: bool) -> list[Fitted]:
    """Candidates with that sign of gain, least criterion first; empty if there are none.

    from_rest : whether PV may begin away from the steady state of OP's first value, as in a warm-up.
    """
    found = []
    lags = np.geomspace(max(2.0 * trial.block_s, 0.004 * trial.duration_s), trial.duration_s, 6)
    for kind in (Kind.LAG, Kind.TWO_LAGS):
        for start, drift in ((True, False), (True, True)) if from_rest else ((False, False), (False, True)):
            shape = Shape(kind, drift=drift, start=start)
            tried = [
                descended(trial, shape, np.array([*_lags(kind, lag), dead * lag]), Wander())
                for lag in lags
                for dead in (0.05, 0.3)
            ]
            right = [f for f in tried if f.gain * sign > 0.0 and _is_slow(f)]
            if right:
                found.append(max(right, key=lambda f: f.log_likelihood))
    found.sort(key=lambda f: f.criterion)
    return [_with_noise_model(f) for f in found]


def _lags(kind: Kind, lag: float) -> tuple[float, ...]:
    return (math.log(lag),) if kind is Kind.LAG else (math.log(lag), math.log(0.2 * lag))


def _is_slow(fit: Fitted) -> bool:
    """Whether the process responds with a delay, unlike the inverse control law."""
    most = RAMP_FROM * fit.trial.duration_s
    return 2.0 * fit.trial.block_s < sum(fit.lags_s) + fit.dead_s and max(fit.lags_s) < most


def _with_noise_model(fit: Fitted) -> Fitted:
    """The fit with a noise model of its residual, for its intervals; its constants stay those of the simulation."""
    noise = wander_of(fit.trial.pv - fit.simulated, fit.trial.usable)
    e = fit.trial.pv - fit.simulated
    if noise.ratio == 0.0:
        return fit
    white, _ = whitened(e[:, None], fit.trial.usable, noise.phi, noise.ratio)
    return replace(fit, wander=noise, variance=float((white**2).sum()) / int(fit.trial.usable.sum()))
