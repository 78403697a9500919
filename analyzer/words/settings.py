"""Sentences on settings and on what a recording lacks, with units."""

from __future__ import annotations

from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import as_stated, derivative_as_stated
from analyzer.words.units import arrow, gain_unit, settings
from identification.models import Pid

NOT_STATED = "no new settings: loops.csv states no kp and ti of this loop; add them"
MORE = "needs a longer record, or one with set point moves, for new settings."
UNSTABLE = (
    "The identified loop would be unstable at the present settings, which the bounded cycle contradicts: the process "
    "is not known well enough for new settings."
)
NO_INTEGRAL = (
    "Without integral action, as loops.csv states, the identified loop would come to rest, but the record cycles: "
    "check kp and ti before new settings are sought."
)
ONE_FRICTION = "Settings are sought with one friction for all slips of the valve, not slip by slip."
NO_SIGN_OF_A_LOAD = (
    "a load is likeliest, but only because no valve and no tuning is seen at work; needs some periods in manual: a "
    "swing that goes on comes from outside"
)
FOLDED = "what is seen may be such a cycle, folded by the sampling"
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


def sampled_too_thinly(dt_s: float, ti_s: float, samples: float) -> str:
    """Why a coarse recording gives no new settings."""
    return (
        f"new settings need a sample every {ti_s / samples:.2g} s or faster for an integral time of {ti_s:.3g} s, "
        f"there is one every {dt_s:g} s: take this as a hint"
    )


def too_short(hours: float, least: float) -> str:
    """Why a short record is a hint and no ground for new settings."""
    return f"new settings need {least:g} good hours in automatic, there are {hours:.3g}: take this as a hint"


def too_coarse(dt_s: float, period_s: float, samples: float) -> str:
    """Why a record cannot show the cycles that the loop would have."""
    return (
        f"oscillation needs a sample every {period_s / samples:.2g} s or faster, has one every {dt_s:g} s; a cycle "
        f"of this loop would take about {period_s:.3g} s"
    )


def beyond_record(dead_time_s: float, duration_s: float) -> str:
    """Why a model gets no advice."""
    return (
        f"No settings: the model found has a dead time of {dead_time_s:.3g} s, more than a record of "
        f"{duration_s / 3600:.2g} h can show."
    )


def too_few(samples: float, needed: float) -> str:
    """Why so few samples a cycle tell no load."""
    return (
        f"a load from outside needs {needed:g} samples a cycle to be told from a valve or the tuning, there are "
        f"{samples:.2g}"
    )


def stands_and_jumps(stands: float, jump_pct: float) -> str:
    """What a PV lacks that stands for a share of the samples [-] and else moves by so much [% of span] or more."""
    return (
        f"needs PV as measured; it stands for {100.0 * stands:.0f} % of the samples and else moves by "
        f"{jump_pct:.2g} % or more: a sensor that sticks, or a historian that keeps large changes alone"
    )


def valve_beside(size: float, agreeing: float) -> str:
    """Why a likely load is not told alone."""
    return (
        f"a load is likelier, but PV fits a play of {100 * size:.0f} % of OP's range as well, in "
        f"{100 * agreeing:.0f} % of the stretches between OP's turns; needs some periods in manual, or the valve "
        "stroked in small steps"
    )


def robust(ms: float) -> str:
    """Why a loop that seems too tight is not told so."""
    return (
        f"it swings as a loop too tight for its process does, but the one identified is robust (Ms {ms:.2f}); needs "
        "some periods in manual: a swing that stops is the loop's own"
    )


def too_rough(step_pct: float, amplitude_pct: float) -> str:
    """Why a coarse grid tells no cause."""
    return (
        f"needs finer values: PV is recorded in steps of {step_pct:.2g} % and swings by {amplitude_pct:.2g} %"
    )
