"""The words of an explanation: a sentence per name that a shift supervisor reads, and what tells names apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from identification.mismatch.answer import Answer

SENTENCES = {
    "backlash": "After each turn of OP the valve waits through a play of {backlash_pct}: check the linkage.",
    "stiction": "The valve sticks: it holds through {stickband_pct} of travel and then jumps {slip_jump_pct}.",
    "rate-limit": "The valve moves no faster than {rate_pct_per_s}, so large moves of OP arrive as ramps.",
    "saturation": "Beyond {limit} the valve does nothing more.",
    "valve-characteristic": "The valve's gain changes along its stroke (curve {curve}).",
    "positioner": "The positioner answers late (lag {positioner_lag_s}) and rests within {deadband_pct} of its aim.",
    "split-range": "At {split_pct} another valve takes over, with {gain_ratio} times the gain.",
    "second-lag": "Something adds a lag of {second_lag_s}; the transmitter's damping would look the same.",
    "slow-mode": "A share of {slow_share} of each move arrives late, with a time constant of {slow_time_constant_s}.",
    "inverse-response": "After a move of OP, PV first goes the wrong way.",
    "direction-asymmetry": "PV rises and falls at different speeds (ratio of the time constants {ratio_down_up}).",
    "nonlinear-gain": "The process gain changes with PV (by {gain_slope}).",
    "sqrt-outflow": "The outflow grows with the root of the level, so gain and lag grow with it.",
    "overflow": "Above {cap_pct} the vessel spills over.",
    "integrator": "The process integrates: it does not settle by itself.",
    "flow-dependent-delay": "The dead time shrinks when the flow grows (share {flow_share}).",
    "gain-drift": "The process gain changed by {gain_drift} over the recording.",
    "quantization": "PV comes in steps of {step_pct}: the transmitter or its card is coarse.",
    "sensor-clipping": "PV stops at {clip_pct} while OP goes on: the transmitter's range ends there.",
    "compression": "The historian compressed the trends to straight lines; nothing can be judged on them.",
    "clock-offset": "PV is stamped {shift_s} later than OP: the two clocks differ.",
    "sampling": "The polling scatters by {jitter_samples} samples; do not trust fast motion of PV.",
    "controller-settings": "The controller runs with other settings than stated: Kp {kp} and Ti {ti_s}.",
    "controller-gap": "The controller stands still while the error is under {gap_pct}.",
    "controller-logic": "For {share_pct} of the time something other than the controller's law moved or held OP.",
    "load-step": "A load came in as a step ({size}); neither OP nor SP caused it.",
    "load-oscillation": "An outside oscillation with a period of {period_s} enters the loop.",
    "supply-variation": "The supply to the valve wanders and changes gain and bias together.",
    "coupling": "Another loop of the export moves this one (gain {coupling_gain}).",
    "none": "The plain loop explains the recording; nothing is left that the data could name.",
}


CHECKS = {
    "backlash": "Look at linkage, actuator and positioner feedback; stroke the valve both ways in small steps.",
    "stiction": "Look at packing and actuator; stroke the valve in steps under the stickband and watch the stem.",
    "rate-limit": "Look at air supply, booster and positioner; time a full stroke.",
    "saturation": "Look at the mechanical stop, a throttled hand valve, or a pump at its end.",
    "valve-characteristic": "Bend the signal back in the controller or positioner, or tune for the steepest part.",
    "positioner": "Look at the positioner's gain and dead band; a recorded stem position would settle it.",
    "split-range": "Look at where the two valves hand over, and whether their ranges overlap or leave a gap.",
    "second-lag": "Ask what lies between valve and transmitter; look at the transmitter's damping.",
    "slow-mode": "Ask which mass or recycle warms or fills slowly; tune for the fast part.",
    "inverse-response": "Expected of boilers, reboilers and the like; tune slower than the wrong-way part lasts.",
    "direction-asymmetry": "Ask whether heating and cooling, filling and draining take different ways.",
    "nonlinear-gain": "Schedule the controller's gain on PV, or tune for where the gain is highest.",
    "sqrt-outflow": "Tune at the low level, where the vessel answers fastest for its gain.",
    "overflow": "Look at the overflow's height and keep SP under it.",
    "integrator": "Tune as an integrating loop.",
    "flow-dependent-delay": "Schedule on flow, or tune at the least flow.",
    "gain-drift": "Ask what fouled, wore or changed over the recording.",
    "quantization": "Look at the transmitter's range and the input card's resolution.",
    "sensor-clipping": "Widen the transmitter's range, or keep SP inside it.",
    "compression": "Switch compression and exception off for PV, SP and OP, then ask again.",
    "clock-offset": "Record PV and OP from one source or synchronize the clocks.",
    "sampling": "Poll at a fixed rate, or record at the controller.",
    "controller-settings": "Read Kp, Ti and form in the controller and correct loops.csv or the controller.",
    "controller-gap": "Look for a dead band or gap action in the controller's configuration.",
    "controller-logic": "Look for tracking, overrides, limits or an operator's hand in those spans.",
    "load-step": "Ask what was switched at that time.",
    "load-oscillation": "Look upstream for a loop or machine that runs at that period.",
    "supply-variation": "Look at the supply's pressure or temperature over the same hours.",
    "coupling": "Look at the other loop first; feed its OP forward if it has to move.",
    "none": "Nothing has to be done about the model.",
    "unexplained": "Give it a recording with moves of the set point, or say what else acts on this loop.",
}
"""What to look at, by name."""


def _pairs(*rows: tuple[str, str, str]) -> dict[frozenset[str], str]:
    return {frozenset(row[:2]): row[2] for row in rows}


DISCRIMINATING_TESTS = _pairs(
    (
        "second-lag",
        "sensor-lag",
        "Nothing in SP, PV and OP does: a hand-held gauge or the transmitter's damping setting; with the damping "
        "changed, a sensor's lag changes and the process's stays.",
    ),
    (
        "second-lag",
        "inverse-response",
        "One clean step of OP in manual, sampled at a tenth of the lag or faster.",
    ),
    ("second-lag", "slow-mode", "A step of OP held for five of the longer time constants."),
    (
        "second-lag",
        "rate-limit",
        "A step of OP twice as large: a slewing valve takes twice as long, a lag does not.",
    ),
    (
        "second-lag",
        "positioner",
        "A recorded stem position; or steps of OP of several sizes, for a lag scales.",
    ),
    ("second-lag", "clock-offset", "The controller: does OP answer PV before PV moves?"),
    ("stiction", "positioner", "A recorded stem position, or a stem watched by eye while OP ramps slowly."),
    (
        "backlash",
        "stiction",
        "A slow ramp of OP in manual, then back: after the turn play lets PV go gently, stiction in jumps.",
    ),
    (
        "backlash",
        "positioner",
        "A slow ramp of OP and back, with the stem recorded: a dead band holds at every stop, play after turns.",
    ),
    (
        "backlash",
        "second-lag",
        "Two steps of OP in the same direction: play holds up the first after a turn alone, a lag holds up both.",
    ),
    ("backlash", "direction-asymmetry", "Two moves on in one direction: play is taken up by the first."),
    (
        "backlash",
        "controller-gap",
        "Whether OP itself stands still: then it is the controller and not the valve.",
    ),
    (
        "valve-characteristic",
        "nonlinear-gain",
        "The same PV at another OP: move the load, or another stream, and step OP again at the same PV.",
    ),
    (
        "valve-characteristic",
        "saturation",
        "Steps of OP near the end of the stroke: zero answer, or a smaller one.",
    ),
    (
        "valve-characteristic",
        "split-range",
        "Steps on both sides of the suspected point: only a second valve changes the lag.",
    ),
    (
        "valve-characteristic",
        "gain-drift",
        "Go back to the OP of the start and step again: drift stays, a curve returns.",
    ),
    (
        "nonlinear-gain",
        "gain-drift",
        "Go back to the PV of the start and step again: drift stays, a nonlinear gain returns.",
    ),
    (
        "nonlinear-gain",
        "sqrt-outflow",
        "Vary the inflow at one level: the root follows the level, geometry the place.",
    ),
    ("nonlinear-gain", "direction-asymmetry", "Steps up and down over the same span of PV."),
    (
        "nonlinear-gain",
        "flow-dependent-delay",
        "Steps at two flows at the same PV: the dead time moves, or the gain does.",
    ),
    ("rate-limit", "backlash", "One large and one small step of OP in the same direction."),
    ("rate-limit", "direction-asymmetry", "Steps of two sizes each way: a slew's time grows with the size."),
    (
        "slow-mode",
        "gain-drift",
        "Steps of both signs: a slow mode creeps with the step, drift does not know its sign.",
    ),
    ("slow-mode", "load-step", "The same step again: a slow mode comes back with it, a load does not."),
    ("slow-mode", "integrator", "Hold OP for five of the longest time constants and see whether PV settles."),
    ("inverse-response", "flow-dependent-delay", "Steps at two flow levels; the wrong way shows at both."),
    ("inverse-response", "positioner", "Three steps of OP apart in time: the wrong way must show in each."),
    (
        "overflow",
        "sensor-clipping",
        "Lower OP after the cap: a vessel that overflowed comes back at once, a clipped one later.",
    ),
    ("quantization", "stiction", "The grid: plateaus of a sticking valve do not share one."),
    (
        "load-oscillation",
        "stiction",
        "Put the loop in manual: an outside oscillation goes on, a sticking valve's ends.",
    ),
    ("load-oscillation", "coupling", "The other loop in manual for a few periods."),
    ("load-step", "gain-drift", "A step of OP after the event: a load moved the bias, a drift the gain."),
    ("load-step", "controller-logic", "The controller's event log at that time."),
    (
        "supply-variation",
        "gain-drift",
        "A longer recording: a supply comes back, fouling does not; other loops show it too.",
    ),
    ("supply-variation", "load-step", "The supply's own pressure or temperature trend."),
    ("supply-variation", "coupling", "The supply's own trend beside the other loop's OP."),
    ("flow-dependent-delay", "clock-offset", "Steps at two flows: an offset of clocks is the same at both."),
)
"""Which test or signal tells two names apart."""
LONGER = "A step of OP each way in manual, held for five time constants, at two operating points."
"""What tells apart what has no line of its own."""


def discriminating_test(one: str, other: str) -> str:
    """Which experiment or signal would tell two names of the catalogue apart."""
    return DISCRIMINATING_TESTS.get(frozenset((one, other)), LONGER)


class _Spoken(dict[str, str]):
    def __missing__(self, key: str) -> str:
        return "?"


def sentence(said: Answer) -> str:
    """One sentence for the verdict, with the numbers that it needs."""
    if not said.effects:
        return SENTENCES[said.verdict]
    shown = {k: _number(v.value, v.unit) for k, v in said.effects[0].parameters.items()}
    shown.setdefault("limit", shown.get("limit_pct", shown.get("low_limit_pct", "?")))
    shown.setdefault("size", shown.get("size_1_pct", "?"))
    text = SENTENCES[said.verdict].format_map(_Spoken(shown))
    others = [e.name for e in said.effects[1:]]
    return text + (f" Then also: {', '.join(others)}." if others else "")


def unexplained_reason(said: Answer) -> str:
    """What is left, where it lives, and why it has no name."""
    why = said.note or "Something is left that no effect of the catalogue explains."
    return f"{why} {located_sentence(said.where)}".strip()


PLACES = {
    "pv_level": "{range} of PV",
    "op_level": "{range} of OP",
    "op_direction": "one direction of OP",
    "op_rate": "moves of OP of {rate}",
    "after_reversals": "{range} after OP turned",
    "time_in_record": "{range} into the recording",
    "at_limits": "OP at its limit",
}
"""Where a feature puts the misfit."""
ALONG = {
    "pv_level": "a bias that changes along PV",
    "op_level": "a bias that changes along OP",
    "time_in_record": "a bias that changes with time",
    "op_direction": "a bias that turns its sign with OP's direction",
}
"""The same where it is errors of one sign: there is no one place of it."""
UNITS = {"pv_level": "%", "op_level": "%", "op_rate": "%/s", "after_reversals": "s", "time_in_record": "s"}


def place(feature: Mapping[str, Any]) -> str:
    """Where one feature of the answer's `where` puts the misfit."""
    if feature["by"] == "sign" and feature["name"] in ALONG:
        return ALONG[feature["name"]]
    unit, ends = UNITS.get(feature["name"], ""), feature["range"]
    text = f"{ends[0]:.3g} to {ends[1]:.3g} {unit}" if ends else "part of the range"
    return PLACES[feature["name"]].format(range=text, rate=text)


def located_sentence(where: Mapping[str, Any]) -> str:
    """Where the misfit lives, in one sentence; empty where nothing is known of it."""
    features = where.get("features", [])
    carrying = [place(f) for f in features if f["carries"]]
    if carrying:
        return f"Where it lives: {'; '.join(carrying[:3])}."
    return "The errors are tied to no level, direction, rate, turn or time." if features else ""


def _number(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}".strip()
