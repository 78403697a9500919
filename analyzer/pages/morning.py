"""The morning page: which loops to touch, what is new, what got better, what was not assessed."""

from __future__ import annotations

from collections.abc import Sequence

from analyzer.decisions import CAUSES, Cause, Status
from analyzer.pages.areas import area_table
from analyzer.pages.groups import morning_table
from analyzer.pages.headings import heading, headings
from analyzer.pages.news import since
from analyzer.pages.trends import sparkline
from analyzer.pages.view import Night, Row, linked, needs_a_look, oscillates, proposal
from analyzer.pages.words import counted, duration, number
from analyzer.plantwide.view import GroupView
from reports.pages import Bars, Cell, Column, Page, Section, Table, Tiles


def _share(row: Row, cause: str) -> float:
    return float(row[f"osc_{cause}_pct"] or 0.0)


def _bars(row: Row) -> Bars:
    return Bars(tuple((c, _share(row, c)) for c in CAUSES))


def _value(row: Row, name: str, digits: str = "") -> Cell:
    value = row[name]
    text = number(value) if not digits or value is None else f"{value:{digits}}"
    return Cell(text, value)


def _cause(row: Row) -> Cell:
    cause = row["cause"] or ""
    return Cell(cause, kind=cause if cause in CAUSES else "")


WORST = (
    heading("loop"),
    heading("description", wide=True),
    Column("trend", "PV that night"),
    *headings("oscillation_significance", "oscillating_pct", "period_s"),
    Column("confidence", "V T L", hint="Confidence that valve, tuning or load is the cause, %"),
    heading("cause"),
    heading("action", wide=True),
    heading("reason", wide=True),
)


def _worst_row(night: Night, row: Row) -> tuple[Cell, ...]:
    trend = night.trends.get(row["loop"])
    return (
        linked(night, row["loop"]),
        Cell(row["description"] or ""),
        Cell("", figure=sparkline(trend) if trend is not None else None),
        _value(row, "oscillation_significance"),
        _value(row, "oscillating_pct", ".0f"),
        Cell(duration(row["period_s"]), row["period_s"]),
        Cell("", _share(row, "valve"), figure=_bars(row)),
        _cause(row),
        Cell(proposal(row)),
        Cell(row["reason"] or ""),
    )


def worst_table(night: Night) -> Table:
    """The loops to touch, the worst first."""
    rows = tuple(_worst_row(night, r) for r in night.worst)
    note = "V T L: confidence in valve, tuning and load as the cause; they need not sum to 100."
    return Table("worst", "", WORST, rows, note, searchable=len(rows) > 10, facet="cause")


ALL_SHARES = ("oscillating_pct", "osc_valve_pct", "osc_tuning_pct", "osc_load_pct")
ALL_COSTS = ("average_absolute_error_pct", "valve_travel_pct_per_h", "variability_pct")
ALL = headings(
    *("loop", "description", "type", "area", "oscillation_significance", *ALL_SHARES, "cause", *ALL_COSTS),
    "action",
)


def _all_row(night: Night, row: Row) -> tuple[Cell, ...]:
    texts = tuple(Cell(row[c] or "") for c in ("description", "type", "area"))
    shares = tuple(_value(row, c, ".0f") for c in ALL_SHARES)
    costs = tuple(_value(row, c) for c in ALL_COSTS)
    first = (linked(night, row["loop"]), *texts, _value(row, "oscillation_significance"))
    return (*first, *shares, _cause(row), *costs, Cell(row["action"] or ""))


def ranking(night: Night) -> Table:
    """All loops of the night."""
    return Table("ranking", "", ALL, tuple(_all_row(night, r) for r in night.rows), "", True, "cause")


def _tiles(night: Night) -> Tiles:
    assessed = [r for r in night.rows if r["status"] == Status.OK]
    causes = [r["cause"] for r in assessed if needs_a_look(r)]
    items = [(f"{len(assessed)} of {len(night.rows)}", "loops assessed", "")]
    items.append((str(sum(oscillates(r) for r in assessed)), "oscillate", "worse"))
    items += [(str(causes.count(c)), f"caused by {c}", c) for c in CAUSES]
    items.append((str(causes.count(Cause.UNDECIDED)), "undecided", "unclear"))
    return Tiles(tuple(items))


def lost_table(night: Night) -> Table:
    """Loops that were not assessed, and why."""
    columns = (*headings("loop", "status"), heading("reason", wide=True))
    lost = sorted((r for r in night.rows if r["status"] != Status.OK), key=lambda r: r["loop"])
    rows = tuple((Cell(r["loop"]), Cell(r["status"] or ""), Cell(r["reason"] or "")) for r in lost)
    return Table("not-assessed", "", columns, rows, searchable=len(rows) > 12)


def page(night: Night, groups: Sequence[GroupView] = ()) -> Page:
    """The morning page of a night, with its groups that share an oscillation."""
    lost = sum(r["status"] != Status.OK for r in night.rows)
    sections = (
        Section("The night in short", (_tiles(night),)),
        *((Section("One cause, several loops", (morning_table(night, groups),)),) if groups else ()),
        Section("Loops worth a look", (worst_table(night),)),
        since(night),
        Section("Areas", (area_table(night.rows),)),
        Section("All loops", (ranking(night),)),
        Section(f"Not assessed ({lost})", (lost_table(night),)),
    )
    subtitle = f"{counted(len(night.rows), 'loop')}, the worst first by oscillation significance."
    return Page("index", f"Loops in the morning of {night.name}", subtitle, sections)
