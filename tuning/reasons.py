"""The sentences of a recommendation, from reasons.toml, and the texts inserted in them."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from importlib.resources import files

from identification.models import Backlash, Integrator, Loop, Pid
from tuning.describing import band, is_backlash
from tuning.frequency_response import integral_s
from tuning.limit_cycle import Confirmed, Cycle
from tuning.search import (
    Bench,
    Candidate,
    rejection,
)

WHY: Mapping[str, str] = tomllib.loads((files("tuning") / "reasons.toml").read_text("utf-8"))
"""Reasons for settings or for none, by the cause or by the deciding condition."""


def robustness(ms: float) -> str:
    """Text for a maximum sensitivity; infinite means unstable."""
    return f"Ms {ms:.2f}" if math.isfinite(ms) else "unstable"


def seconds_text(x: float) -> str:
    """A time without an exponent."""
    return f"{x:.3g}" if x < 1000 else f"{x:.0f}"


def settings(controller: Pid) -> str:
    """Text for Kp and Ti, in percent of spans and seconds."""
    if controller.kp == 0.0:
        return f"Ti {seconds_text(controller.ti_s)} s (integral action only)"
    ti = integral_s(controller)
    return f"Kp {controller.kp:.3g} %/%, Ti {f'{seconds_text(ti)} s' if math.isfinite(ti) else 'off'}"


def fault_text(loop: Loop) -> str:
    """Text for a valve fault with its size."""
    width = band(loop.valve)
    return (
        f"backlash of {width:.2g} %"
        if is_backlash(loop.valve)
        else f"stick-slip with a stickband of {width:.2g} %"
    )


def swings(cycle: Cycle | None) -> str:
    """Text for a limit cycle with its period and amplitude."""
    if cycle is None:
        return "no limit cycle"
    return f"a cycle of {seconds_text(cycle.period_s)} s and ±{cycle.pv_amplitude:.2g} % PV"


def percent_text(ratio: float) -> str:
    return f"{100 * (ratio - 1):+.0f} %"


def why_calmer(best: Candidate, before: Confirmed, after: Confirmed, ms_before: float, table: Bench) -> str:
    """Reason for the settings of a loop with a faulty valve, and the remaining work."""
    loop, new = table.loops[0], best.controller
    peaks = [rejection(loop.process, pid).peak for pid in (new, loop.controller)]
    why = WHY["calmer"].format(
        fault=fault_text(loop),
        old=f"{swings(before.cycle)} at {settings(loop.controller)} ({robustness(ms_before)})",
        new=f"{swings(after.cycle)} at {settings(new)} ({robustness(best.ms)})",
        models=len(table.loops),
        travel=percent_text(best.travel),
        error=percent_text(best.error),
        peak=peaks[0] / peaks[1],
    )
    if not is_backlash(loop.valve):
        return f"{why} {WHY['stick_slip_stays']}"
    if isinstance(loop.process, Integrator):
        return f"{why} {WHY['play_always_cycles']}"
    return why if after.cycle is None else f"{why} {WHY['play_is_left']}"


def nothing_better(loop: Loop, before: Confirmed, considered: bool) -> str:
    """Reason for no settings for a loop with a faulty valve."""
    known = {"fault": fault_text(loop), "cycle": swings(before.cycle)}
    kind = "backlash" if isinstance(loop.valve, Backlash) else "stick-slip"
    return WHY["none_worth_it" if considered else "none_kept"].format(kind=kind, **known)
