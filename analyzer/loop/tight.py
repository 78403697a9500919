"""How tight an identified loop is: its maximum sensitivity, and how much more gain its process bears."""

from __future__ import annotations

from analyzer.loop.measure import Measured
from identification.estimation.hammerstein import process_of
from identification.models import Fopdt, Loop
from tuning.frequency_response import maximum_sensitivity
from tuning.rules import simc


def cautious(process: Fopdt, period_s: float | None) -> Fopdt:
    """A process with its time constant raised to two periods at the same slope.

    A cycle tells gain over time constant; a time constant much beyond the period cannot be told from it, and an
    integral time after one that is too short makes a loop swing that should be calmed.
    """
    t = max(process.time_constant_s, 2.0 * (period_s or 0.0))
    return Fopdt(process.slope * t, t, process.dead_time_s)


def sensitivity(m: Measured, period_s: float) -> float | None:
    """Ms of the identified loop [-], inf where it is unstable; None where no settings are known, or they act the
    wrong way. The smaller of those with the process as identified and as settings are sought for it.

    Parameters
    ----------
    m : Measured
    period_s : float
        Of the oscillation [s].
    """
    process, controller = process_of(m.window, m.linear), m.controller
    if controller is None or process.gain * controller.kp <= 0.0:
        return None
    return min(
        float(maximum_sensitivity(Loop(x, controller))) for x in (process, cautious(process, period_s))
    )


def gain_room(m: Measured) -> float | None:
    """SIMC's gain for the identified process over the present one [-]; None where no settings are known, or they act
    the wrong way, or the set point did not move: a load alone does not tell how late PV answers OP."""
    process, controller = process_of(m.window, m.linear), m.controller
    if not m.excited or controller is None or process.gain * controller.kp <= 0.0:
        return None
    return abs(simc(process, scan_s=controller.scan_s).kp / controller.kp)
