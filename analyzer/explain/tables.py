"""The tables of an explanation, from the answer as data: text and page show the same cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analyzer.explain.words import (
    FEATURES,
    HIDDEN,
    MOVED,
    ROWS,
    called,
    carried_by,
    chance,
    change,
    interval_text,
    rms,
    share,
)
from analyzer.pages.words import page_columns, plain_cell
from identification.mismatch.selection import Candidate
from identification.mismatch.words import discriminating_test
from reports.pages import Cell, Table

Data = Mapping[str, Any]
HARDLY = 0.05
"""Relative change of the plain loop's constants under which they count as kept."""
BENT = "What was left out had to be made up for by these; with it they move back."
KEPT = "They hardly move: what was left out had not bent them."
SHOWN = 12
"""Names shown of those that were tried."""


def parameters(data: Data) -> Table:
    """Parameters with intervals of all effects, and of physics that has no name."""
    rows = tuple(
        (Cell(x["name"]), Cell(called(k)), plain_cell(v["value"]), Cell(interval_text(v)), Cell(v["unit"]))
        for x in [*data["effects"], *([data["outside"]] if "outside" in data else [])]
        for k, v in x["parameters"].items()
        if k not in HIDDEN
    )
    return Table("parameters", "Parameters", page_columns("effects_found"), rows)


def moved(data: Data) -> Table:
    """The plain loop's constants before and after."""
    rows = tuple(
        (Cell(MOVED[k][0]), plain_cell(a), plain_cell(b), Cell(change(a, b)), Cell(MOVED[k][1]))
        for k, (a, b) in data["moved"].items()
    )
    most = max((abs(b / a - 1) if a else 0.0 for a, b in data["moved"].values()), default=0.0)
    note = KEPT if most < HARDLY else BENT
    return Table("moved", "How the plain loop's constants moved", page_columns("constants_moved"), rows, note)


def misfits(data: Data, note: str = "") -> Table:
    """Misfit of the simulations, fitted and held out."""
    shown = [k for k in ROWS if k in data["fit"] and (k != "explained" or data["moved"])]
    rows = []
    for key in shown:
        cells = [Cell(ROWS[key])]
        for part in ("fitted", "held_out"):
            m = data["fit"][key][part]
            cells += [_rms(m), Cell(f"{m['fit_pct']:.1f}", m["fit_pct"])]
        rows.append(tuple(cells))
    return Table("fit", "", page_columns("simulations"), tuple(rows), note)


def others(data: Data) -> Table:
    """Misfit of both simulations on each other recording that was held out."""
    rows = tuple(
        (Cell(x["recording"]), _rms(x["baseline"]), _rms(x["explained"]), Cell(share(x["share"]), x["share"]))
        for x in data.get("held_out_on", [])
    )
    return Table("others", "On the recordings held out", page_columns("held_out"), rows)


def _rms(misfit: Mapping[str, float]) -> Cell:
    return Cell(rms(misfit["rmse"]), misfit["rmse"])


def features(data: Data) -> Table:
    """What the misfit is tied to."""
    rows = tuple(
        (
            Cell(FEATURES[f["name"]], kind="strong" if f["carries"] else ""),
            Cell(chance(f["p"]), f["p"]),
            Cell("yes" if f["carries"] else "no"),
            Cell(carried_by(f)),
        )
        for f in data["where"].get("features", [])
    )
    note = (
        "The plain loop's one-step errors in one joint regression: each row is what it adds to the others; chances "
        "from blocks in other orders."
    )
    return Table("where", "", page_columns("misfit_tied_to"), rows, note)


def alternatives(data: Data) -> Table:
    """Names that fit as well or look alike, and what would tell them from the one that is told."""
    rows = tuple(
        (Cell(other, kind="strong"), Cell(discriminating_test(first["name"], other)))
        for first in data["effects"][:1]
        for other in first["alternatives"]
    )
    return Table("alternatives", "", page_columns("alternatives"), rows)


def tried(first: tuple[Candidate, ...], taken: tuple[Candidate, ...]) -> Table:
    """What was tried in the first round, the best of each name, the likeliest first."""
    names = {c.name for c in taken}
    best = {c.name: c for c in sorted(first, key=lambda c: c.penalised)}
    rows = tuple(
        (Cell(c.name), _nats(c.gain), _nats(c.penalised), Cell(_standing(c, names)))
        for c in sorted(best.values(), key=lambda c: -c.penalised)[:SHOWN]
    )
    note = "Each name was fitted with all constants free; the best of so many gains about five nat by chance."
    return Table("candidates", "", page_columns("effects_tried"), rows, note)


def _nats(value: float) -> Cell:
    return Cell(str(round(value)), value)


def _standing(c: Candidate, taken: set[str]) -> str:
    if c.name in taken:
        return "taken"
    return "does not pay" if c.penalised <= 0 else "less, or not proven"
