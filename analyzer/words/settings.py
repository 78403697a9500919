"""Sentences on settings, with units."""

from __future__ import annotations

from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import as_stated, derivative_as_stated
from analyzer.words.units import arrow, gain_unit, settings
from identification.models import Pid

NOT_STATED = "no new settings: loops.csv states no kp and ti of this loop; add them"
UNSTABLE = (
    "The identified loop would be unstable at the present settings, which the bounded cycle contradicts: the process "
    "is not known well enough for new settings."
)
NO_INTEGRAL = (
    "Without integral action, as loops.csv states, the identified loop would come to rest, but the record cycles: "
    "check kp and ti before new settings are sought."
)
ONE_FRICTION = "Settings are sought with one friction for all slips of the valve, not slip by slip."
JUST_CHANGED = "The settings were changed too late in the night to judge them: the next night tells."
CALM = "At the settings in force the valve's fault makes no cycle: its repair can wait for the next shutdown."


def of_controller(pid: Pid, spec: LoopSpec, pv_span: float) -> str:
    """A controller's settings as they are typed into it."""
    kp, ti = as_stated(pid, spec, pv_span)
    known = settings(kp, ti, gain_unit(spec.gain_unit, spec.pv_unit, spec.op_unit), spec.ti_unit)
    td = derivative_as_stated(pid, spec, pv_span)
    return f"{known}, Td {td:.3g} {'s' if spec.ti_unit == 's' else 'min'}" if td else known


def settings_changed(old: LoopSpec, new: LoopSpec, clock: str) -> str:
    """What was typed in within the night, and at which time of day."""
    gain = gain_unit(new.gain_unit, new.pv_unit, new.op_unit)
    parts = [
        f"{name} {arrow(a, b)} {unit}"
        for name, a, b, unit in (("Kp", old.kp, new.kp, gain), ("Ti", old.ti, new.ti, new.ti_unit))
        if a != b
    ]
    what = ", ".join(parts) or "settings changed"
    return f"{what} at {clock}"


def settings_differ(stated: Pid, recorded: Pid, spec: LoopSpec, pv_span: float) -> str:
    """What loops.csv states beside what OP follows."""
    listed, followed = (of_controller(pid, spec, pv_span) for pid in (stated, recorded))
    return (
        f"settings in loops.csv are not those of the controller: stated {listed}; recorded about {followed}. Correct "
        "loops.csv (or find out who changed them) before anything is typed in"
    )


def beyond_record(dead_time_s: float, duration_s: float) -> str:
    """Why a model gets no advice."""
    return (
        f"No settings: the model found has a dead time of {dead_time_s:.3g} s, more than a record of "
        f"{duration_s / 3600:.2g} h can show."
    )
