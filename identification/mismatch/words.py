"""The words of an explanation: one sentence per catalogue name that a shift supervisor understands."""

from __future__ import annotations

from identification.mismatch.answer import Answer

SENTENCES = {
    "backlash": "After each turn of OP the valve waits through a play of {backlash_pct}: check the linkage.",
    "stiction": "The valve sticks: it lets go after {stickband_pct} of OP, then jumps {slip_jump_pct}.",
    "rate-limit": "The valve moves no faster than {rate_pct_per_s}, so large moves of OP arrive as ramps.",
    "saturation": "Beyond {limit} of OP the valve does nothing more.",
    "valve-characteristic": "The valve's gain changes along its stroke (curve {curve}).",
    "positioner": "The positioner answers late (lag {positioner_lag_s}) and rests within {deadband_pct} of its aim.",
    "split-range": "At {split_pct} of OP another valve takes over, with {gain_ratio} times the gain.",
    "second-lag": "Something adds a lag of {second_lag_s}; the transmitter's damping would look the same.",
    "slow-mode": "A share of {slow_share} of each move arrives late, with a time constant of {slow_time_constant_s}.",
    "inverse-response": "After a move of OP, PV first goes the wrong way.",
    "direction-asymmetry": "PV rises and falls at different speeds (ratio of the time constants {ratio_down_up}).",
    "nonlinear-gain": "The process gain changes with PV (by {gain_slope}).",
    "sqrt-outflow": "The outflow grows with the root of the level, so gain and lag grow with it.",
    "overflow": "Above {cap_pct} of PV the vessel spills over.",
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
    """What is left, and why it has no name."""
    return said.note or "Something is left that no effect of the catalogue explains."


def _number(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}".strip()
