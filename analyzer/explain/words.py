"""The words of an explanation's text and page: names of parameters and features, figures with their units, and how
it goes together with the night's verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from analyzer.loop.decisions import Cause, Fault
from analyzer.pages.words import duration, number
from identification.mismatch import effect
from identification.mismatch.catalogue import EFFECTS, fault
from identification.mismatch.effect import Block, Ends
from identification.mismatch.outside import OUTSIDE
from identification.mismatch.words import ALONG, place

KNOWN = {**EFFECTS, **OUTSIDE}
"""Every effect, named or not."""
PARAMETERS = {name: text for e in KNOWN.values() for name, text in e.called.items()}
"""Parameters as they are called on a page; others by their own name."""
HIDDEN = frozenset(name for e in KNOWN.values() for name in e.hidden)
"""Parameters whose meaning another one carries."""
MOVED = {
    "gain": ("Gain", "% PV/% OP"),
    "time_constant_s": ("Time constant", "s"),
    "dead_time_s": ("Dead time", "s"),
}
FEATURES = {
    "pv_level": "PV level",
    "op_level": "OP level",
    "op_direction": "Direction of OP",
    "op_rate": "Rate of OP",
    "after_reversals": "Time since OP turned",
    "time_in_record": "Time in the recording",
    "at_limits": "OP at a limit",
}
AXES = {
    "pv_level": "PV [%]",
    "op_level": "OP [%]",
    "op_rate": "size of OP's rate [%/s]",
    "after_reversals": "time since OP turned [s]",
    "time_in_record": "time [s]",
}
"""Axes of the features that are drawn."""
TITLES = {"none": "the plain loop explains it", "unexplained": "no name for what is left"}
BROUGHT = "your model"
ROWS = {"baseline": "plain loop", "explained": "improved loop", "brought": BROUGHT}
CURVES = {
    "found": "found",
    "plain": "plain loop",
    "least": "interval",
    "most": "interval",
    "stated": "by the stated settings",
    "recorded": "recorded",
    "points": "samples on straight lines",
    "limit": "end of the range",
}
KINDS = {
    "found": "model",
    "plain": "baseline",
    "least": "edge",
    "most": "edge",
    "stated": "baseline",
    "limit": "sp",
}
SHAPES = {
    "loop": "Stem over OP for a slow sweep up and down; dotted: the ends of the interval.",
    "curve": "The curve found, with its interval, against the plain loop's.",
    "response": "After a step of OP; the band is the interval of what was added.",
    "course": "Over the recording, or the stretch where it shows most.",
}
OBEYED = "OP rebuilt from SP and PV by the stated settings lies on OP as recorded."
"""What the picture of a controller without fault shows."""


def caption(effect: str, kind: str) -> str:
    """What a picture shows: by its effect where that says more than its kind."""
    return (KNOWN[effect].caption if effect in KNOWN else OBEYED) or SHAPES.get(kind, "")


def title(verdict: str) -> str:
    """The verdict as a heading."""
    return TITLES.get(verdict, verdict.replace("-", " "))


def called(name: str) -> str:
    """A parameter's name on a page."""
    return PARAMETERS.get(name, name.replace("_", " "))


def number_text(value: float | None, unit: str = "") -> str:
    """A number of three digits with its unit, a dash where it is not known."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{number(value)} {unit}".strip()


def interval_text(value: Mapping[str, Any]) -> str:
    """The ends of a parameter's interval, with as many digits as tell them apart; a dash where it has no width."""
    low, high = value["low"], value["high"]
    if low is None or high is None or low == high:
        return "–"
    if number(low) != number(high):
        return f"{number(low)} … {number(high)}"
    digits = next((d for d in range(4, 7) if f"{low:.{d}g}" != f"{high:.{d}g}"), 6)
    return f"{low:.{digits}g} … {high:.{digits}g}"


def change(before: float, after: float) -> str:
    """A change in whole percent."""
    if not before:
        return "–"
    pct = round(100 * (after / before - 1))
    return f"{pct:+d} %" if pct else "0 %"


def share(value: float | None) -> str:
    """A share of the held-out misfit in percent."""
    return "–" if value is None else f"{100 * value:.0f} %"


def rms(value: float) -> str:
    """A misfit."""
    return f"{value:.3g} %"


def chance(p: float) -> str:
    """A chance as engineers write it."""
    return "< 0.01" if p < 0.01 else f"{p:.2f}"


def carried_by(feature: Mapping[str, Any]) -> str:
    """Where a feature puts the misfit, and whether as bias or size; empty where it does not carry it."""
    if not feature["carries"]:
        return ""
    if feature["by"] == "sign" and feature["name"] in ALONG:
        return place(feature)
    how = "errors of one sign at" if feature["by"] == "sign" else "larger errors at"
    return f"{how} {place(feature)}"


def places(where: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Spans, ranges, periods and direction of OP that carry the misfit, each with its name."""
    out = []
    if where.get("spans"):
        shown = ", ".join(f"{duration(a) or '0 s'} to {duration(b)}" for a, b in where["spans"][:4])
        out.append(("Spans", shown + (" and more" if len(where["spans"]) > 4 else "")))
    for key, name, unit in (("pv_range", "PV", "%"), ("op_range", "OP", "%"), ("band_s", "Periods", "s")):
        if where.get(key):
            out.append((name, f"{number(where[key][0])} to {number_text(where[key][1], unit)}"))
    if where.get("direction"):
        out.append(("Direction of OP", where["direction"]))
    return out


STROKE = "stroke the valve both ways in steps of a quarter of its band and watch the stem"
"""What settles a question about a valve."""
AGREE = "Verdict and explanation agree on the valve."
OTHER_KIND = (
    "Both find the valve; the night's verdict calls it {kind}, the explanation {verdict}, which a sampling like this "
    f"hardly tells apart: {STROKE}."
)
STOPPED = (
    "The explanation stops at what the recorder did, so it neither bears out nor contradicts the verdict."
)
NOT_BORNE_OUT = (
    "The night's verdict is a valve fault; the explanation does not bear it out on the part of the recording "
    f"that it had not seen: {STROKE} before it is repaired."
)
VALVE_ALONE = (
    "The explanation finds something at the valve; the night's verdict does not hold it to be what makes the "
    "loop oscillate."
)


def agreement(row: Mapping[str, Any], verdict: str, block: str) -> str:
    """One sentence on how a night's verdict and its explanation go together; empty where neither is about a valve.

    The verdict asks why a loop oscillates, from the whole night with the controller in the loop; the explanation asks
    which physics a simulation of PV from the recorded OP lacks, proven on a part that it has not seen. A cause of the
    oscillation is the verdict's to name, so the explanation asks the verdict on its own recording first (case.py). A
    kind of fault is the explanation's where it is proven on held-out data. What still differs, for the night and the
    recording explained need not be the same, is said here, with what would settle it.

    Parameters
    ----------
    row : mapping
        The loop's row of the night: cause, valve_fault.
    verdict, block : str
        The explanation's name and block.
    """
    known = EFFECTS.get(verdict)
    friction = known is not None and known.friction is not None
    if row["cause"] != Cause.VALVE:
        return VALVE_ALONE if friction or block == Block.VALVE else ""
    if friction:
        kind = row.get("valve_fault") or Fault.UNDECIDED
        same = kind in (verdict, Fault.UNDECIDED, Fault.NONE)
        return AGREE if same else OTHER_KIND.format(kind=kind, verdict=verdict)
    unasked = isinstance(known, effect.Fault) and fault(verdict).ends is not Ends.NOTHING
    return STOPPED if unasked else NOT_BORNE_OUT
