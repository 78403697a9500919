"""Texts on a finding: the reason in a loop's row, with the finding and its evidence, most important first, and each
sign of its cause, in words for everybody and figures for an expert.

Lists and pages show the first clauses of a reason as a sentence (`in_short`); the others are evidence and are folded.
The sentences of signs are in texts.toml; this module chooses one by a sign's figures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from analyzer.lanes.lanes import LANE_TEXTS
from analyzer.loop.decisions import (
    Action,
    Cause,
    Due,
    Finding,
    Lane,
    MissingData,
    Sign,
    SignKind,
    Status,
)
from analyzer.words import sentences
from analyzer.words.units import duration

REASON_WORDS = 20  # Largest number of words of a reason in lists [words]
STROKE_STEPS = 4.0
"""Steps of a stroke test over the width of the fault: the first three must then move nothing."""

MOST_NAMES = 5
"""Maximum number of followers listed in a row."""
MOST_AMPLIFIED = 10.0
"""Amplification above which the number is not reported; ours: a model bent by its load reported 35 times for a loop
that amplified by 0.55."""
ACTIONS_AT_ONCE = (Action.CHECK_SETTINGS, Action.NEEDS_DATA)
"""Actions whose words are in the list."""
SignText = tuple[str, str]
"""Words for everybody, and figures for an expert, '' if the words contain them."""
Chosen = tuple[Any, ...]
"""A sentence of texts.toml by its name, and its figures."""


def in_short(text: str) -> tuple[str, str]:
    """The first clauses of a reason, as many as make a short sentence (at least one), and the others."""
    clauses = text.split("; ")
    words = [len(clause.split()) for clause in clauses]
    kept = max([n for n in range(1, len(clauses) + 1) if sum(words[:n]) <= REASON_WORDS], default=1)
    return "; ".join(clauses[:kept]), "; ".join(clauses[kept:])


def reason(found: Finding) -> str:
    """The finding and its evidence, additions by the lanes, and the time since which it is reported."""
    known = (
        {Lane.MANUAL} if found.lack is MissingData.AUTOMATIC else set()
    )  # the missing data have been reported already
    clauses = [LANE_TEXTS[lane](found) for lane in found.lanes if lane in LANE_TEXTS and lane not in known]
    text = joined(_whole(found), *clauses)
    changed = found.text("settings_changed")
    if not changed:
        return text
    clock = changed.split()[-1]
    late = "too late in the night to judge" if found.known.get("judged_since_s") is None else None
    return joined(f"{'before' if late else 'since'} {clock} (new settings): {text}", changed, late)


def _whole(found: Finding) -> str:
    """The finding on the loop, and its relation to others."""
    lacking = str(found.lacking or "")
    if found.status is not Status.OK:
        return lacking
    if found.follows is not None:
        root = found.follows
        sure = f"fix that loop first (it starts there with {root.confidence_pct:.0f} %)"
        return f"{cycle_text(found)}: follows {root.loop}{later(root.lag_s)}; {sure}"
    experiment = found.text("experiment")
    if found.swing is None:
        if experiment:
            return joined(
                experiment, found.remedy.text, f"nothing else is reported: {lacking}" if lacking else None
            )
        return f"not assessed: {found.remedy.text or lacking}"
    names = ", ".join(found.moves[:MOST_NAMES]) + (" ..." if len(found.moves) > MOST_NAMES else "")
    moves = f"it also moves {names}: fix this one first" if names else None
    unusual = found.remedy.action is Action.RETUNE and found.cause in (Cause.LOAD, Cause.UNDECIDED)
    at_once = unusual or found.remedy.action in ACTIONS_AT_ONCE or found.lack is MissingData.OP_RANGE
    more = found.remedy.text if at_once and found.remedy.text != lacking else None
    first, *others = _cause(found).split("; ")
    worn = valve_text(found) if found.cause is not Cause.VALVE and found.fault in sentences("width") else None
    return joined(first, worn, moves, more, to_stroke(found), experiment, *others)


def _cause(found: Finding) -> str:
    """Whether the loop cycles, and the cause, with the figures at the end."""
    cycle = cycle_text(found)
    if found.cause is Cause.VALVE:
        return f"{cycle}: {valve_text(found)}"
    if found.cause is Cause.TUNING:
        return f"{cycle}: tuned too tight; {_strongest(found, 1, SignKind.RINGING, SignKind.AMPLIFICATION)}"
    if found.cause is Cause.LOAD:
        first = SignKind.KEPT_PHASE, SignKind.PERIODIC_LOAD, SignKind.REGULARITY
        return f"{cycle}: external disturbance; {_strongest(found, 1, *first)}"
    if found.cause is Cause.UNDECIDED:
        return f"{cycle}; cause undecided: {found.lacking or 'no cause explains the cycle better than the others'}"
    return cycle


def cycle_text(found: Finding) -> str:
    """Whether the loop cycles, and the share of the time if it is too small to count."""
    swing = found.swing
    if swing is None or not swing.oscillating_pct or not swing.period_s:
        return f"moves with {found.moves[0]}" if found.moves else "does not oscillate"
    cycle = f"cycles every {duration(swing.period_s)}"
    return cycle if found.oscillates else f"{cycle}, for {swing.oscillating_pct:.0f} % of the time"


def to_stroke(found: Finding) -> str:
    """The test for a valve's fault; '' if its width is unknown or the action is another."""
    width = found.width_pct
    if found.remedy.action is not Action.REPAIR_VALVE or width is None:
        return ""
    return sentences("by_hand")[found.remedy.due or Due.NOW].format(step=width / STROKE_STEPS)


def valve_text(found: Finding) -> str:
    """The fault of the valve, in figures if there are any."""
    size, width, fault = found.known.get("valve_size"), found.width_pct, found.fault
    if fault not in sentences("width") or not isinstance(size, float):
        return f"the valve is at fault; {_strongest(found, 2)}"
    if width is None:
        return sentences("share")[fault].format(share=100 * size)
    return f"{sentences('width')[fault].format(width=width)}; its width is {100 * size:.0f} % of OP's range"


def _strongest(found: Finding, most: int, *first: SignKind) -> str:
    """The strongest signs of the cause, with some kinds before all others."""
    signs = [s for s in found.signs if s.points_to is found.cause]
    order = sorted(signs, key=lambda s: (s.kind not in first, -s.strength))
    return "; ".join(sign_text(s) for s in order[:most])


def below_first(below: Finding, tie: str = "master") -> str:
    """Why a master has no advice of its own."""
    sign = Sign(Cause.LOAD, 1.0, SignKind.OF_BELOW, (below.loop, below.cause, tie))
    return f"{sign_text(sign)}: repair that first, then look again."


def joined(*clauses: str | None) -> str:
    """Clauses joined by semicolons, without empty ones; a full stop at the end of a clause is removed."""
    texts = ((clause or "").strip() for clause in clauses)
    kept = (text if text[-2:] == ".." else text.removesuffix(".").strip() for text in texts)
    return "; ".join(filter(None, kept))


def sign_parts(sign: Sign) -> SignText:
    """A sign in words and figures."""
    which, *figures = SIGN_TEXTS[sign.kind](*sign.figures)
    text, figures_text = sentences("signs")[which], sentences("figures_of_signs").get(which, "")
    return text.format(*figures), figures_text.format(*figures)


def sign_text(sign: Sign) -> str:
    """A sign in words only."""
    return sign_parts(sign)[0]


def sign_in_full(sign: Sign) -> str:
    """Words and figures in one."""
    text, figures = sign_parts(sign)
    return f"{text} ({figures})" if figures else text


def as_stored(sign: Sign) -> dict[str, Any]:
    """A sign as stored; only those of a cycle have a name."""
    text, figures = sign_parts(sign)
    name = "" if sign.kind in UNNAMED else sign.kind
    stored = {"points_to": sign.points_to, "strength": sign.strength}
    return stored | {"text": text, "name": name, "figures": figures}


def _evidence(nat: float, agreeing: float = 0.0, count: int | None = None) -> Chosen:
    """Text on how much better a faulty valve explains PV than an ideal one."""
    if nat <= 0:
        return ("no_evidence",)
    return "evidence" if count is None else "evidence_in_stretches", nat, 100 * agreeing, count


def _amplification(*known: float) -> Chosen:
    if not known:
        return ("unstable",)
    (s,) = known
    return ("amplifies_much", MOST_AMPLIFIED) if s > MOST_AMPLIFIED else ("amplifies", s)


def _regularity(kurtosis: float, third: float, size: float) -> Chosen:
    rhythm = third >= 0.5
    if bool(size) == rhythm:
        how = f"{'keeps' if size else 'changes'} its size and its rhythm"
    else:
        how = "keeps its size and changes its rhythm" if size else "keeps its rhythm and changes its size"
    return "regularity", kurtosis, third, how


def later(lag_s: float | None) -> str:
    """Text on the lag of a loop behind the one that it follows."""
    return f" {duration(abs(lag_s))} later" if lag_s is not None and lag_s > 0 else ""


def _of_below(loop: str, cause: str | None, tie: str) -> Chosen:
    """Text on the loop to which a loop's output is linked: it has a fault, or responds like a faulty valve."""
    own = cause if cause in (Cause.VALVE, Cause.TUNING) else "no"
    return f"below_of_{own}_fault", "moves" if tie == "split" else "is the set point of", loop


SIGN_TEXTS: Mapping[SignKind, Callable[..., Chosen]] = {
    SignKind.EVIDENCE: _evidence,
    SignKind.WIDTH: lambda size: ("width", 100 * size),
    SignKind.AMPLIFICATION: _amplification,
    SignKind.REGULARITY: _regularity,
    SignKind.RINGING: lambda ms, period_s: (
        ("ringing_unstable",) if math.isinf(ms) else ("ringing", duration(period_s), ms)
    ),
    SignKind.SMOOTH_LOAD: lambda nat: ("smooth_load", nat),
    SignKind.PERIODIC_LOAD: lambda nat, kept: ("periodic_load", nat, kept),
    SignKind.KEPT_PHASE: lambda share, periods: ("kept_phase", share, periods),
    SignKind.LIKELIER: lambda cause, nat: (f"likelier_{cause}", nat),
    SignKind.CALM_EVIDENCE: _evidence,
    SignKind.CALM_WIDTH: lambda size: ("calm_width", 100 * size),
    SignKind.AGAIN: lambda: ("again",),
    SignKind.DEAD_VALVE: lambda wound: ("dead_valve", wound),
    SignKind.FOLLOWS: lambda loop, lag_s, coherence: ("follows", loop, later(lag_s), coherence),
    SignKind.OF_BELOW: _of_below,
    SignKind.OF_ABOVE: lambda loop, tie: (f"above_by_{tie}", loop),
}
"""The sentence for a sign, by its figures, and the values inserted in it."""
UNNAMED = (
    *(SignKind.CALM_EVIDENCE, SignKind.CALM_WIDTH, SignKind.AGAIN, SignKind.DEAD_VALVE),
    *(SignKind.FOLLOWS, SignKind.OF_BELOW, SignKind.OF_ABOVE),
)
"""Signs without a named measure."""
