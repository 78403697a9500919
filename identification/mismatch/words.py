"""What an explanation says, chosen: a sentence per name that a shift supervisor reads, and what tells names apart.

The texts stand in words.toml, those of an effect in its own file.
"""

from __future__ import annotations

import math
import tomllib
from collections import defaultdict
from collections.abc import Mapping
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.explanation import Explanation, is_stack
from identification.mismatch.outside import OUTSIDE, about

if TYPE_CHECKING:
    from identification.mismatch.answer import Answer, EffectFound

TOLD: Mapping[str, Any] = tomllib.loads((files(__package__) / "words.toml").read_text("utf-8"))
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
    said = TOLD["checks"]
    return EFFECTS[verdict].check if verdict in EFFECTS else said.get(verdict, said["unexplained"])


def discriminating_test(one: str, other: str) -> str:
    """Which experiment or signal would tell two names of the catalogue apart."""
    tests = [EFFECTS[a].tests.get(b) for a, b in ((one, other), (other, one)) if a in EFFECTS]
    return next(filter(None, tests), TOLD["longer"])


def remarks(fit: Mapping[str, Any]) -> list[str]:
    """What is to be said of a fit: that what was found shows one step ahead and in no simulation, and that the plain
    loop which simulates best is another than the one that foretells best."""
    ahead = [] if fit.get("ahead_nat") is None else [TOLD["seen_ahead"]]
    loops = {
        name: f"gain {x['gain']:.3g}, time constant {_number(x['time_constant_s'], 's')}"
        for name, x in fit.get("plain_loops", {}).items()
    }
    return [*ahead, TOLD["two_plain_loops"].format(**loops)] if loops else ahead


def note(found: Explanation) -> str:
    """Why there is no name, or no name alone; empty where there is nothing to say."""
    if found.refuted and not found.accepted:
        over = TOLD["over_others" if found.others else "over_rest"]
        return TOLD["refuted"].format(names=" and ".join(found.refuted), **over)
    if found.left <= 0:
        stacked = " and ".join(c.name for c in found.accepted)
        return TOLD["stacked"].format(names=stacked) if is_stack(found) else ""
    if found.outside is not None:
        return ""
    if not found.left_by:
        return TOLD["no_name"]
    return TOLD["left_over"].format(nats=found.left, by=TOLD["left_by"][found.left_by])


def cycles_told(found: Explanation) -> str:
    """What the cycles show of a faulty valve, in a sentence."""
    seen = found.cycles
    assert seen is not None
    between = "turns of OP" if seen.cycling else "moves of the stem"
    text = TOLD["cycles"].format(share=100 * seen.agreeing, stretches=seen.stretches, between=between)
    return text if found.proven.carries else f"{text} {TOLD['strays']}"


def too_short_told(enough: float, length_s: float, lag_s: float) -> str:
    """What is needed where the record is short against the time constant."""
    length, lag = (_time(x, MINUTES_OF_RECORD_S) for x in (length_s, lag_s))
    return TOLD["too_short"].format(enough=enough, held=length_s / lag_s, length=length, lag=lag)


def reason(said: Answer) -> str:
    """The verdict in words: with the numbers that it needs and what the recording lacks; of what has no name what is
    left, where it lives, and why it has none."""
    if said.verdict == "unexplained":
        outside = "" if said.outside is None else f"{TOLD['better']}: {_filled(said.outside)}."
        return f"{said.note or outside or TOLD['no_name']} {located_sentence(said.where)}".strip()
    first = _filled(said.effects[0]) if said.effects else TOLD["nothing_left"]
    others = f"Then also: {', '.join(e.name for e in said.effects[1:])}." if len(said.effects) > 1 else ""
    caution = f"The figures are rough: it {said.caution}." if said.caution else ""
    return " ".join(filter(None, (first, others, caution, said.shown)))


def _filled(found: EffectFound) -> str:
    """An effect's sentence with its numbers; one that is not known is a question mark."""
    effect = about(found.name)
    shown = {k: _number(v.value, v.unit) for k, v in found.parameters.items()}
    for name, parameters in effect.spoken.items():
        shown[name] = next((shown[k] for k in parameters if k in shown), "?")
    return effect.sentence.format_map(defaultdict(lambda: "?", shown))


def is_along(feature: Mapping[str, Any]) -> bool:
    """Whether errors are of one sign along a feature, so that there is no one place of them."""
    return feature["by"] == "sign" and "along" in TOLD["features"][feature["name"]]


def place(feature: Mapping[str, Any]) -> str:
    """Where one feature of the answer's `where` puts the misfit."""
    told, ends = TOLD["features"][feature["name"]], feature["range"]
    if is_along(feature):
        return told["along"]
    text = f"{ends[0]:.3g} to {ends[1]:.3g} {told.get('unit', '')}" if ends else "part of the range"
    return told["place"].format(range=text)


def located_sentence(where: Mapping[str, Any]) -> str:
    """Where the misfit lives, in one sentence; empty where nothing is known of it."""
    features = where.get("features", [])
    carrying = [place(f) for f in features if f["carries"]]
    if carrying:
        return f"Where it lives: {'; '.join(carrying[:3])}."
    return TOLD["tied_to_nothing"] if features else ""


def _number(value: float, unit: str) -> str:
    if math.isinf(value):
        return "none"
    return _time(value, MINUTES_S) if unit == "s" else f"{value:.3g} {unit}".strip()


def _time(seconds: float, minutes_from: float) -> str:
    if abs(seconds) < minutes_from:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if abs(seconds) < HOURS_S else f"{seconds / 3600:.3g} h"
