"""Check of the stated controller against OP, SP and PV: settings, clock, gap and logic, before any physics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from identification.controller.pi_regression import (
    ControlLaw,
    Trends,
    centred,
    recovered_law,
    span_length,
    trusted,
)
from identification.controller.pid_regression import integral_time
from identification.limits import ControllerLimits
from identification.record import Floats, Mask
from identification.simulation.lag import first_order
from identification.simulation.pi import due_moves, gapped


@dataclass(frozen=True, slots=True)
class StatedSettings:
    """The controller stated by the plant: kp [% OP/% PV], ti [samples], scans per sample of the recording; whether
    a comparison of laws, with all unlisted properties free, finds no others."""

    kp: float
    ti: float
    scans: float = 1.0
    confirmed: bool = False

    def thinned(self, limits: ControllerLimits) -> bool:
        """Whether OP responded to values of PV that were not recorded."""
        return self.scans >= limits.thinned


GAPS = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4, 0.55, 0.75, 1.0, 1.35, 1.8, 2.5, 3.5, 5.0)
"""Candidate gaps, in medians of the error's size."""
LATE_SAMPLES = "late_samples"
"""Name of the number for the lateness of PV's clock in a finding [samples]."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A finding about recorder or controller: its numbers, its samples (bool, shape (n,)), the effect's name."""

    values: Mapping[str, float]
    where: Mask = field(repr=False)
    name: str = ""


def op_step(op: Floats) -> float:
    """Resolution of OP [% OP]."""
    gaps = np.diff(np.unique(op))
    return float(np.quantile(gaps, 0.1)) if gaps.size else 0.0


def frozen_width(x: Trends, e: Floats, stated: StatedSettings) -> float:
    """Largest error [% PV] below which due moves of OP are missing and above which they occur; 0 without one."""
    due = np.abs(due_moves(e, stated.kp, stated.ti)) > max(op_step(x.op), 1e-6)
    still = np.diff(x.op, prepend=x.op[0]) == 0
    size = np.maximum(np.abs(e), np.abs(np.concatenate((e[:1], e[:-1]))))
    use, limits = due & x.usable, x.limits
    order = np.argsort(size[use])
    frozen, size = still[use][order], size[use][order]
    if frozen.size < 4 * limits.frozen_moves:
        return 0.0
    inside = np.cumsum(frozen) / np.arange(1, frozen.size + 1)
    beyond = (frozen.sum() - np.cumsum(frozen)) / np.maximum(np.arange(frozen.size)[::-1], 1)
    enough = np.arange(frozen.size) >= limits.frozen_moves
    good = np.flatnonzero(enough & (inside >= limits.frozen) & (beyond < limits.frozen_beyond * inside))
    return float(size[good[-1]]) if good.size else 0.0


def gap_finding(x: Trends, e: Floats, stated: StatedSettings) -> Finding | None:
    """Constant OP while the error is small: a law with a gap reproduces OP where the one without does not."""
    length = span_length(x.op.size, stated.ti, x.limits)
    n = (x.op.size // length) * length
    y = centred(x.op[:n], length)

    def residual_at(width: float, catches_up: bool) -> float:
        path = gapped(e, stated.kp, stated.kp / stated.ti, width, catches_up)
        return median_residual(y - centred(path[:n], length), length)

    size = float(np.median(np.abs(e[x.usable]))) if x.usable.any() else 0.0
    trials = [(residual_at(size * w, c), size * w) for w in GAPS for c in (True, False)]
    best, width = min(trials)
    still = np.diff(x.op, prepend=x.op[0]) == 0
    if best > x.limits.gap_leaves * residual_at(0.0, True):
        width = frozen_width(x, e, stated)
    inside = still & (np.abs(e) < width)
    if inside.mean() < x.limits.gap_share:
        return None
    return Finding({"gap_pct": width}, inside, "controller-gap")


def runs(still: Mask) -> list[tuple[int, int]]:
    """First and last (excluded) samples of each run of True."""
    edge = np.diff(np.concatenate(([0], still.astype(np.int8), [0])))
    return list(zip(np.flatnonzero(edge == 1), np.flatnonzero(edge == -1), strict=True))


def overridden(x: Trends) -> Mask:
    """True where a move of SP or a limit of OP overrides the law, and at adjacent samples, shape (n,)."""
    least = x.limits.at_limit
    here = (
        (np.abs(np.diff(x.sp, prepend=x.sp[0])) > x.limits.sp_kick)
        | (x.op <= least)
        | (x.op >= 100.0 - least)
    )
    return np.convolve(here, np.ones(3), mode="same") > 0


def lawless(x: Trends, found: ControlLaw) -> Mask:
    """True in spans of good samples where OP deviates far from the law of the other spans, shape (n,)."""
    n, length = found.residual.size, found.length
    size = np.sqrt((found.residual.reshape(-1, length) ** 2).mean(axis=1))
    whole = x.usable[:n].reshape(-1, length).all(axis=1)
    out = np.zeros(x.op.size, dtype=bool)
    out[:n] = np.repeat(whole & (size > x.limits.lawless * np.median(size) + op_step(x.op)), length)
    return out


def controller_logic(x: Trends, e: Floats, stated: StatedSettings, found: ControlLaw) -> Finding | None:
    """Spans in which something other than the law moves or holds OP."""
    off = lawless(x, found)
    if float(off.mean()) > x.limits.lawless_share and found.explained > 0.0:
        return Finding({"share": float(off.mean())}, off, "controller-logic")
    return constant_spans(x, e, stated)


def constant_spans(x: Trends, e: Floats, stated: StatedSettings) -> Finding | None:
    """Stretches in which OP is constant although the law requires moves, for any error."""
    path, limits = np.cumsum(due_moves(e, stated.kp, stated.ti)), x.limits
    least = limits.stuck_move * max(op_step(x.op), 0.02)
    where = np.zeros(x.op.size, dtype=bool)
    for first, last in runs((np.diff(x.op, prepend=x.op[0] + 1.0) == 0) & x.usable):
        if last - first >= limits.stuck_run and float(np.ptp(path[first:last])) > least:
            where[first:last] = True
    share = float(where.mean())
    return Finding({"share": share}, where, "controller-logic") if share > limits.stuck_share else None


def median_residual(residual: Floats, length: int) -> float:
    """Residual of the median span [% OP]."""
    return float(np.median(np.sqrt((residual.reshape(-1, length) ** 2).mean(axis=1))))


def is_reproduced(x: Trends, stated: StatedSettings, found: ControlLaw) -> bool:
    """Whether the stated law reproduces OP nearly as well as the identified one, overall and in the median span; on a
    thinned recording, whether it reproduces most of OP."""
    n, length, limits = found.residual.size, found.length, x.limits
    e, y = found.error(x.sp, x.pv)[:n], centred(x.op[:n], length)
    residual = y - stated.kp * (centred(e, length) + centred(np.cumsum(e), length) / stated.ti)
    lawful = trusted(found.residual, length, limits)
    moved = float(np.mean(y[lawful] ** 2))
    if stated.thinned(limits) and float(np.mean(residual[lawful] ** 2)) < limits.thinned_leaves * moved:
        return True
    whole = float(np.mean(residual[lawful] ** 2)) < limits.same_law**2 * float(
        np.mean(found.residual[lawful] ** 2)
    )
    least = median_residual(found.residual, length)
    return whole and median_residual(residual, length) < limits.same_law * least


def settings(found: ControlLaw, stated: StatedSettings, limits: ControllerLimits) -> Finding | None:
    """Identified settings that reproduce OP where the stated ones do not."""
    if found.explained < limits.law_explains or found.ki == 0 or found.kp / found.ki <= 0:
        return None
    ti = integral_time(found.kp, found.ki, found.residual.size)
    off_kp = abs(math.log(max(found.kp / stated.kp, 1e-6)))
    off_ti = abs(math.log(max(ti / stated.ti, 1e-6)))
    if max(off_kp, off_ti) < (limits.setting_thinned if stated.thinned(limits) else limits.setting):
        return None
    values = {"kp": found.kp, "ti_samples": ti} if off_kp >= off_ti else {"ti_samples": ti, "kp": found.kp}
    return Finding(values, np.ones(found.residual.size, dtype=bool), "controller-settings")


def judge(x: Trends, stated: StatedSettings) -> tuple[Finding | None, ControlLaw | None]:
    """The first finding about clock or controller, and the identified law.

    stated : the stated settings. Confirmed ones are not reported. On a thinned recording only clearly wrong
    ones are, because the law is not visible in detail. If the integral acts between the samples, nothing is
    reported.
    """
    limits, thinned = x.limits, stated.thinned(x.limits)
    if thinned and stated.ti < limits.thinned_ti:
        return None, None
    found = recovered_law(x, stated.ti, stated.kp, late=not thinned)
    e = x.sp - first_order(x.pv, found.smoothed) + found.offset
    wrong = None if stated.confirmed or is_reproduced(x, stated, found) else settings(found, stated, limits)
    if thinned:
        return wrong, found
    if found.late >= limits.late and found.explained > limits.law_explains:
        return Finding({LATE_SAMPLES: found.late}, np.ones(x.op.size, dtype=bool), "clock-offset"), found
    law_now = StatedSettings(found.kp, found.kp / found.ki) if wrong is not None else stated
    frozen = gap_finding(x, e, law_now)
    if frozen is not None:
        return frozen, found
    other = controller_logic(replace(x, usable=x.usable & ~overridden(x)), e, law_now, found)
    return (other if other is not None else wrong), found
