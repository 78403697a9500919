"""The effect of one change of settings on a true plant: travel, error, and rejection of a load step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofs.retuning_plant import Outside, Rig, Trends, held, outside, run, without_fault

SETTLE = 0.25
"""Share of the time after the change in which the loop settles; it is not measured."""
STATED_PEAK, STATED_INTEGRAL = 2.0, 3.5
"""Permitted factors of a proposal (tuning/limits.py). The first is for the largest deviation after a load step,
relative to the nominal tuning. The second is for the error's integral, relative to the nominal gain with Ti = max(T,
nominal Ti)."""
STATED_INTEGRAL_RAMP = 10.0
"""The second factor on an integrating level."""
GRID = 9
"""Points in Kp and in Ti of the search on the true plant."""
ERROR_MOST = 1.05
"""Largest permitted ratio of the error after to the error before [-]."""
Settings = tuple[float, float]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Figures:
    """Stem travel [%/h] and average absolute error [% PV] of one section."""

    travel: float
    error: float


@dataclass(frozen=True)
class Rejection:
    """Answer to a unit load step at the valve, without friction and backlash: largest deviation, integral of its
    absolute value [% PV, % PV s], and whether it decays."""

    peak: float
    integral: float
    dies: bool


@dataclass(frozen=True)
class Outcome:
    """One loop: its row, and the true plant under the old settings, the new ones, and those of the rule.

    known: the best result of a search on the true plant itself, within the same limits; None for loops without a
    fault.
    """

    rig: Rig
    row: dict[str, Any]
    new: Settings | None
    old: Figures
    after: Figures
    rule: Figures
    rule_found: Figures
    known: Figures | None
    rejection: Rejection | None
    rejection_old: Rejection
    nominal: Rejection
    reference: float

    @property
    def travel(self) -> float:
        """Stem travel after over before [-]."""
        return self.after.travel / max(self.old.travel, 1e-9)

    @property
    def error(self) -> float:
        """Average absolute error after over before [-]."""
        return self.after.error / max(self.old.error, 1e-9)

    @property
    def peak(self) -> float:
        """Peak after a load step over nominal, or over the old tuning's where that is higher [-]."""
        most = max(self.nominal.peak, self.rejection_old.peak / STATED_PEAK)
        return (self.rejection.peak if self.rejection else 0.0) / most

    @property
    def integral(self) -> float:
        """Integral of the error after a load step over that of nominal gain and Ti >= T [-]."""
        return (self.rejection.integral if self.rejection else 0.0) / self.reference

    @property
    def failures(self) -> list[str]:
        """The requirements that the proposal violates."""
        if self.new is None or self.rejection is None:
            return []
        most = STATED_INTEGRAL_RAMP if self.rig.lag == 0 else STATED_INTEGRAL
        violated = {
            "unstable": not self.rejection.dies,
            "error": self.error > ERROR_MOST,
            "sleepy (peak)": self.peak > 1.001 * STATED_PEAK,
            "sleepy (integral)": self.integral > 1.001 * most,
        }
        return [name for name, holds in violated.items() if holds]


def nominal(rig: Rig) -> Settings:
    """SIMC on the true plant, with a closed-loop time constant of 1.5 effective delays."""
    lag = rig.lag + 0.5 * rig.second if rig.lag > 0 else math.inf
    return 1.0 / (rig.slope * 2.5 * rig.delay), min(lag, 10.0 * rig.delay)


def rejection(rig: Rig, settings: Settings, horizon: float) -> Rejection:
    """The plant without its valve's fault after a load step of 1 %, for `horizon` seconds."""
    n = int(min(max(horizon / rig.scan, 400), 400_000))
    load = np.ones(n)
    load[:3] = 0.0
    t = held(without_fault(rig), Outside(load, np.zeros(n)), settings)
    off = np.abs(t.pv - 50.0)
    remaining = float(off[-n // 8 :].max())
    return Rejection(float(off.max()), float(off.sum() * rig.scan), remaining < 0.2 * float(off.max()))


def figures(rig: Rig, t: Trends, first: int) -> Figures:
    """Travel and error from scan `first` on."""
    stem, pv = t.stem[first:], t.pv[first:]
    hours = pv.size * rig.scan / 3600
    return Figures(float(np.abs(np.diff(stem)).sum()) / hours, float(np.mean(np.abs(pv - 50.0))))


def changed(rig: Rig, settings: Settings) -> Trends:
    """Both recordings one after the other; the settings change between them."""
    n = rig.scans
    kp, ti = np.full(2 * n, rig.kp), np.full(2 * n, rig.ti)
    kp[n:], ti[n:] = settings
    return run(rig, outside(rig, 2 * n), kp, ti)


def admissible(rig: Rig, settings: Settings, slowest: Rejection, horizon: float) -> bool:
    """Whether settings are stable and reject a load step within the permitted factors."""
    r = rejection(rig, settings, horizon)
    return r.dies and r.peak <= slowest.peak and r.integral <= slowest.integral


def best_known(rig: Rig, old: Figures, slowest: Rejection, horizon: float, first: int) -> Figures:
    """The least travel in a search on the true plant within the same limits, with an error of up to +5 %."""
    gain, ti = nominal(rig)
    least = old
    for kp in gain * np.geomspace(0.3, 1.6, GRID):
        for time in np.geomspace(0.5 * ti, 4.0 * max(ti, rig.lag), GRID):
            got = figures(rig, changed(rig, (float(kp), float(time))), first)
            better = got.travel < least.travel and got.error <= ERROR_MOST * old.error
            if better and admissible(rig, (float(kp), float(time)), slowest, horizon):
                least = got
    return least


def outcome(rig: Rig, row: dict[str, Any], new: Settings | None) -> Outcome:
    """The outcome of the new settings, of the rule with true and identified T, and of the best settings with
    everything known."""
    now, first = (rig.kp, rig.ti), int((1 + SETTLE) * rig.scans)
    found = row["time_constant_s"] or 0.0
    tried = [now, new or now, (rig.kp, max(rig.ti, rig.lag)), (rig.kp, max(rig.ti, found))]
    got = [figures(rig, changed(rig, s), first) for s in tried]
    best = nominal(rig)
    horizon = 20 * rig.delay + 8 * max(rig.lag, best[1], new[1] if new else 0.0)
    answers = [rejection(rig, s, horizon) for s in (now, best)]
    reference = rejection(rig, (best[0], max(rig.lag, best[1])), horizon).integral
    known = None
    if rig.width > 0:
        peak = max(STATED_PEAK * answers[1].peak, answers[0].peak)
        most = STATED_INTEGRAL if rig.lag > 0 else STATED_INTEGRAL_RAMP
        known = best_known(rig, got[0], Rejection(peak, most * reference, True), horizon, first)
    after = rejection(rig, new, horizon) if new else None
    return Outcome(rig, row, new, *got, known, after, answers[0], answers[1], reference)
