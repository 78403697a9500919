"""Words, figures and tables of an explanation, equal in text and page, and its agreement with the night's verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from analyzer.lanes.lanes import lanes_in
from analyzer.loop.decisions import Action, Cause, Fault, Lane
from analyzer.pages.words import duration, number, page_columns, plain_cell, texts
from identification.mismatch import effect
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.effect import Block, Ends
from identification.mismatch.outside import about
from identification.mismatch.selection import Candidate
from identification.mismatch.words import discriminating_test, is_along, place
from reports.pages import Cell, Table

RATIO_ALONE = 10.0
"""Factor by which a constant of the baseline model may change before only the ratio of gain and time
constant is reported. The gain of an integrating level changed from 0.114 to 2099; its record determines
only the slope."""
HARDLY = 0.05  # Relative change of the baseline model's constants under which they count as kept

Data = Mapping[str, Any]

TEXTS = texts("explanation")
FEATURES, CURVES, ROWS, NOTES = (TEXTS[part] for part in ("features", "curves", "rows", "notes"))
SHOWN = 12
"""Names of tried effects shown."""


def title(verdict: str) -> str:
    """The verdict as a heading."""
    return TEXTS["titles"].get(verdict, verdict.replace("-", " "))


def number_text(value: float | None, unit: str = "") -> str:
    """A number of three digits with its unit, a dash if unknown."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{number(value)} {unit}".strip()


def interval_text(value: Mapping[str, Any]) -> str:
    """The ends of a parameter's interval, with enough digits to differ; a dash if it has no width."""
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


def places(where: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Spans, ranges, periods and direction of OP with the misfit, each with its name."""
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


def parameters(data: Data) -> Table:
    """Parameters with intervals of all effects, including unnamed ones."""
    rows = tuple(
        (Cell(x["name"]), Cell(called), plain_cell(v["value"]), Cell(interval_text(v)), Cell(v["unit"]))
        for x in [*data["effects"], *([data["outside"]] if "outside" in data else [])]
        for k, v in x["parameters"].items()
        if (called := about(x["name"]).called.get(k, k.replace("_", " ")))
    )
    return Table("parameters", "Parameters", page_columns("effects_found"), rows)


def held_out(data: Data) -> tuple[float, float]:
    """Misfit [% PV] of the baseline and the better model on held-out data, in the loop's band if known."""
    fit, banded = data["fit"], data["fit"].get("in_band")
    plain, better = (banded[k] if banded else fit[k]["held_out"] for k in ("baseline", "explained"))
    return plain["rmse"], better["rmse"]


def improves(data: Data) -> bool:
    """Whether the improved model simulates held-out data better than the baseline model."""
    if not data["moved"]:
        return False
    plain, better = held_out(data)
    return better < plain


def improvement(data: Data) -> str:
    """Improvement by the model with effects on held-out data, in the loop's band if known; '' if there is none."""
    if not improves(data):
        return ""
    plain, better = held_out(data)
    removed, banded = share(1.0 - better**2 / max(plain**2, 1e-30)), data["fit"].get("in_band")
    band = (number(banded["shortest_s"]), number_text(banded["longest_s"], "s")) if banded else ()
    text = NOTES["in_band" if banded else "held_out"]
    return str(text.format(*band, plain=rms(plain), better=rms(better), removed=removed))


def no_better(data: Data) -> str:
    """Text that a model with effects is no better on held-out data; '' if it is, or there are no effects."""
    if not data["moved"] or improves(data):
        return ""
    plain, better = map(rms, held_out(data))
    return str(NOTES["no_better"].format(name=data["effects"][0]["name"], plain=plain, better=better))


def _constants(data: Data) -> dict[str, tuple[float, float]]:
    """The changed constants; gain over time constant if these changed so far that only their ratio is known."""
    known = dict(data["moved"])
    if any(a and abs(b / a) > RATIO_ALONE for a, b in (known["gain"], known["time_constant_s"])):
        gain, lag = (known.pop(k) for k in ("gain", "time_constant_s"))
        slope = tuple(k / t if t else math.nan for k, t in zip(gain, lag, strict=True))
        known = {"slope_pct_per_s": slope, **known}
    return known


def moved(data: Data) -> Table:
    """The baseline constants before and after, if the model with effects is better."""
    named, known = TEXTS["constants"], _constants(data) if improves(data) else {}
    rows = tuple(
        (Cell(named[k]["title"]), plain_cell(a), plain_cell(b), Cell(change(a, b)), Cell(named[k]["unit"]))
        for k, (a, b) in known.items()
    )
    most = max((abs(b / a - 1) if a else 0.0 for a, b in known.values()), default=0.0)
    note = NOTES["kept" if most < HARDLY else "bent"]
    return Table(
        "moved", "Changed constants of the baseline model", page_columns("constants_moved"), rows, note
    )


def misfits(data: Data, note: str = "") -> Table:
    """Misfit of the simulations, fitted and held out."""
    named = {k: ROWS[k] for k in ("baseline", "explained", "brought")}
    if no_better(data):
        named["explained"] = ROWS["no_better"]
    rows = [
        (Cell(name), *(cell for m in (fit["fitted"], fit["held_out"]) for cell in (_rms(m), _fit(m))))
        for key, name in named.items()
        if (fit := data["fit"].get(key)) and (key != "explained" or data["moved"])
    ]
    return Table("fit", "", page_columns("simulations"), tuple(rows), note)


def others(data: Data) -> Table:
    """Misfit of both simulations on each other held-out recording."""
    rows = tuple(
        (Cell(x["recording"]), _rms(x["baseline"]), _rms(x["explained"]), Cell(share(x["share"]), x["share"]))
        for x in data.get("held_out_on", [])
    )
    return Table("others", "On the recordings held out", page_columns("held_out"), rows)


def _rms(misfit: Mapping[str, float]) -> Cell:
    return Cell(rms(misfit["rmse"]), misfit["rmse"])


def _fit(misfit: Mapping[str, float]) -> Cell:
    fit_pct = misfit["fit_pct"]
    return Cell("–") if fit_pct is None else Cell(f"{fit_pct:.1f}", fit_pct)


def features(data: Data) -> Table:
    """Features with p-values, and the range of the misfit for significant ones, as bias or size."""
    rows = tuple(
        (
            Cell(FEATURES[f["name"]]["title"], kind="strong" if f["carries"] else ""),
            Cell("< 0.01" if f["p"] < 0.01 else f"{f['p']:.2f}", f["p"]),
            Cell("yes" if f["carries"] else "no"),
            Cell(_carried_by(f) if f["carries"] else ""),
        )
        for f in data["where"].get("features", [])
    )
    return Table("where", "", page_columns("misfit_tied_to"), rows, NOTES["features"])


def _carried_by(feature: Mapping[str, Any]) -> str:
    if is_along(feature):
        return place(feature)
    return f"{'errors of one sign' if feature['by'] == 'sign' else 'larger errors'} at {place(feature)}"


def alternatives(data: Data) -> Table:
    """Names that fit equally well or are indistinguishable, and the test that distinguishes them."""
    rows = tuple(
        (Cell(other, kind="strong"), Cell(discriminating_test(first["name"], other)))
        for first in data["effects"][:1]
        for other in first["alternatives"]
    )
    return Table("alternatives", "", page_columns("alternatives"), rows)


def tried(first: tuple[Candidate, ...], taken: tuple[Candidate, ...]) -> Table:
    """Candidates of the first round, the best of each name, most likely first."""
    names = {c.name for c in taken}
    best = {c.name: c for c in sorted(first, key=lambda c: c.penalised)}
    rows = tuple(
        (Cell(c.name), *(Cell(str(round(x)), x) for x in (c.gain, c.penalised)), Cell(_standing(c, names)))
        for c in sorted(best.values(), key=lambda c: -c.penalised)[:SHOWN]
    )
    return Table("candidates", "", page_columns("effects_tried"), rows, NOTES["tried"])


def _standing(c: Candidate, taken: set[str]) -> str:
    if c.name in taken:
        return "taken"
    return "gain below the penalty" if c.penalised <= 0 else "less gain, or not proven"


def night_note(row: Mapping[str, Any], verdict: str, block: str) -> str:
    """One sentence on the agreement of a night's finding with the explanation; '' if there is nothing to add."""
    notes = TEXTS["beside_verdict"]
    if row["action"] == Action.CHECK_MEASUREMENT and Lane.FROZEN in lanes_in(row):
        return str(notes["frozen"])
    if row["cause"] == Cause.LOAD and block not in (Block.VALVE, Block.LOAD):
        return str(notes["load"])
    if row["cause"] == Cause.NONE and row["action"] == Action.NONE and verdict != "none":
        return str(notes["calm_valve" if block == Block.VALVE else "calm"])
    return agreement(row, verdict, block)


def agreement(row: Mapping[str, Any], verdict: str, block: str) -> str:
    """One sentence on the agreement of a night's verdict with its explanation; empty if neither is about a valve.

    The verdict determines why a loop oscillates, from the whole night with the controller in the loop; the
    explanation determines which physics is missing in a simulation of PV from the recorded OP, tested on a part not
    used for the fit. The verdict has priority for a cause of the oscillation, so the explanation starts with the
    verdict on its own recording (case.py). The explanation has priority for a kind of fault proven on held-out data.
    Other differences, because night and explained recording may differ, are reported with the test that decides.

    row : the loop's row of the night: cause, valve_fault; verdict, block : the explanation's name and block.
    """
    known, notes = EFFECTS.get(verdict), TEXTS["beside_verdict"]
    friction = known is not None and known.friction is not None
    if row["cause"] != Cause.VALVE:
        return notes["valve_alone"] if friction or block == Block.VALVE else ""
    if friction:
        kind = row.get("valve_fault") or Fault.UNDECIDED
        same = kind in (verdict, Fault.UNDECIDED, Fault.NONE)
        text = notes["agree"] if same else notes["other_kind"]
        return text.format(kind=kind, verdict=verdict, stroke=notes["stroke"])
    unasked = isinstance(known, effect.Fault) and known.ends is not Ends.NOTHING
    return notes["stopped"] if unasked else notes["not_borne_out"].format(stroke=notes["stroke"])
