"""The belief about one loop: its update from the previous night, and the decision that follows from it.

A settings change restarts the part on the cycle, because settings determine cycle and advice; a repair restarts that
on the valve. The decision contradicts no certain result of the night itself: a loop that did not oscillate has no
cause except a worn valve.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from operator import attrgetter
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from analyzer.belief import cycle, valve
from analyzer.belief.cycle import CycleBelief, Pair, RemedyBelief
from analyzer.belief.pool import Pool
from analyzer.belief.valve import ValveBelief, Witness
from analyzer.belief.wear import PhaseKnown, Width, forgotten, with_repetitions
from analyzer.columns import Row
from analyzer.config import BeliefLimits, Config
from analyzer.loop import action
from analyzer.loop.decisions import CAUSES, Action, Cause, Due, Fault, Status, counts
from identification.estimation.backlash_stiction import WIDTHS

REMEMBERED = 120  # Number of nights whose widths are stored [nights]: four months
MOST_DEVIATION = 2.0
"""Standard deviation of a logarithm beyond which a constant is unknown in a night: a factor of seven."""
REPETITIONS = 60
"""Number of stored repetitions of a programme's phase: some weeks of daily batches, a few days of hourly
ones."""
LEAST_DEVIATION = 0.01
"""Least standard deviation of the logarithm of a constant from one night; no process is known more
precisely."""

NEEDED, EARLIER = 10.0, 0.1
"""Required evidence [nat], and standard deviation of a width's logarithm, of nights stored by earlier versions."""
CONSTANTS = ("slope", "time_constant_s", "gain", "dead_time_s", "width", "slip_jump")
"""Constants that are pooled over nights."""
OF_VALVE = ("width", "slip_jump")
"""Constants that a repair of the valve changes."""
GIST = attrgetter("cause", "fault", "action", "source")
"""Attributes in which two decisions differ."""


@dataclass(frozen=True, slots=True)
class NightDecision:
    """The decision on a loop in a night.

    cause, and the confidence in each cause [%]; fault of the valve; source, the loop that it follows;
    action and its due time; pair, the settings.

    own is True if the decision equals that by this night alone. calmed is True if new settings removed
    most of a cycle, so that the repair can wait.
    """

    cause: Cause = Cause.UNDECIDED
    confidence: Mapping[Cause, float] = field(default_factory=dict)
    fault: Fault = Fault.UNDECIDED
    source: str | None = None
    action: Action | None = None
    due: Due | None = None
    pair: Pair | None = None
    own: bool = True
    calmed: bool = False


@dataclass(frozen=True, slots=True)
class NightFigures:
    """Figures of a loop in its last night under some settings: significance [% h], share [%] and period [s] of its
    oscillation, amplitude of PV and average absolute error [% of span]."""

    night: str
    significance: float
    oscillating_pct: float
    period_s: float | None
    amplitude_pct: float | None = None
    error_pct: float | None = None


@dataclass(frozen=True, slots=True)
class Belief:
    """The belief about a loop after a night.

    night, the last that counted; end_s, the end of its record; kp, ti, the settings in force; before, figures under
    the settings before; straight_pct, share of its PV on straight segments [%], and recorder, the first night
    recorded in this way, '' if all were; phases of its programme.
    """

    loop: str
    night: str
    end_s: float = 0.0
    kp: float | None = None
    ti: float | None = None
    valve: ValveBelief = field(default_factory=ValveBelief)
    cycle: CycleBelief = field(default_factory=CycleBelief)
    remedy: RemedyBelief = field(default_factory=RemedyBelief)
    constants: Mapping[str, Pool] = field(default_factory=dict)
    widths: tuple[Width, ...] = ()
    before: NightFigures | None = None
    last: NightFigures | None = None
    told: NightDecision = field(default_factory=NightDecision)
    straight_pct: float | None = None
    recorder: str = ""
    phases: tuple[PhaseKnown, ...] = ()

    def is_calmed(self, limits: BeliefLimits) -> bool:
        """Whether the last change of settings removed most of a cycle."""
        then, now = self.before, self.last
        if then is None or now is None or not counts(then.oscillating_pct):
            return False
        return now.significance <= limits.calmed * then.significance


_types: Callable[[Any], dict[str, Any]] = cache(get_type_hints)


def kept_as(belief: Belief) -> str:
    """A belief as stored (JSON), from which that of the next night continues."""
    return json.dumps(belief, separators=(",", ":"), default=_as_fields)


def _as_fields(value: Any) -> dict[str, Any]:
    return {name: getattr(value, name) for name in _types(type(value))}


def belief_of(text: str) -> Belief:
    """A stored belief; KeyError, TypeError or ValueError for one of another version."""
    return _reader(Belief)({"phases": []} | json.loads(text))  # type: ignore[no-any-return]


@cache
def _reader(kind: Any) -> Callable[[Any], Any]:
    """A function that converts a value from JSON to a declared type."""
    if kind in (float, int, str, bool):
        return lambda kept: kept
    if hasattr(kind, "__dataclass_fields__"):
        named = [(name, _reader(of)) for name, of in _types(kind).items()]
        return lambda kept: kind(**{name: read(kept[name]) for name, read in named})
    origin, of = get_origin(kind), get_args(kind)
    if origin is None:
        return kind  # type: ignore[no-any-return]
    each = [_reader(x) for x in of if x not in (NoneType, ...)]
    first = each[0]
    if origin is UnionType:
        return lambda kept: None if kept is None else first(kept)
    if origin is tuple and of[-1] is ...:
        return lambda kept: tuple(map(first, kept))
    if origin is tuple:
        return lambda kept: tuple(read(x) for read, x in zip(each, kept, strict=False))
    return lambda kept: {first(k): each[1](v) for k, v in kept.items()}


def step(before: Belief | None, row: Row, repaired_s: Sequence[float], config: Config) -> Belief | None:
    """The belief after a night: unchanged if the night gives no result, None if no night has.

    before : that of the previous night, None if there is none; row : the loop's of the night; repaired_s : times of
    valve repairs from notes [s since 1970-01-01 UTC].
    """
    if row["status"] == Status.OK and row["oscillating_pct"] is None and row.get("experiment"):
        return _with_constants(before or Belief(row["loop"], ""), row, config.belief)
    if row["status"] != Status.OK or row["oscillating_pct"] is None:
        return before
    now, limits = before or Belief(row["loop"], ""), config.belief
    share = valve.faded_over(now.night, row["night"], limits) if now.night else 1.0
    now = _after_recorder_change(_after_changes(now, row, repaired_s), row, limits)
    found = cycle.cycle_with_night(now.cycle, share, row, limits)
    now = _with_witness(replace(now, cycle=found), share, row, repaired_s, config)
    ended = before is not None and before.cycle.loud and not found.loud
    done = cycle.remedy_with_night(RemedyBelief() if ended else now.remedy, share, row, limits)
    size, share_pct = float(row["oscillation_significance"] or 0.0), float(row["oscillating_pct"])
    sizes = row["period_s"], row["pv_amplitude_pct"], row["average_absolute_error_pct"]
    seen = NightFigures(row["night"], size, share_pct, *sizes)
    phases = with_repetitions(now.phases, row, REPETITIONS)
    now = replace(now, night=row["night"], end_s=_span(row)[1], remedy=done, last=seen, phases=phases)
    return replace(now, kp=row["kp"], ti=row["ti"], told=night_decision(now, row, limits))


def _with_constants(now: Belief, row: Row, limits: BeliefLimits) -> Belief:
    """The belief with the constants of an experiment, from a night without other results."""
    share = valve.faded_over(now.night, row["night"], limits) if now.night else 1.0
    constants = {k: pool.faded(share) for k, pool in now.constants.items()}
    evidence = evidence_of(row) or {}
    for name in (name for name in CONSTANTS if name in evidence):
        value, deviation = evidence[name]
        pool = constants.get(name, Pool())
        constants[name] = pool.plus(value, deviation, LEAST_DEVIATION, MOST_DEVIATION)
    return replace(now, constants=constants)


def _span(row: Row) -> tuple[float, float]:
    """Start and end of a night's record [s since 1970-01-01 UTC]."""
    start_s = row["start_s"] or 0.0
    return start_s, start_s + (row["duration_s"] or 0.0)


def _after_recorder_change(now: Belief, row: Row, limits: BeliefLimits) -> Belief:
    """The belief without sizes and constants, which depend on the recorder, if another recorder or compression is in
    use; the valve is the same."""
    then, straight = now.straight_pct, row["straight_pct"]
    now = replace(now, straight_pct=straight)
    if then is None or straight is None or abs(straight - then) <= limits.recorder:
        return now
    same, seen = replace(now.cycle, usual=None, off=0), valve.after_recorder_change(now.valve)
    return replace(now, cycle=same, valve=seen, constants={}, widths=(), recorder=row["night"])


def _after_changes(now: Belief, row: Row, repaired_s: Sequence[float]) -> Belief:
    """The belief without the parts ended by a change of settings, stated or detected in OP, or by a repair since the
    previous night."""
    settings, fresh = (row["kp"], row["ti"]), CycleBelief(top=now.cycle.top, loud=now.cycle.loud)
    phases = forgotten(now.phases)
    reset = replace(now, cycle=fresh, remedy=RemedyBelief(), before=now.last, phases=phases)
    listed = now.remedy.action is Action.CHECK_SETTINGS
    if now.night and None not in (now.kp, *settings) and (now.kp, now.ti) != settings:
        # a corrected loops.csv changes no loop
        now = replace(now, remedy=RemedyBelief()) if listed else reset
    elif now.night and not listed and row["action"] == Action.CHECK_SETTINGS:
        now = reset
    if any(now.end_s < at <= _span(row)[1] for at in repaired_s) and now.night:
        kept = {k: v for k, v in now.constants.items() if k not in OF_VALVE}
        now = replace(now, valve=ValveBelief(), constants=kept, widths=(), cycle=fresh, remedy=RemedyBelief())
    return now


def _with_witness(now: Belief, share: float, row: Row, repaired_s: Sequence[float], config: Config) -> Belief:
    """The belief about valve and process updated with a night; unchanged if the night gives no result, or if the
    valve was repaired during it."""
    start_s, end_s = _span(row)
    mixed = any(start_s < at < end_s for at in repaired_s)
    constants = {k: pool.faded(share) for k, pool in now.constants.items()}
    evidence, limits = None if mixed else evidence_of(row), config.belief
    if evidence is None:
        return replace(now, constants=constants)
    wrong = valve.doubt(evidence, now.cycle.cause, counts(row["oscillating_pct"]), config)
    found = valve.valve_with_night(now.valve, share, row["night"], evidence, wrong, limits)
    another = found.since != now.valve.since
    if another:
        constants = {k: pool for k, pool in constants.items() if k not in OF_VALVE}
    widths = () if another and found.width < now.valve.width else now.widths
    if "width" in evidence:
        widths = (*widths, (row["night"], *evidence["width"]))[-REMEMBERED:]
    for name in CONSTANTS:
        if name in evidence:
            pool, (value, deviation) = constants.get(name, Pool()), evidence[name]
            constants[name] = pool.plus(value, deviation, LEAST_DEVIATION, MOST_DEVIATION)
    certain = ("" if another else now.valve.certain) or row["night"] if found.is_worn(limits) else ""
    return replace(now, valve=replace(found, certain=certain), constants=constants, widths=widths)


def evidence_of(row: Row) -> Witness | None:
    """Results of a night on valve and process; for a night of an earlier version from the fault in its row."""
    if row["witness"]:
        return json.loads(row["witness"])  # type: ignore[no-any-return]
    width, evidence = row["backlash_pct"] or row["stickband_pct"], row["evidence"]
    if not width or not evidence or width > WIDTHS[-1]:
        return None
    profile = [0.0] * WIDTHS.size
    profile[int(np.argmin(np.abs(np.log(WIDTHS / width))))] = evidence
    jump = [0.0, 0.0] if row["backlash_pct"] else [1.0, 0.0]
    return {"profile": profile, "needed": NEEDED, "op_range": width, "jump": jump, "width": [width, EARLIER]}


def night_decision(now: Belief, row: Row, limits: BeliefLimits) -> NightDecision:
    """The decision on a loop in a night, from the belief including that night."""
    own = _own(row)
    alone = now.cycle.nights == 1 and now.valve.nights <= 1
    cycles = counts(row["oscillating_pct"])
    dead = own.cause is Cause.VALVE and own.fault is Fault.UNDECIDED and not cycles
    decision = own if alone or dead else (_of_cycle if cycles else _of_calm)(now, own, limits)
    if cycles and decision.cause is Cause.VALVE and now.is_calmed(limits):
        decision = _without_new_settings(decision)
    return replace(decision, own=GIST(decision) == GIST(own))


def _without_new_settings(decision: NightDecision) -> NightDecision:
    """Decision for a loop with a worn valve whose cycle became much smaller after a change of settings. It
    has no further settings; the repair is due at the next shutdown."""
    if not action.is_urgent(decision.action, decision.due):
        return decision
    return replace(decision, action=Action.REPAIR_VALVE, due=Due.SHUTDOWN, pair=None, calmed=True)


def _own(row: Row) -> NightDecision:
    """The decision by a night alone."""
    confidence = {c: row[f"osc_{c}_pct"] for c in CAUSES if row[f"osc_{c}_pct"] is not None}
    advised, due = Action(row["action"]) if row["action"] else None, Due(row["due"]) if row["due"] else None
    cause, fault, source = Cause(row["cause"]), Fault(row["valve_fault"]), row["source_loop"]
    return NightDecision(cause, confidence, fault, source, advised, due, cycle.advised_pair(row))


def _of_calm(now: Belief, own: NightDecision, limits: BeliefLimits) -> NightDecision:
    """Decision for a loop that did not oscillate in the night: a worn valve, or nothing."""
    if now.valve.is_worn(limits):
        fault = now.valve.fault(now.told.fault)
        confidence = {**own.confidence, Cause.VALVE: now.valve.worn_pct(limits)}
        if own.action in action.FIRST:
            return NightDecision(Cause.VALVE, confidence, fault, None, own.action)
        due = own.due or Due.SHUTDOWN  # a slave that moves its master cannot wait
        return NightDecision(Cause.VALVE, confidence, fault, None, Action.REPAIR_VALVE, due)
    if own.cause is not Cause.VALVE:
        return own
    remaining_action = Action.NONE if own.action is Action.REPAIR_VALVE else own.action
    return NightDecision(Cause.NONE, own.confidence, Fault.NONE, None, remaining_action)


def _of_cycle(now: Belief, own: NightDecision, limits: BeliefLimits) -> NightDecision:
    """Decision for a loop that oscillated: its source, otherwise the cause by all nights, and the valve."""
    source, worn = now.cycle.source, now.valve.is_worn(limits)
    if source is not None:
        if own.source is not None:
            return own
        return NightDecision(
            Cause.LOAD, now.cycle.chances(limits.between), Fault.NONE, source, Action.SEE_SOURCE_LOOP
        )
    cause, confidence = now.cycle.cause, now.cycle.chances(limits.between)
    if cause is Cause.VALVE and not worn:
        cause = Cause.UNDECIDED
    surely = now.valve.worn_pct(limits) >= limits.other_cause_pct
    fault = now.valve.fault(now.told.fault) if worn and (cause is Cause.VALVE or surely) else Fault.NONE
    if cause is Cause.UNDECIDED and fault is Fault.NONE:
        fault = own.fault if own.fault is Fault.UNDECIDED else Fault.NONE
    decision = NightDecision(cause, confidence, fault)
    return _with_remedy(now, own, decision)


def _with_remedy(now: Belief, own: NightDecision, decision: NightDecision) -> NightDecision:
    """Action for a cycle with a cause."""
    worn, done = decision.fault in (Fault.BACKLASH, Fault.STICTION), now.remedy
    voted = None if done.action is Action.RETUNE and done.held is None else done.action
    alone = own.cause, own.action, own.due
    chosen, due = action.of_nights(decision.cause, worn, alone, voted, action.of_votes(done.votes))
    return replace(decision, action=chosen, due=due, pair=done.held if chosen is Action.RETUNE else None)
