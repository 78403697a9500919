"""From one recording to its explanation: recorder, controller, plain loop, then effects until nothing passes.

Read on in the order of the walk: recording, the faults of catalogue/, plain_loop, rounds, selection (with starts and
friction), proof, explanation; then answer, with where and location, and words.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from identification.controller.check import LATE_SAMPLES, Finding, judge
from identification.controller.pi_regression import ControlLaw, Trends, shifted, unstated_law
from identification.mismatch.catalogue import RECORDER_FAULTS, fault
from identification.mismatch.effect import Ends
from identification.mismatch.explanation import Explanation, agreed, beyond_the_grid, carried_over, ends
from identification.mismatch.plain_loop import Clip, inputs_of, prepared, without_spikes
from identification.mismatch.recording import Recording, is_experiment, straightened, unlogged
from identification.mismatch.rounds import physics
from identification.mismatch.selection import Progress, silent
from identification.record import Floats
from identification.simulation.parameters import Slot


def explain(s: Recording, tell: Progress = silent, brought: Floats | None = None) -> Explanation:
    """Explain where a plain loop and a recording differ.

    tell : is told what is tried, for progress; brought : constants of the user's own model, shape (SIZE,), with which
    the plain loop's search begins beside its own starts.
    """
    held = unlogged(s.stamp_s, s.pv.size, s.dt_s, s.limits.recorder)
    s = replace(s, usable=s.usable & ~held)
    recorder = recorder_finding_of(s)
    controller, law = controller_finding_of(s, recorder)
    late = 0.0 if controller is None else controller.values.get(LATE_SAMPLES, 0.0)
    pv = shifted(s.pv, late) if late else s.pv
    inputs, usable = inputs_of(replace(s, pv=pv)), without_spikes(s.pv, s.usable, s.limits.recorder)
    clip = transmitter_end(recorder, pv)
    plain_loop = partial(prepared, inputs, pv - inputs.level, usable, brought, clip, s.limits)
    tell("plain loop")
    p, plain = plain_loop()
    found = Explanation(
        p,
        plain,
        plain,
        recorder=recorder,
        controller=controller,
        law=law,
        late_s=late * s.dt_s,
        cycles=s.cycles,
    )
    if any(ends(x) is Ends.ALL for x in (recorder, controller)):
        return carried_over(found)
    explained = beyond_the_grid(physics(found, tell, s))
    if not is_experiment(s):
        return carried_over(explained)
    p, plain = plain_loop(experiment=True)
    by_misfit = beyond_the_grid(physics(replace(found, p=p, plain=plain, best=plain), tell, s))
    return agreed(explained, carried_over(by_misfit))


def recorder_finding_of(s: Recording) -> Finding | None:
    """The first thing that the recorder did to the trends."""
    found = ((effect.name, effect.find(s)) for effect in RECORDER_FAULTS if effect.find is not None)
    return next((replace(finding, name=name) for name, finding in found if finding is not None), None)


def controller_finding_of(s: Recording, recorder: Finding | None) -> tuple[Finding | None, ControlLaw | None]:
    """What clock and controller did, where there is a controller to judge and a recording fit for it, and the law
    that gives OP, stated or not."""
    if s.sp is None or ends(recorder) is Ends.ALL:
        return None, None
    recorder_limits, limits = s.limits.recorder, s.limits.controller
    if any(straightened(x, recorder_limits.straight_law, recorder_limits) for x in (s.pv, s.op)):
        return None, None
    free = s.usable & (s.op > limits.at_limit) & (s.op < 100.0 - limits.at_limit)
    x = Trends(s.sp, s.pv, s.op, free, limits)
    if s.stated is None:
        return None, unstated_law(x)
    return judge(x, s.stated)


def transmitter_end(recorder: Finding | None, pv: Floats) -> Clip | None:
    """Where a transmitter's range ends, if it does."""
    if recorder is None or not fault(recorder.name).censors:
        return None
    (value,) = recorder.values.values()
    upper = value > float(np.median(pv))
    return Clip(value, Slot.CLIP_HI if upper else Slot.CLIP_LO, recorder.where)
