"""The words of an explanation: a sentence per name that a shift supervisor reads, and what tells names apart."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.explanation import Explanation, is_stack
from identification.mismatch.outside import OUTSIDE, about

if TYPE_CHECKING:
    from identification.mismatch.answer import Answer, EffectFound

NOTHING_LEFT = "The plain loop explains the recording; nothing is left that the data could name."
NO_NAME = "Something is left that no effect of the catalogue explains."
BETTER = "No cause that the catalogue names explains the loop as well as one that it does not name"
"""How physics of no name is told."""
CHECKS = {
    "none": "Nothing has to be done about the model.",
    "unexplained": "Give it a recording with moves of the set point, or say what else acts on this loop.",
}
"""What to look at where no effect is named."""
STRAYS = (
    "Simulated with one constant friction PV strays all the same, as it does where friction differs from slip to "
    "slip: the stretches are the proof, not the misfit."
)
"""What is said of a valve that the cycles show and a simulation with constant friction does not."""
ONE_MOVE_ONLY = "rests on one move of OP, of which nothing is left to prove it on; another recording would"
"""What a recording of one experiment lacks."""
WANDERS = "does not tell whether the gain wanders too, or a load alone is added"
"""Caution of a supply whose part in the gain an experiment does not show."""
STACKED = (
    "The loop does something that no known cause explains: only {names}, stacked on each other, come near it, and "
    "one cause is likelier than three."
)
"""Why a stack of effects is no name."""
INSENSITIVE = "needs moves of OP that PV answers; without OP the fit is as good"
"""What is said where PV does not answer OP."""
REFUTED = (
    "What explains {seen} ({names}) does not carry over to {rest}, so nothing is told as found: another recording of "
    "this loop is needed."
)
OVER_OTHERS, OVER_REST = ("the recording", "the other recordings"), ("its first part", "the rest")
"""Why effects that explain one part and not another are not told."""
LEFT_OVER = (
    "The loop does something that no known cause explains: {by} foretells on data held out what is left "
    "(log likelihood +{nats:.0f})."
)
LEFT_BY = {
    "past": "what OP did long before",
    "size": "the size of OP's moves",
    "level": "the level of PV",
    "switch": "a switch in the flow, on at one level and off at another,",
    "history": "where PV has been and how far the valve has travelled",
    "direction": "the direction and speed of the moves",
    "sensor": "whether PV stands, and the size of its moves,",
    "clock": "a clock, whose wave is no sine,",
}
"""How the ways of the reference are called."""
LONGER = "A step of OP each way in manual, held for five time constants, at two operating points."
"""What tells apart what has no line of its own."""
MINUTES_S, MINUTES_OF_RECORD_S, HOURS_S = 600.0, 120.0, 7200.0
"""Times from which minutes are spoken of, of a parameter and of a record, and hours [s]; ours."""


def check(data: Mapping[str, Any]) -> str:
    """What to look at, by an answer as data: its verdict, and what of no name explains the loop; nothing where the
    recording cannot be explained at all, for the reason says then what it needs."""
    verdict = data["verdict"]
    if not data.get("fit", True):
        return ""
    if "outside" in data:
        return OUTSIDE[data["outside"]["name"]].check
    return EFFECTS[verdict].check if verdict in EFFECTS else CHECKS.get(verdict, CHECKS["unexplained"])


def discriminating_test(one: str, other: str) -> str:
    """Which experiment or signal would tell two names of the catalogue apart."""
    for a, b in ((one, other), (other, one)):
        if a in EFFECTS and b in EFFECTS[a].tests:
            return EFFECTS[a].tests[b]
    return LONGER


def two_plain_loops(fit: Mapping[str, Any]) -> str:
    """That the plain loop which simulates best is another than the one that foretells best; empty where it is not."""
    loops = fit.get("plain_loops")
    if not loops:
        return ""
    drawn, ahead = (
        f"gain {x['gain']:.3g}, time constant {_number(x['time_constant_s'], 's')}"
        for x in (loops["simulated"], loops["one_step_ahead"])
    )
    return (
        f"Two plain loops: one simulates best ({drawn}) and is drawn, another foretells the next sample best "
        f"({ahead}). A load that a controller answers biases the first, a slow load the second: figures of the "
        "process are rough until OP is stepped in manual."
    )


def seen_ahead(fit: Mapping[str, Any]) -> str:
    """That what was found shows one step ahead and not in a simulation; empty where it shows in both."""
    if fit.get("ahead_nat") is None:
        return ""
    return (
        "What was found shows from one sample to the next on data it was not fitted to; simulated, a plain loop of "
        "other constants leaves as little, for the load hides in OP."
    )


def note(found: Explanation) -> str:
    """Why there is no name, or no name alone; empty where there is nothing to say."""
    if found.refuted and not found.accepted:
        seen, rest = OVER_OTHERS if found.others else OVER_REST
        return REFUTED.format(seen=seen, rest=rest, names=" and ".join(found.refuted))
    if found.left <= 0:
        stacked = " and ".join(c.name for c in found.accepted)
        return STACKED.format(names=stacked) if is_stack(found) else ""
    if found.outside is not None:
        return ""
    if not found.left_by:
        return NO_NAME
    return LEFT_OVER.format(nats=found.left, by=LEFT_BY[found.left_by])


def cycles_told(found: Explanation) -> str:
    """What the cycles show of a faulty valve, in a sentence."""
    seen = found.cycles
    assert seen is not None
    between = "turns of OP" if seen.cycling else "moves of the stem"
    text = (
        f"In {100 * seen.agreeing:.0f} % of {seen.stretches} stretches between {between}, PV goes as behind this "
        "valve and not as behind a free one."
    )
    return text if found.proven.carries else f"{text} {STRAYS}"


def too_short_told(enough: float, length_s: float, lag_s: float) -> str:
    """What is needed where the record is short against the time constant."""
    length, lag = (_time(x, MINUTES_OF_RECORD_S) for x in (length_s, lag_s))
    needs = f"needs {enough:.0f} time constants, has {length_s / lag_s:.2g}"
    return f"{needs} (a record of {length}, a time constant of about {lag})"


def sentence(said: Answer) -> str:
    """One sentence for the verdict, with the numbers that it needs."""
    if not said.effects:
        return NOTHING_LEFT
    others = [e.name for e in said.effects[1:]]
    return _filled(said.effects[0]) + (f" Then also: {', '.join(others)}." if others else "")


def _filled(found: EffectFound) -> str:
    """An effect's sentence with its numbers; one that is not known is a question mark."""
    effect = about(found.name)
    shown = {k: _number(v.value, v.unit) for k, v in found.parameters.items()}
    for name, parameters in effect.spoken.items():
        shown[name] = next((shown[k] for k in parameters if k in shown), "?")
    return effect.sentence.format_map(defaultdict(lambda: "?", shown))


def unexplained_reason(said: Answer) -> str:
    """What is left, where it lives, and why it has no name."""
    why = said.note or (NO_NAME if said.outside is None else f"{BETTER}: {_filled(said.outside)}.")
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
    if math.isinf(value):
        return "none"
    return _time(value, MINUTES_S) if unit == "s" else f"{value:.3g} {unit}".strip()


def _time(seconds: float, minutes_from: float) -> str:
    if abs(seconds) < minutes_from:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if abs(seconds) < HOURS_S else f"{seconds / 3600:.3g} h"
