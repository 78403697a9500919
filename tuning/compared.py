"""The settings that engineers would think of, each on one loop and one load, so that advice stands beside them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.models import Integrator, Loop, Pid
from identification.record import Floats
from identification.simulation.closed_loop import scan_step
from tuning.linear import integral_s, margins
from tuning.predict import assess, run, settled
from tuning.rules import backlash_rule, lambda_settings, simc

NOW, RECOMMENDED, SIMC, LAMBDA, LONGER = "now", "recommended", "SIMC", "lambda", "Ti not below T"
"""Names of the settings compared."""


@dataclass(frozen=True, slots=True)
class Tried:
    """One pair of settings on the load.

    controller; ms, maximum sensitivity [-], inf where the linear loop is unstable; stem_travel [%/h]; error, average
    of its absolute value [% PV]; peak, largest of it [% PV]; integral_s, Ti/|Kp| [s], integral of the error that a
    step of the load at OP leaves, inf without integral action.
    """

    name: str
    controller: Pid
    ms: float
    stem_travel: float
    error: float
    peak: float
    integral_s: float


def rivals(loop: Loop, new: Pid | None) -> dict[str, Pid]:
    """Settings to compare: the present ones, the recommended if any, and the rules'; those that equal earlier ones
    are left out."""
    now, h = loop.controller, scan_step(loop)
    found = {NOW: now} | ({} if new is None else {RECOMMENDED: new})
    rules = {SIMC: simc(loop.process, scan_s=h), LAMBDA: lambda_settings(loop.process, h)}
    found |= {name: replace(now, kp=pid.kp, ti_s=pid.ti_s, td_s=0.0) for name, pid in rules.items()}
    if not isinstance(loop.process, Integrator):
        found[LONGER] = backlash_rule(loop.process, now)
    seen: dict[tuple[float, float], str] = {}
    for name, pid in found.items():
        seen.setdefault((float(f"{pid.kp:.3g}"), float(f"{pid.ti_s:.3g}")), name)
    return {name: found[name] for name in seen.values()}


def tried(loop: Loop, load: Floats, settings: Mapping[str, Pid]) -> tuple[Tried, ...]:
    """Settings one by one on a loop under a load.

    Parameters
    ----------
    loop : Loop
    load : ndarray of shape (n,)
        Load and noise as they add to PV, on the controller's clock [% PV].
    settings : mapping of str to Pid

    Returns
    -------
    tuple of Tried
        In the order of the settings.
    """
    out = []
    for name, pid in settings.items():
        one = replace(loop, controller=pid)
        record = settled(run(one, load))
        figures = assess(record)
        peak = float(np.max(np.abs(record.error), initial=0.0))
        ms = margins(one).ms
        ms = ms if math.isfinite(ms) else math.inf
        error, rest_s = figures.average_absolute_error, integral_s(pid) / abs(pid.kp)
        out.append(Tried(name, pid, ms, figures.stem_travel, error, peak, rest_s))
    return tuple(out)
