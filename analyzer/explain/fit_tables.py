"""How well plain and improved simulation fit, on the page of an explanation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analyzer.explain.one_loop import Explained
from analyzer.explain.page_words import ROWS, rms, share
from analyzer.pages.words import duration
from identification.mismatch.words import seen_ahead, two_plain_loops
from reports.pages import Block, Cell, Column, Table


def fit_tables(e: Explained) -> tuple[Block, ...]:
    """Misfit of both simulations, fitted and held out, and on each other recording that was held out."""
    columns = (
        Column("model", "Simulation"),
        Column("fitted", "rms, fitted", True),
        Column("fitted_fit", "Fit %", True),
        Column("held", "rms, held out", True),
        Column("held_fit", "Fit %", True),
    )
    shown = [k for k in ROWS if k in e.data["fit"] and (k != "explained" or e.found.accepted)]
    rows = []
    for key in shown:
        cells = [Cell(ROWS[key])]
        for part in ("fitted", "held_out"):
            m = e.data["fit"][key][part]
            cells += [Cell(rms(m["rmse"]), m["rmse"]), Cell(f"{m['fit_pct']:.1f}", m["fit_pct"])]
        rows.append(tuple(cells))
    horizon = e.data["fit"]["horizon_s"]
    note = (
        f"Held out: {_held(e)}. "
        "Fit % is 100 where the simulation is exact and 0 where the mean does as well; load and noise keep it lower."
        + (
            f" The simulations begin anew every {duration(horizon)}, so that slow load does not drown them."
            if horizon
            else ""
        )
    )
    fit = e.data["fit"]
    note = " ".join(x for x in (note, seen_ahead(fit), two_plain_loops(fit)) if x)
    return (Table("fit", "", columns, tuple(rows), note), *_others(e.data))


def _held(e: Explained) -> str:
    if e.found.others:
        return "the other recordings below, on which nothing but a constant bias was fitted"
    last = f"the last {100 * e.found.p.limits.proof.held_out:.0f} % of the recording"
    return f"{last}, on which models fitted to the first part are judged"


def _others(data: Mapping[str, Any]) -> tuple[Block, ...]:
    columns = (
        Column("recording", "Held out"),
        Column("plain", "rms, plain", True),
        Column("improved", "rms, improved", True),
        Column("removed", "Misfit removed", True),
    )
    rows = [
        (
            Cell(x["recording"]),
            Cell(rms(x["baseline"]["rmse"]), x["baseline"]["rmse"]),
            Cell(rms(x["explained"]["rmse"]), x["explained"]["rmse"]),
            Cell(share(x["share"]), x["share"]),
        )
        for x in data.get("held_out_on", [])
    ]
    return (Table("others", "On the recordings held out", columns, tuple(rows)),) if rows else ()
