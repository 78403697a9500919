"""The belief in one loop: a step from what was believed the night before, and what is told of it.

A settings change begins the cycle's part anew, for it is the settings that make cycle and advice; a repair begins the
valve's. What is told contradicts no sure sign of the night itself: a loop that did not oscillate has no cause but a
worn valve.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import repeat
from operator import attrgetter
from types import UnionType
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

NEEDED, EARLIER = 10.0, 0.1
"""Evidence needed [nat], and standard deviation of a width's logarithm, of nights that earlier versions kept."""
CONSTANTS = ("slope", "time_constant_s", "gain", "dead_time_s", "width", "slip_jump")
"""Constants that nights pool."""
OF_VALVE = ("width", "slip_jump")
"""Those of them that a repair changes."""
GIST = attrgetter("cause", "fault", "action", "source")
"""What makes a difference between what two tell."""


@dataclass(frozen=True, slots=True)
class NightDecision:
    """What is told of a loop in a night: cause and confidence [%] of each, fault of the valve, the loop that it
    follows, what to do and by when, the pair of settings, and whether that is other than what the night says by
    itself."""

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
class Calm:
    """What a loop did in its last night under some settings: significance [% h], share [%] and period [s] of its
    oscillation, amplitude of PV and average absolute error [% of span]."""

    night: str
    significance: float
    oscillating_pct: float
    period_s: float | None
    amplitude_pct: float | None = None
    error_pct: float | None = None


@dataclass(frozen=True, slots=True)
class Belief:
    """What is believed of a loop after a night.

    night, the last that counted; end_s, when its record ended; kp, ti, the settings in force; before, what the
    loop did under those before; straight_pct, how much of its PV was on straight segments [%], and recorder, the
    first night that was recorded so, '' where all were; phases of its programme."""

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
    before: Calm | None = None
    last: Calm | None = None
    told: NightDecision = field(default_factory=NightDecision)
    straight_pct: float | None = None
    recorder: str = ""
    phases: tuple[PhaseKnown, ...] = ()

    def is_calmed(self, limits: BeliefLimits) -> bool:
        """Whether the last change of settings took most of a cycle away."""
        then, now = self.before, self.last
        if then is None or now is None or not counts(then.oscillating_pct):
            return False
        return now.significance <= limits.calmed * then.significance


_types: Callable[[Any], dict[str, Any]] = cache(get_type_hints)


def kept_as(belief: Belief) -> str:
    """A belief as the store keeps it (JSON): what the belief of the next night goes on from."""
    return json.dumps(belief, separators=(",", ":"), default=_as_fields)


def _as_fields(value: Any) -> dict[str, Any]:
    return {name: getattr(value, name) for name in _types(type(value))}


def belief_of(text: str) -> Belief:
    """A belief as the store kept it; KeyError, TypeError or ValueError where another version wrote it."""
    return _read_as(Belief, {"phases": []} | json.loads(text))  # type: ignore[no-any-return]


def _read_as(kind: Any, kept: Any) -> Any:
    """What JSON kept of a value, as a value of its declared type again."""
    if kind in (float, int, str, bool):
        return kept
    if hasattr(kind, "__dataclass_fields__"):
        return kind(**{name: _read_as(of, kept[name]) for name, of in _types(kind).items()})
    origin, of = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return None if kept is None else _read_as(of[0], kept)
    if origin is tuple:
        return tuple(map(_read_as, repeat(of[0]) if of[-1] is ... else of, kept))
    if origin is None:
        return kind(kept)
    return {_read_as(of[0], k): _read_as(of[1], v) for k, v in kept.items()}


def step(before: Belief | None, row: Row, repaired_s: Sequence[float], config: Config) -> Belief | None:
    """The belief after a night: as it was where the night tells nothing, None where no night has told anything.

    before : that of the night before, None where there is none; row : the loop's of the night; repaired_s : when
    notes say that its valve was repaired [s since 1970-01-01 UTC].
    """
    if row["status"] == Status.OK and row["oscillating_pct"] is None and row.get("experiment"):
        return _with_constants(before or Belief(row["loop"], ""), row, config.belief)
    if row["status"] != Status.OK or row["oscillating_pct"] is None:
        return before
    now, limits = before or Belief(row["loop"], ""), config.belief
    share = valve.faded_over(now.night, row["night"], limits) if now.night else 1.0
    now = _recorded_anew(_after_changes(now, row, repaired_s), row, limits)
    found = cycle.cycle_with_night(now.cycle, share, row, limits)
    now = _with_witness(replace(now, cycle=found), share, row, repaired_s, config)
    ended = before is not None and before.cycle.loud and not found.loud
    done = cycle.remedy_with_night(RemedyBelief() if ended else now.remedy, share, row, limits)
    size, share_pct = float(row["oscillation_significance"] or 0.0), float(row["oscillating_pct"])
    sizes = row["period_s"], row["pv_amplitude_pct"], row["average_absolute_error_pct"]
    seen = Calm(row["night"], size, share_pct, *sizes)
    phases = with_repetitions(now.phases, row, limits.repetitions)
    now = replace(now, night=row["night"], end_s=_span(row)[1], remedy=done, last=seen, phases=phases)
    return replace(now, kp=row["kp"], ti=row["ti"], told=tell(now, row, limits))


def _with_constants(now: Belief, row: Row, limits: BeliefLimits) -> Belief:
    """The belief with the constants of an experiment, in a night that tells nothing else: not that it was one."""
    share = valve.faded_over(now.night, row["night"], limits) if now.night else 1.0
    constants = {k: pool.faded(share) for k, pool in now.constants.items()}
    said = said_of(row) or {}
    for name in set(CONSTANTS) & said.keys():
        value, deviation = said[name]
        pool = constants.get(name, Pool())
        constants[name] = pool.plus(value, deviation, limits.least_deviation, limits.most_deviation)
    return replace(now, constants=constants)


def _span(row: Row) -> tuple[float, float]:
    """When a night's record began and ended [s since 1970-01-01 UTC]."""
    start_s = row["start_s"] or 0.0
    return start_s, start_s + (row["duration_s"] or 0.0)


def _recorded_anew(now: Belief, row: Row, limits: BeliefLimits) -> Belief:
    """The belief with what only one recorder shows begun anew, where another one, or its compression, is at work:
    sizes and constants; the valve is the same."""
    then, straight = now.straight_pct, row["straight_pct"]
    now = replace(now, straight_pct=straight)
    if then is None or straight is None or abs(straight - then) <= limits.recorder:
        return now
    same, seen = replace(now.cycle, usual=None, off=0), valve.recorded_otherwise(now.valve)
    return replace(now, cycle=same, valve=seen, constants={}, widths=(), recorder=row["night"])


def _after_changes(now: Belief, row: Row, repaired_s: Sequence[float]) -> Belief:
    """The belief with what a change of settings, stated or seen in OP, or a repair since the night before has ended
    begun anew."""
    settings, fresh = (row["kp"], row["ti"]), CycleBelief(top=now.cycle.top, loud=now.cycle.loud)
    phases = forgotten(now.phases)
    anew = replace(now, cycle=fresh, remedy=RemedyBelief(), before=now.last, phases=phases)
    listed = now.remedy.action is Action.CHECK_SETTINGS
    if now.night and None not in (now.kp, *settings) and (now.kp, now.ti) != settings:
        # a list that is put right changes no loop
        now = replace(now, remedy=RemedyBelief()) if listed else anew
    elif now.night and not listed and row["action"] == Action.CHECK_SETTINGS:
        now = anew
    if any(now.end_s < at <= _span(row)[1] for at in repaired_s) and now.night:
        kept = {k: v for k, v in now.constants.items() if k not in OF_VALVE}
        now = replace(now, valve=ValveBelief(), constants=kept, widths=(), cycle=fresh, remedy=RemedyBelief())
    return now


def _with_witness(now: Belief, share: float, row: Row, repaired_s: Sequence[float], config: Config) -> Belief:
    """The belief in valve and process with what a night says of them; nothing where it says nothing, or where the
    valve was repaired within it."""
    start_s, end_s = _span(row)
    mixed = any(start_s < at < end_s for at in repaired_s)
    constants = {k: pool.faded(share) for k, pool in now.constants.items()}
    said, limits = None if mixed else said_of(row), config.belief
    if said is None:
        return replace(now, constants=constants)
    wrong = valve.doubt(said, now.cycle.cause, counts(row["oscillating_pct"]), config)
    found = valve.valve_with_night(now.valve, share, row["night"], said, wrong, limits)
    another = found.since != now.valve.since
    if another:
        constants = {k: pool for k, pool in constants.items() if k not in OF_VALVE}
    widths = () if another and found.width < now.valve.width else now.widths
    if "width" in said:
        widths = (*widths, (row["night"], *said["width"]))[-limits.remembered :]
    for name in CONSTANTS:
        if name in said:
            pool, (value, deviation) = constants.get(name, Pool()), said[name]
            constants[name] = pool.plus(value, deviation, limits.least_deviation, limits.most_deviation)
    certain = ("" if another else now.valve.certain) or row["night"] if found.is_worn(limits) else ""
    return replace(now, valve=replace(found, certain=certain), constants=constants, widths=widths)


def said_of(row: Row) -> Witness | None:
    """What a night says of valve and process; of one that an earlier version kept, what its row tells of a fault."""
    if row["witness"]:
        return json.loads(row["witness"])  # type: ignore[no-any-return]
    width, evidence = row["backlash_pct"] or row["stickband_pct"], row["evidence"]
    if not width or not evidence or width > WIDTHS[-1]:
        return None
    profile = [0.0] * WIDTHS.size
    profile[int(np.argmin(np.abs(np.log(WIDTHS / width))))] = evidence
    jump = [0.0, 0.0] if row["backlash_pct"] else [1.0, 0.0]
    return {"profile": profile, "needed": NEEDED, "op_range": width, "jump": jump, "width": [width, EARLIER]}


def tell(now: Belief, row: Row, limits: BeliefLimits) -> NightDecision:
    """What is told of a loop in a night, by what is believed of it with that night."""
    own = _own(row)
    alone = now.cycle.nights == 1 and now.valve.nights <= 1
    cycles = counts(row["oscillating_pct"])
    dead = own.cause is Cause.VALVE and own.fault is Fault.UNDECIDED and not cycles
    told = own if alone or dead else (_of_cycle if cycles else _of_calm)(now, own, limits)
    if cycles and told.cause is Cause.VALVE and now.is_calmed(limits):
        told = _left_alone(told)
    return replace(told, own=GIST(told) == GIST(own))


def _left_alone(told: NightDecision) -> NightDecision:
    """Of a loop whose worn valve makes far less of a cycle since its settings were changed: no further settings, and
    the repair at the next shutdown."""
    if not action.is_urgent(told.action, told.due):
        return told
    return replace(told, action=Action.REPAIR_VALVE, due=Due.SHUTDOWN, pair=None, calmed=True)


def _own(row: Row) -> NightDecision:
    """What a night says by itself."""
    confidence = {c: row[f"osc_{c}_pct"] for c in CAUSES if row[f"osc_{c}_pct"] is not None}
    advised, due = Action(row["action"]) if row["action"] else None, Due(row["due"]) if row["due"] else None
    cause, fault, source = Cause(row["cause"]), Fault(row["valve_fault"]), row["source_loop"]
    return NightDecision(cause, confidence, fault, source, advised, due, cycle.advised_pair(row))


def _of_calm(now: Belief, own: NightDecision, limits: BeliefLimits) -> NightDecision:
    """Of a loop that did not oscillate in the night: a worn valve, or nothing."""
    if now.valve.is_worn(limits):
        fault = now.valve.fault(now.told.fault)
        confidence = {**own.confidence, Cause.VALVE: now.valve.worn_pct(limits)}
        if own.action in action.FIRST:
            return NightDecision(Cause.VALVE, confidence, fault, None, own.action)
        due = own.due or Due.SHUTDOWN  # a slave that moves its master cannot wait
        return NightDecision(Cause.VALVE, confidence, fault, None, Action.REPAIR_VALVE, due)
    if own.cause is not Cause.VALVE:
        return own
    left = Action.NONE if own.action is Action.REPAIR_VALVE else own.action
    return NightDecision(Cause.NONE, own.confidence, Fault.NONE, None, left)


def _of_cycle(now: Belief, own: NightDecision, limits: BeliefLimits) -> NightDecision:
    """Of a loop that oscillated in the night: its source, else the cause that the nights name, and the valve."""
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
    surely = now.valve.worn_pct(limits) >= limits.beside_pct
    fault = now.valve.fault(now.told.fault) if worn and (cause is Cause.VALVE or surely) else Fault.NONE
    if cause is Cause.UNDECIDED and fault is Fault.NONE:
        fault = own.fault if own.fault is Fault.UNDECIDED else Fault.NONE
    told = NightDecision(cause, confidence, fault)
    return _with_remedy(now, own, told)


def _with_remedy(now: Belief, own: NightDecision, told: NightDecision) -> NightDecision:
    """What to do about a cycle of a cause."""
    worn, done = told.fault in (Fault.BACKLASH, Fault.STICTION), now.remedy
    voted = None if done.action is Action.RETUNE and done.held is None else done.action
    alone = own.cause, own.action, own.due
    chosen, due = action.of_nights(told.cause, worn, alone, voted, action.of_votes(done.votes))
    return replace(told, action=chosen, due=due, pair=done.held if chosen is Action.RETUNE else None)
