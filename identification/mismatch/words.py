"""Texts of an explanation: a sentence per name for a shift supervisor, and the tests that distinguish names.

The texts are in words.toml, those of an effect in its own file.
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

TEXTS: Mapping[str, Any] = tomllib.loads((files(__package__) / "words.toml").read_text("utf-8"))
MINUTES_S, MINUTES_OF_RECORD_S, HOURS_S = 600.0, 120.0, 7200.0
"""Times above which minutes are used, for a parameter and for a record, and hours [s]; ours."""


def check(data: Mapping[str, Any]) -> str:
    """What to inspect, from an answer as data: by its verdict, and by an explanation outside the catalogue; empty
    where the recording cannot be explained at all, because the reason then gives its needs."""
    verdict = data["verdict"]
    if not data.get("fit", True):
        return ""
    if "outside" in data:
        return OUTSIDE[data["outside"]["name"]].check
    checks = TEXTS["checks"]
    return EFFECTS[verdict].check if verdict in EFFECTS else checks.get(verdict, checks["unexplained"])


def discriminating_test(one: str, other: str) -> str:
    """The experiment or signal that distinguishes two names of the catalogue."""
    tests = [EFFECTS[a].tests.get(b) for a, b in ((one, other), (other, one)) if a in EFFECTS]
    return next(filter(None, tests), TEXTS["longer"])


def remarks(fit: Mapping[str, Any]) -> list[str]:
    """Remarks on a fit: that the finding appears in one-step-ahead prediction but in no simulation, and that the
    baseline models with the best simulation and the best prediction differ."""
    ahead = [] if fit.get("ahead_nat") is None else [TEXTS["seen_ahead"]]
    loops = {
        name: f"gain {x['gain']:.3g}, time constant {_number(x['time_constant_s'], 's')}"
        for name, x in fit.get("plain_loops", {}).items()
    }
    return [*ahead, TEXTS["two_plain_loops"].format(**loops)] if loops else ahead


def note(found: Explanation) -> str:
    """Why there is no name, or no single name; empty if there is nothing to add."""
    if found.refuted and not found.accepted:
        over = TEXTS["over_others" if found.others else "over_rest"]
        return TEXTS["refuted"].format(names=" and ".join(found.refuted), **over)
    if found.residual_nat <= 0:
        stacked = " and ".join(c.name for c in found.accepted)
        return TEXTS["stacked"].format(names=stacked) if is_stack(found) else ""
    if found.outside is not None:
        return ""
    if not found.residual_by:
        return TEXTS["no_name"]
    return TEXTS["left_over"].format(nats=found.residual_nat, by=TEXTS["left_by"][found.residual_by])


def cycles_text(found: Explanation) -> str:
    """A sentence on the faulty valve that the cycles show."""
    seen = found.cycles
    assert seen is not None
    between = "OP reversals" if seen.cycling else "moves of the stem"
    text = TEXTS["cycles"].format(share=100 * seen.agreeing, stretches=seen.stretches, between=between)
    return text if found.proven.carries else f"{text} {TEXTS['strays']}"


def too_short_text(enough: float, length_s: float, lag_s: float) -> str:
    """Requirement where the record is short compared with the time constant."""
    length, lag = (_time(x, MINUTES_OF_RECORD_S) for x in (length_s, lag_s))
    return TEXTS["too_short"].format(enough=enough, held=length_s / lag_s, length=length, lag=lag)


def reason(answer: Answer) -> str:
    """The verdict in words: with its numbers and what the recording does not determine; for an unnamed residual its
    size, its location, and why it has no name."""
    if answer.verdict == "unexplained":
        outside = "" if answer.outside is None else f"{TEXTS['better']}: {_filled(answer.outside)}."
        return f"{answer.note or outside or TEXTS['no_name']} {located_sentence(answer.where)}".strip()
    first = _filled(answer.effects[0]) if answer.effects else TEXTS["nothing_left"]
    others = f"Then also: {', '.join(e.name for e in answer.effects[1:])}." if len(answer.effects) > 1 else ""
    caution = f"The figures are rough: the recording {answer.caution}." if answer.caution else ""
    return " ".join(filter(None, (first, others, caution, answer.shown)))


def _filled(found: EffectFound) -> str:
    """An effect's sentence with its numbers; an unknown one is a question mark."""
    effect = about(found.name)
    shown = {k: _number(v.value, v.unit) for k, v in found.parameters.items()}
    for name, parameters in effect.spoken.items():
        shown[name] = next((shown[k] for k in parameters if k in shown), "?")
    return effect.sentence.format_map(defaultdict(lambda: "?", shown))


def is_along(feature: Mapping[str, Any]) -> bool:
    """Whether errors keep one sign along a feature, so that they have no single place."""
    return feature["by"] == "sign" and "along" in TEXTS["features"][feature["name"]]


def place(feature: Mapping[str, Any]) -> str:
    """Location of the misfit along one feature of the answer's `where`."""
    texts, ends = TEXTS["features"][feature["name"]], feature["range"]
    if is_along(feature):
        return texts["along"]
    text = f"{ends[0]:.3g} to {ends[1]:.3g} {texts.get('unit', '')}" if ends else "part of the range"
    return texts["place"].format(range=text)


def located_sentence(where: Mapping[str, Any]) -> str:
    """Location of the misfit in one sentence; empty if unknown."""
    features = where.get("features", [])
    carrying = [place(f) if is_along(f) else f"is located at {place(f)}" for f in features if f["carries"]]
    if carrying:
        return f"The residual {'; '.join(carrying[:3])}."
    return TEXTS["tied_to_nothing"] if features else ""


def _number(value: float, unit: str) -> str:
    if math.isinf(value):
        return "none"
    return _time(value, MINUTES_S) if unit == "s" else f"{value:.3g} {unit}".strip()


def _time(seconds: float, minutes_from: float) -> str:
    if abs(seconds) < minutes_from:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if abs(seconds) < HOURS_S else f"{seconds / 3600:.3g} h"
