"""The words of a proposal: why, with figures and units; sentences that need no rule stand in reasons.toml."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from importlib.resources import files

from identification.models import Backlash, Integrator, Loop, Pid
from tuning.describing import band, is_play
from tuning.frequency_response import integral_s
from tuning.limit_cycle import Confirmed, Cycle
from tuning.search import Bench, Candidate, rejection

WHY: Mapping[str, str] = tomllib.loads((files("tuning") / "reasons.toml").read_text("utf-8"))
"""Why a loop gets no settings, by its cause or by what decided it."""


def robustness(ms: float) -> str:
    """A maximum sensitivity in words; a loop that has none is unstable."""
    return f"Ms {ms:.2f}" if math.isfinite(ms) else "unstable"


def not_tight(ms: float) -> str:
    """Why a loop said to be tight gets no settings."""
    return f"The identified loop is robust as it is ({robustness(ms)}); its tuning does not explain the oscillation."


def _seconds(x: float) -> str:
    """A time without an exponent."""
    return f"{x:.3g}" if x < 1000 else f"{x:.0f}"


def little_less_error(left: float, now: float) -> str:
    """Why a tight loop gets no settings: on its own load calmer ones might win nothing."""
    way, size = ("raise", left - 1.0) if left > 1.0 else ("lower", 1.0 - left)
    return (
        f"Too tight ({robustness(now)}), but on a process that the data allow robust settings would {way} the "
        f"average absolute error by {100 * size:.0f} %{' alone' * (way == 'lower')}: a record with set point moves "
        "would tell more."
    )


def settings(controller: Pid) -> str:
    """Kp and Ti in words, in percent of spans and seconds."""
    ti = integral_s(controller)
    return f"Kp {controller.kp:.3g} %/%, Ti {f'{_seconds(ti)} s' if math.isfinite(ti) else 'off'}"


def tight(loop: Loop, new: Pid, before: float, ms: float) -> str:
    """Why SIMC settings are proposed."""
    was = robustness(before) + " on the identified process" * math.isinf(before)
    return (
        f"Too tight: {was} at {settings(loop.controller)}. SIMC for the identified process gives "
        f"{settings(new)} with {robustness(ms)}."
    )


def fault(loop: Loop) -> str:
    """A valve's fault with its size."""
    width = band(loop.valve)
    return (
        f"play of {width:.2g} %" if is_play(loop.valve) else f"stick-slip with a stickband of {width:.2g} %"
    )


def swings(cycle: Cycle | None) -> str:
    """A limit cycle with its period and amplitude."""
    if cycle is None:
        return "no limit cycle"
    return f"a cycle of {_seconds(cycle.period_s)} s and ±{cycle.pv_amplitude:.2g} % PV"


def _percent(ratio: float) -> str:
    return f"{100 * (ratio - 1):+.0f} %"


def valve(
    loop: Loop, best: Candidate, before: Confirmed, after: Confirmed, ms_before: float, table: Bench
) -> str:
    """Why settings for a loop with a faulty valve are proposed."""
    old, new = rejection(loop.process, loop.controller), rejection(loop.process, best.controller)
    return (
        f"The valve has {fault(loop)}: simulated, {swings(before.cycle)} at {settings(loop.controller)} "
        f"({robustness(ms_before)}) and {swings(after.cycle)} at {settings(best.controller)} "
        f"({robustness(best.ms)}). On the load, mean over {len(table.loops)} models: "
        f"stem travel {_percent(best.travel)}, average absolute error {_percent(best.error)}. "
        f"A load step at the valve peaks {new.peak / old.peak:.2g} times as high as now.{_outlook(loop, after)}"
    )


def _outlook(loop: Loop, after: Confirmed) -> str:
    if not is_play(loop.valve):
        return " Tuning cannot end stick-slip, only slow it; repairing the valve ends it."
    if isinstance(loop.process, Integrator):
        return " On an integrating process play always cycles under PI; P alone or a gap would end it."
    return "" if after.cycle is None else " Only a smaller play ends the rest."


def nothing_better(loop: Loop, before: Confirmed, considered: bool) -> str:
    """Why a faulty valve's loop gets no settings."""
    what = "is worth a change" if considered else "keeps robustness, load rejection and error"
    kind = "play" if isinstance(loop.valve, Backlash) else "stick-slip"
    return (
        f"The valve has {fault(loop)} and gives {swings(before.cycle)}; no pair of Kp and Ti {what}. "
        f"Only less {kind} helps without a price: repair the valve."
    )
