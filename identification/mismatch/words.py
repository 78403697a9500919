"""The words of an explanation: a sentence per name that a shift supervisor reads, and what tells names apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from identification.mismatch.answer import Answer, EffectFound
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.outside import OUTSIDE

NOTHING_LEFT = "The plain loop explains the recording; nothing is left that the data could name."
NO_NAME = "Something is left that no effect of the catalogue explains."
BETTER = "No cause that the catalogue names explains the loop as well as one that it does not name"
"""How physics of no name is told."""
CHECKS = {
    "none": "Nothing has to be done about the model.",
    "unexplained": "Give it a recording with moves of the set point, or say what else acts on this loop.",
}
"""What to look at where no effect is named."""
LONGER = "A step of OP each way in manual, held for five time constants, at two operating points."
"""What tells apart what has no line of its own."""


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


SPOKEN_S = (600.0, 7200.0)
"""Times from which minutes and hours are spoken of [s]; ours."""


class _Spoken(dict[str, str]):
    def __missing__(self, key: str) -> str:
        return "?"


def sentence(said: Answer) -> str:
    """One sentence for the verdict, with the numbers that it needs."""
    if not said.effects:
        return NOTHING_LEFT
    effect = EFFECTS[said.effects[0].name]
    shown = {k: _number(v.value, v.unit) for k, v in said.effects[0].parameters.items()}
    for name, parameters in effect.spoken.items():
        shown[name] = next((shown[k] for k in parameters if k in shown), "?")
    text = effect.sentence.format_map(_Spoken(shown))
    others = [e.name for e in said.effects[1:]]
    return text + (f" Then also: {', '.join(others)}." if others else "")


def unexplained_reason(said: Answer) -> str:
    """What is left, where it lives, and why it has no name."""
    why = said.note or (NO_NAME if said.outside is None else outside_sentence(said.outside))
    return f"{why} {located_sentence(said.where)}".strip()


def outside_sentence(found: EffectFound) -> str:
    """What explains a loop better than the catalogue does, with its numbers."""
    effect = OUTSIDE[found.name]
    shown = {k: _number(v.value, v.unit) for k, v in found.parameters.items()}
    return f"{BETTER}: {effect.sentence.format_map(_Spoken(shown))}."


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
    if unit == "s" and abs(value) >= SPOKEN_S[0]:
        return f"{value / 60:.3g} min" if abs(value) < SPOKEN_S[1] else f"{value / 3600:.3g} h"
    return f"{value:.3g} {unit}".strip()
