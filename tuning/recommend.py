"""Recommended controller settings, or the reason for none, for a loop with a problem.

Its sentences are in reasons.toml; the texts inserted in them are made here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.models import Fopdt, Loop, Pid, Process
from identification.record import Floats
from identification.simulation.closed_loop import scan_step
from tuning import Action, Cause
from tuning.describing import band, is_backlash
from tuning.first_step import calmest, steps
from tuning.forecast import in_digits
from tuning.frequency_response import integral_s, maximum_sensitivity, rejects_s, resonance_s
from tuning.limit_cycle import Confirmed, confirm
from tuning.limits import LIMITS, TuningLimits
from tuning.reasons import WHY, fault_text, nothing_better, robustness, seconds_text, settings, why_calmer
from tuning.ringing import ObservedRinging, sensitivity_at
from tuning.rules import LAMBDA_PER_DELAY, TAU_C_PER_DELAY, effective_delay, simc
from tuning.search import (
    Bench,
    Candidate,
    LoadedLoop,
    bench,
    figures,
    robust,
    rounded,
    search,
    standard_load,
)

INTEGRAL_TIMES = 5
"""Number of integral times tried, from the longest to the shortest lag consistent with the record: neighbours differ
by less than two if the ends differ by ten."""
STEPS_ALONE = 25
"""Steps of an integral time that is alone, at most: ours, a factor of 200."""
WITHOUT_SETTINGS = {
    Cause.LOAD: Action.FIND_DISTURBANCE,
    Cause.UNDECIDED: Action.UNDECIDED,
    Cause.NONE: Action.NONE,
}
"""Action for a loop whose cause requires no new settings."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """The recommendation for a loop.

    reason, with figures; controller, the new settings, None unless action is retune; meanwhile, if the action is to
    repair the valve, settings better than the present ones until then; before and after, the simulated limit cycle
    without noise at the present and at the new settings; ms_before and ms, their maximum sensitivity [-], inf where
    unstable; candidates, those considered, best first.
    """

    action: Action
    reason: str
    controller: Pid | None = None
    meanwhile: Pid | None = None
    before: Confirmed | None = None
    after: Confirmed | None = None
    ms_before: float | None = None
    ms: float | None = None
    candidates: tuple[Candidate, ...] = ()

    @property
    def new(self) -> Pid | None:
        """The proposed settings, or those until a repair; None where there are none."""
        return self.controller or self.meanwhile


def _check(cause: str, load: Floats | None) -> None:
    """Raise ValueError for invalid arguments of `recommend`."""
    if cause not in tuple(Cause):
        raise ValueError(f"cause is one of {', '.join(Cause)}, got {cause!r}")
    if load is not None and not np.all(np.isfinite(load)):
        raise ValueError(
            f"load must be finite, {np.sum(~np.isfinite(load))} of its {load.size} values are not"
        )


def recommend(
    loop: Loop,
    cause: str,
    uncertainty: Sequence[Loop] = (),
    load: Floats | None = None,
    limits: TuningLimits = LIMITS,
    error: float | None = None,
    halfway: bool = False,
    seen: ObservedRinging | None = None,
    indistinguishable: Sequence[LoadedLoop] = (),
    unmoved: Floats | None = None,
) -> Proposal:
    """The proposal for one loop: identified process and valve with the present controller.

    cause, the cause of the problem, one of tuning.Cause, ValueError for any other; uncertainty, other loops
    consistent with the data; load, load and noise as they add to PV, on the controller's clock, shape (n,) [% PV],
    ValueError where it is not finite; None, or too short a load (tuning.limits): steps at the valve; error, the
    recorded average absolute error [% PV], because the simulation of a barely stable loop is too inaccurate, None:
    simulated; halfway, whether the dead time of a ringing loop is uncertain, so that a first step is proposed; seen,
    the observed ringing of such a loop, None: that of the model; indistinguishable, as in tuning.search.bench:
    settings must be no worse on these either; unmoved, the load of a loop that is too tight without the moves of its
    set point, which another day may lack, shape (m,) [% PV], None: there are none.
    """
    _check(cause, load)
    if cause not in (Cause.VALVE, Cause.TUNING):
        return Proposal(WITHOUT_SETTINGS[Cause(cause)], WHY[cause])
    old, slope = loop.controller, loop.process.slope
    if old.sign * slope <= 0.0:
        return Proposal(Action.CHECK_SETTINGS, WHY["wrong_sign"].format(old=settings(old), slope=slope))
    if cause == Cause.TUNING:
        cases = None if load is None else _cases(loop, uncertainty, load, error, unmoved)
        return _tight(loop, uncertainty, cases, seen or _alone(loop), limits, halfway)
    load = None if load is None or load.size < limits.least_steps else load
    return _valve(loop, uncertainty, load, limits, indistinguishable)


def _tight(
    loop: Loop,
    others: Sequence[Loop],
    cases: _Cases | None,
    seen: ObservedRinging,
    limits: TuningLimits,
    halfway: bool,
) -> Proposal:
    """SIMC for a loop that rings because of its tuning: nominal, or chosen under a known load.

    The aim is robustness. Of settings that raise the error on no model the ones with the least product of error and
    travel are chosen. If there are none, or the model does not determine them, a first step follows from the ringing
    alone.
    """
    now, old = maximum_sensitivity(loop), loop.controller
    if now <= limits.ms_most:
        return Proposal(Action.UNDECIDED, WHY["robust"].format(ms=robustness(now)), ms_before=now)
    if old.kp:
        found = _simc_settings(loop, others, 0 if cases is None else -limits.faster_most, limits)
    else:
        found = _integral_times(loop, others, limits)
    found = [pair for pair in found if sensitivity_at(old, pair[0], seen.period_s) <= limits.step_ms]
    best = None
    if found and not halfway:
        best = found[0] if cases is None else _least_of_both(found, cases, limits)
    if best is None:
        alone = None if old.kp else (*others, loop)[0].process
        return _first_step(old, now, seen, limits, alone)
    new, ms = best
    known = {"old": settings(old), "new": settings(new), "ms": robustness(ms)}
    was = robustness(now) + " on the identified process" * math.isinf(now)
    return Proposal(Action.RETUNE, WHY["tight"].format(was=was, **known), new, ms_before=now, ms=ms)


def _least_of_both(
    found: Sequence[tuple[Pid, float]], cases: _Cases, limits: TuningLimits
) -> tuple[Pid, float] | None:
    """Of the settings that raise the error on no model, those with the least product of error and travel,
    if any. None if a model does not ring as recorded: its load then contains the missing part, and no
    settings would remove it."""
    if cases.least_reproduced < limits.reproduced:
        return None
    tests = [cases.test(new) for new, _ in found]
    free = [k for k, x in enumerate(tests) if x.worst <= 1.0]
    return found[min(free, key=lambda k: tests[k].error * tests[k].travel)] if free else None


def _first_step(
    old: Pid, now: float, seen: ObservedRinging, limits: TuningLimits, process: Process | None = None
) -> Proposal:
    """The most robust step from the observed ringing alone with an error within the limit; among equals the one of
    least error; with a higher gain only if there is no other; none if there is none. An integral alone rings before
    any long lag, so its steps are tested on the identified process."""
    tried = steps(old, seen, process)
    best = calmest(old, tried, limits)
    known: dict[str, object] = {"period": seconds_text(seen.period_s)}
    if best is None:
        least = min(tried, key=lambda x: x.error, default=None)
        if least is None:
            return Proposal(Action.UNDECIDED, WHY["no_step"].format(**known), ms_before=now)
        known |= {"new": settings(least.new), "size": 100.0 * (least.error - 1.0)}
        return Proposal(Action.UNDECIDED, WHY["costly_step"].format(**known), ms_before=now)
    known |= {"new": settings(best.new), "size": 100.0 * (best.error - 1.0)}
    if process is not None:
        why = WHY["first_step_alone"].format(
            **known,
            most=100.0 * (limits.tight_error_growth - 1.0),
            pi=settings(simc(process, scan_s=old.scan_s)),
        )
        return Proposal(Action.RETUNE, why, best.new, ms_before=now)
    known["left"] = sensitivity_at(old, best.new, seen.period_s)
    return Proposal(Action.RETUNE, WHY["first_step"].format(**known), best.new, ms_before=now)


def _alone(loop: Loop) -> ObservedRinging:
    """The ringing of a loop according to its model alone."""
    period_s = resonance_s(loop)
    return ObservedRinging(period_s, np.array([2.0 * math.pi / period_s]), np.ones(1))


class _Test(NamedTuple):
    """Result of settings: mean travel [%/h] and error [% PV] of the loops, and the largest error over the present one
    on any loop [-]."""

    travel: float
    error: float
    worst: float


@dataclass(frozen=True, slots=True)
class _Cases:
    """Test cases of settings: loops consistent with the data, including the cautious one, one rounded load [% PV],
    and the present error under it [% PV], None: simulated; unmoved, the load without moves of the set point, None if
    it has none."""

    loops: tuple[Loop, ...]
    cautious: Loop
    load: Floats
    error: float | None
    unmoved: Floats | None = None

    @property
    def least_reproduced(self) -> float:
        """Least share of the recorded error that a loop has with the present settings [-]."""
        now = min(figures(one, self.load)[1] for one in self.loops)
        return now / (self.error or now or 1.0)

    def test(self, new: Pid) -> _Test:
        """The result of new settings."""
        cases = (*self.loops, self.cautious)
        did = [figures(replace(one, controller=new), self.load) for one in cases]
        now = [self.error or figures(one, self.load)[1] for one in cases]
        travel, error = np.mean(did[:-1], axis=0)
        worst = max(e / max(before, 1e-9) for (_, e), before in zip(did, now, strict=True))
        return _Test(float(travel), float(error), max(worst, self._worst_unmoved(new)))

    def _worst_unmoved(self, new: Pid) -> float:
        """The largest error of new settings over the present one on any loop without moves of the set point [-]."""
        if self.unmoved is None:
            return 0.0
        both = (
            (replace(one, controller=c) for c in (new, one.controller))
            for one in (*self.loops, self.cautious)
        )
        errors = ([figures(one, self.unmoved)[1] for one in pair] for pair in both)
        return max(after / max(before, 1e-9) for after, before in errors)


def _cases(
    loop: Loop, others: Sequence[Loop], load: Floats, error: float | None, unmoved: Floats | None
) -> _Cases:
    """Test cases for settings of a loop; without others, the cautious loop itself."""
    rest = None if unmoved is None else in_digits(unmoved)
    return _Cases((*others, loop)[: max(len(others), 1)], loop, in_digits(load), error, rest)


def _simc_settings(
    loop: Loop, others: Sequence[Loop], first: int, limits: TuningLimits
) -> list[tuple[Pid, float]]:
    """Robust SIMC settings with their Ms, from the `first` closed-loop time constant on, for all samples.

    Integral times are between the loop's own time constant and the shortest of its samples'; integral action that is
    off remains off. The gain of a ringing loop is not raised. The derivative is not changed. Another day may have a
    slower load than the recorded one: if there are any, the closed loop is not made slower than three dead times, the
    least of lambda tuning.
    """
    h, off = scan_step(loop), math.isinf(integral_s(loop.controller))
    delay = effective_delay(loop.process, h)
    tau_c = TAU_C_PER_DELAY * delay
    most = (limits.ms_most, *(limits.ms_most_sample for _ in others))
    lags = [one.process.time_constant_s for one in others if isinstance(one.process, Fopdt)]
    found: list[tuple[Pid, float]] = []
    for k in range(first, limits.slower_most):
        if found and tau_c * limits.slower**k > LAMBDA_PER_DELAY * delay:
            break
        nominal = simc(loop.process, tau_c * limits.slower**k, h)
        times = np.geomspace(nominal.ti_s, min([nominal.ti_s, *lags]), INTEGRAL_TIMES)
        for ti in [math.inf] if off else dict.fromkeys(times):
            kp = math.copysign(min(abs(nominal.kp), abs(loop.controller.kp)), nominal.kp)
            new = replace(loop.controller, kp=rounded(kp), ti_s=rounded(ti))
            ms = robust((loop, *others), new, most)
            found += [] if ms is None else [(new, ms)]
    return found


def _integral_times(loop: Loop, others: Sequence[Loop], limits: TuningLimits) -> list[tuple[Pid, float]]:
    """Robust settings of a controller with integral action alone, with their Ms: its present integral time in steps,
    up to lambda tuning of a process whose whole lag counts as dead time, for which that is the controller (Skogestad
    2003)."""
    old, process = loop.controller, loop.process
    if not isinstance(process, Fopdt):
        return []  # two integrators in series are not stable
    delay = effective_delay(process, scan_step(loop)) + process.time_constant_s
    slowest = (LAMBDA_PER_DELAY + 1.0) * delay * abs(process.gain)
    most = (limits.ms_most, *(limits.ms_most_sample for _ in others))
    found: list[tuple[Pid, float]] = []
    for k in range(1, STEPS_ALONE):
        new = replace(old, ti_s=rounded(old.ti_s * limits.slower**k))
        if found and rejects_s(new) > slowest:
            break
        ms = robust((loop, *others), new, most)
        found += [] if ms is None else [(new, ms)]
    return found


def _valve(
    loop: Loop,
    others: Sequence[Loop],
    load: Floats | None,
    limits: TuningLimits,
    indistinguishable: Sequence[LoadedLoop],
) -> Proposal:
    """Settings with the least travel and error within the limits, for a loop with backlash or stick-slip."""
    if band(loop.valve) <= 0.0:
        return Proposal(Action.UNDECIDED, WHY["no_size"])
    before, fault = confirm(loop), fault_text(loop)
    if load is None:
        load = standard_load(loop, limits.most_steps)
    table = bench(loop, others, load, limits, indistinguishable)
    now = maximum_sensitivity(loop)
    if table.travel[0] <= 0.0:
        why = WHY["no_travel"].format(fault=fault)
        return Proposal(Action.UNDECIDED, why, before=before, ms_before=now)
    candidates = search(table)
    chosen = _confirmed(table, candidates, before)
    if chosen is None:
        why = nothing_better(loop, before, bool(candidates))
        return Proposal(Action.REPAIR_VALVE, why, before=before, ms_before=now, candidates=candidates)
    best, after = chosen
    why = why_calmer(best, before, after, now, table)
    beyond = band(loop.valve) >= limits.band_beyond
    return Proposal(
        Action.REPAIR_VALVE if beyond else Action.RETUNE,
        WHY["beyond"].format(fault=fault, limit=limits.band_beyond) + why if beyond else why,
        controller=None if beyond else best.controller,
        meanwhile=best.controller if beyond else None,
        before=before,
        after=after,
        ms_before=now,
        ms=best.ms,
        candidates=candidates,
    )


def _worth(candidate: Candidate, now: Pid, limits: TuningLimits) -> bool:
    """Whether a candidate reduces travel enough for a change; the threshold is higher if it differs from the present
    settings by no more than the advice of two nights does."""
    new = candidate.controller
    alone = now.kp == 0.0
    gain, times = new.ki / now.ki if alone else new.kp / now.kp, (integral_s(new), integral_s(now))
    gain = abs(math.log(gain))
    time = 0.0 if alone or times == (math.inf, math.inf) else abs(math.log(times[0] / times[1]))
    near = gain <= math.log(limits.near_gain) and time <= math.log(limits.near_time)
    return candidate.travel <= 1.0 - (limits.worth_near if near else limits.worth_travel)


def _smaller(after: Confirmed, before: Confirmed, most_growth: float) -> bool:
    """Whether there is no new limit cycle, or one with less travel and without growth in PV."""
    if after.cycle is None:
        return after.settled
    if before.cycle is None:
        return False
    grown = after.cycle.pv_amplitude > most_growth * before.cycle.pv_amplitude
    return not grown and after.cycle.stem_travel <= before.cycle.stem_travel


def _distinct(candidates: list[Candidate], least_difference: float) -> list[Candidate]:
    """Candidates that differ from every better one by more than `apart`; the others would behave alike."""
    kept: list[Candidate] = []
    for c in candidates:
        here, *others = (np.log([abs(k.controller.kp) or 1.0, abs(k.controller.ti_s)]) for k in (c, *kept))
        if all(np.abs(here - other).max() > least_difference for other in others):
            kept.append(c)
    return kept


def _confirmed(
    table: Bench, candidates: tuple[Candidate, ...], before: Confirmed
) -> tuple[Candidate, Confirmed] | None:
    """The best worthwhile candidate whose simulated limit cycle is none or smaller, on samples too."""
    first, limits = table.loops[0], table.limits
    worth = [c for c in candidates if _worth(c, first.controller, limits)]
    distinct = _distinct(worth, limits.distinct)[: limits.confirmed]
    samples = (
        [(one, confirm(one)) for one in table.loops[1 : 1 + limits.samples_confirmed]] if distinct else []
    )
    growth = limits.cycle_growth if is_backlash(first.valve) else limits.cycle_growth_stick
    for candidate in distinct:
        after = confirm(replace(table.loops[0], controller=candidate.controller))
        if _smaller(after, before, growth) and all(
            _smaller(confirm(replace(one, controller=candidate.controller)), old, growth)
            for one, old in samples
        ):
            return candidate, after
    return None
