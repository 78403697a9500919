"""The user's own model beside the recording: how well it simulates, and whether its units can be right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from identification.mismatch.answer import restored, unanswered
from identification.mismatch.explanation import Explanation
from identification.mismatch.model_file import carried, constants
from identification.mismatch.proof import Misfit, misfit
from identification.mismatch.recording import Recording
from identification.record import Floats
from identification.simulation.parameters import Slot

HUNDRED = (60.0, 160.0)
"""Ratios of two gains that look like percent against fractions; ours: a refit moves a gain by less."""
SIXTY = (40.0, 90.0)
"""Ratios of two time constants that look like minutes against seconds."""
AN_HOUR = (2400.0, 5400.0)
"""Ratios of two time constants that look like hours against seconds."""


@dataclass(frozen=True, slots=True)
class Brought:
    """The user's model: PV as it simulates it [% PV], shape (n,), its misfit on both parts, one line about it."""

    simulated: Floats = field(repr=False)
    fitted: Misfit
    held_out: Misfit
    note: str

    def as_data(self) -> dict[str, Any]:
        """The entry `brought` of the answer's `fit`."""
        parts = {"fitted": self.fitted, "held_out": self.held_out}
        return {k: {"rmse": m.rmse, "fit_pct": m.fit_pct} for k, m in parts.items()} | {"note": self.note}


def within(ratio: float, ends: tuple[float, float]) -> bool:
    """Whether a ratio, or its inverse, lies between two ends."""
    size = abs(ratio)
    return ends[0] <= size <= ends[1] or (size > 0 and ends[0] <= 1.0 / size <= ends[1])


def wrong_units(own: Floats, found: Mapping[str, float]) -> str:
    """What looks wrong with a model's units against the process as identified; empty where nothing does.

    Parameters
    ----------
    own : ndarray of shape (SIZE,)
        Constants of the user's model.
    found : mapping
        gain [% PV/% OP] and time_constant_s of the plain loop fitted to the recording.
    """
    gain, lag = own[Slot.K] / found["gain"], own[Slot.T] / found["time_constant_s"]
    said = []
    if within(gain, HUNDRED):
        said.append(
            f"its gain, {own[Slot.K]:.3g}, is about 100 times off {found['gain']:.3g}, as percent are off fractions"
        )
    elif gain < 0:
        said.append(f"its gain, {own[Slot.K]:.3g}, has another sign than {found['gain']:.3g} found")
    for ends, unit in ((SIXTY, "minutes"), (AN_HOUR, "hours")):
        if within(lag, ends):
            size = f"{own[Slot.T]:.3g} s against {found['time_constant_s']:.3g} s"
            said.append(
                f"its time constant, {size} found, looks like {unit} taken for seconds or the reverse"
            )
    return "; ".join(said)


def compared(own: float, plain: float, as_good: float) -> str:
    """How a model does against the plain loop fitted anew, from both misfits."""
    if own > as_good * plain:
        return "it does worse than the plain loop can"
    return (
        "it does better than the plain loop can"
        if own * as_good < plain
        else "it does as well as the plain loop"
    )


def judged(data: Mapping[str, Any], found: Explanation, s: Recording, more: str = "") -> Brought:
    """The user's model on the recording, its mean freed, beside the plain loop refitted.

    Parameters
    ----------
    data : mapping
        A saved model.
    found : Explanation
    s : Recording
    more : str
        What else there is to say of it.
    """
    out = carried(dict(data), s.op, s.pv, s.dt_s)
    cut = int((1.0 - s.limits.proof.held_out) * s.pv.size)
    window, overall = found.proven.window, found.proven.overall
    whole = misfit(s.pv, out, window)
    said = f"Your model leaves {whole.rmse:.3g} % of span rms, the plain loop fitted anew {overall[0].rmse:.3g} %"
    if found.accepted:
        said += f", the improved loop {overall[1].rmse:.3g} %"
    units = "" if unanswered(found) else wrong_units(constants(dict(data)), restored(found.plain.model.c))
    verdict = "" if units else compared(whole.rmse, overall[0].rmse, s.limits.proof.as_good)
    note = "; ".join(x for x in (said, verdict, units, more) if x) + "."
    fitted, held = misfit(s.pv[:cut], out[:cut], window), misfit(s.pv[cut:], out[cut:], window)
    return Brought(out, fitted, held, note)
