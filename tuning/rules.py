"""Closed-form tuning rules: SIMC for a process with a fault-free valve, the source study's for backlash."""

from __future__ import annotations

import math
from dataclasses import replace

from identification.models import Fopdt, Integrator, Pid, Process
from tuning.frequency_response import integral_s

TAU_C_PER_DELAY = 1.5
"""Closed-loop time constant over dead time of the nominal tuning. Source: the source study, section 5."""
LEAST_DELAY_SHARE = 0.0005
"""Least effective dead time over the time constant: without it a process without dead time gets infinite
gain: a quarter of the study's least (T/L = 500)."""
LAMBDA_PER_DELAY = 3.0
"""Closed-loop time constant of the lambda rule over the dead time at least. Source: Olsen, Bialkowski 2002:
three dead times keep the loop robust, as mills use the rule of Dahlin 1968."""


def effective_delay(process: Process, scan_s: float = 0.0) -> float:
    """Dead time plus half a scan [s], the hold's share of it (Grimholt, Skogestad 2012, rule of the half)."""
    delay = process.dead_time_s + 0.5 * scan_s
    if isinstance(process, Fopdt):
        return max(delay, LEAST_DELAY_SHARE * process.time_constant_s)
    return delay


def simc(process: Process, tau_c: float | None = None, scan_s: float = 0.0) -> Pid:
    """SIMC settings of a PI controller (Grimholt, Skogestad 2012).

    Kp = T/(K (tau_c + L)), Ti = min(T, 4 (tau_c + L)); for an integrator Kp = 1/(slope (tau_c + L)),
    Ti = 4 (tau_c + L). tau_c is the closed-loop time constant [s]; None: 1.5 times the dead time, the source study's
    nominal tuning. Half the scan counts as dead time. ValueError for a process without gain, or an integrator without
    dead time, scan and tau_c.
    """
    delay = effective_delay(process, scan_s)
    sum_s = delay + (TAU_C_PER_DELAY * delay if tau_c is None else tau_c)
    slope = process.slope
    if slope == 0.0 or sum_s <= 0.0:
        raise ValueError(
            f"SIMC needs gain and delay, has slope {slope:g} % PV/(% OP s) and tau_c + L {sum_s:g} s"
        )
    slowest = math.inf if isinstance(process, Integrator) else process.time_constant_s
    return Pid(1.0 / (slope * sum_s), min(slowest, 4.0 * sum_s), scan_s=scan_s)


def lambda_settings(process: Process, scan_s: float = 0.0) -> Pid:
    """Lambda settings of a PI controller: Kp = T/(K (lambda + L)), Ti = T (Dahlin 1968).

    lambda is the time constant, three dead times at least. For an integrator lambda is three dead times, Ti = 2
    lambda + L and Kp = Ti/(slope (lambda + L)^2) (Chien, Fruehauf 1990). Half the scan counts as dead time.
    ValueError for a process without gain, or an integrator without dead time and scan.
    """
    delay, slope = effective_delay(process, scan_s), process.slope
    if slope == 0.0 or delay <= 0.0:
        raise ValueError(f"the lambda rule needs gain and delay, has slope {slope:g} and L {delay:g} s")
    if isinstance(process, Integrator):
        aim = LAMBDA_PER_DELAY * delay
        ti = 2.0 * aim + delay
        return Pid(ti / (slope * (aim + delay) ** 2), ti, scan_s=scan_s)
    lag = process.time_constant_s
    aim = max(lag, LAMBDA_PER_DELAY * delay)
    return Pid(1.0 / (slope * (aim + delay)), lag, scan_s=scan_s)


def backlash_rule(process: Process, controller: Pid) -> Pid:
    """The source study's Eq. (6): Ti at least the time constant, gain unchanged.

    For an integrator, where the rule does not apply, the controller is unchanged.
    """
    if isinstance(process, Integrator):
        return controller
    return replace(controller, ti_s=max(integral_s(controller), process.time_constant_s))
