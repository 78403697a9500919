"""The result of tuning one loop: the simulated present, the proposed settings and their forecast."""

from __future__ import annotations

from dataclasses import dataclass

from identification.models import Estimate, Loop
from identification.record import Floats
from tuning.forecast import Forecast
from tuning.limit_cycle import Confirmed
from tuning.recommend import Proposal


@dataclass(frozen=True, slots=True)
class Tuning:
    """All results for retuning one loop.

    estimates by name with 90 % intervals; model, the identified loop with its present controller; period_s and
    amplitude_pct of the recorded cycle [s], [% of span], None if there is none; cycle, the simulated one; proposal;
    forecast, under the load of the whole record, None if nothing is proposed; load [% PV] of the fitted stretch on
    the scan's clock; others, other possible loops.
    """

    estimates: dict[str, Estimate]
    model: Loop
    period_s: float | None
    amplitude_pct: float | None
    cycle: Confirmed
    proposal: Proposal
    forecast: Forecast | None
    load: Floats
    others: tuple[Loop, ...] = ()
