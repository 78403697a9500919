"""The morning page: which loops to touch, what is new, what got better, what was not assessed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from analyzer.pages.areas import area_table
from analyzer.pages.reading import Thinned, read_nights, read_trends
from analyzer.pages.trends import sparkline
from analyzer.pages.words import counted, duration, number, setting
from analyzer.store import Store
from reports.names import slug
from reports.pages import Bars, Block, Cell, Column, Page, Section, Table, Text, Tiles

Row = Mapping[str, Any]
COUNTS_PCT = 50.0
"""A loop counts as oscillating from here [% of time]; contract of the ranking."""
HALVED = 0.5
"""A loop got better where its significance fell to this share of the night before [-]; ours."""
COLUMNS = (
    *("loop", "type", "area", "description", "importance", "status", "oscillation_significance"),
    *(
        "oscillating_pct",
        "osc_valve_pct",
        "osc_tuning_pct",
        "osc_load_pct",
        "cause",
        "valve_fault",
        "period_s",
    ),
    *("source_loop", "average_absolute_error_pct", "valve_travel_pct_per_h", "variability_pct", "kp", "ti"),
    *("kp_new", "ti_new", "action", "reason"),
)


@dataclass(frozen=True, slots=True)
class Night:
    """The rows of a night, the worst first, those of the night before by loop, and trends of the worst."""

    name: str
    rows: tuple[Row, ...]
    before: Mapping[str, Row]
    before_name: str
    worst: tuple[Row, ...]
    trends: Mapping[str, Thinned] = field(default_factory=dict)

    @property
    def paged(self) -> frozenset[str]:
        """Loops that have a page of their own."""
        return frozenset(r["loop"] for r in self.worst)


def oscillates(row: Row | None) -> bool:
    """Whether a loop counts as oscillating."""
    return row is not None and (row["oscillating_pct"] or 0.0) >= COUNTS_PCT


def needs_a_look(row: Row) -> bool:
    """Whether a loop oscillates or has a valve at fault all the same."""
    return row["status"] == "ok" and (oscillates(row) or row["cause"] not in ("none", None, ""))


def _worse_first(row: Row) -> tuple[bool, float, str]:
    return (not needs_a_look(row), -(row["oscillation_significance"] or 0.0), row["loop"])


def read_night(store: Store, name: str | None, top: int) -> Night:
    """What the morning page of a night needs."""
    known = store.nights()
    night = name or store.require()
    store.read("nights", night, ["loop"])
    earlier = [n for n in known if n < night]
    rows = sorted(read_nights(store, [night], COLUMNS), key=_worse_first)
    before = {r["loop"]: r for r in read_nights(store, earlier[-1:], COLUMNS)}
    worst = tuple(r for r in rows if needs_a_look(r))[:top]
    trends = read_trends(store, {r["loop"] for r in worst}, [night])
    return Night(night, tuple(rows), before, earlier[-1] if earlier else "", worst, trends)


def linked(night: Night, loop: str) -> Cell:
    """The loop's name, leading to its page where there is one."""
    return Cell(loop, kind="strong", href=f"{slug(loop)}.html" if loop in night.paged else "")


def proposal(row: Row) -> str:
    """The action, with the settings to type in where there are any."""
    if row["kp_new"] is None and row["ti_new"] is None:
        return row["action"] or ""
    return f"{row['action']}: Kp {setting(row['kp_new'])}, Ti {setting(row['ti_new'])}"


def _share(row: Row, cause: str) -> float:
    return float(row[f"osc_{cause}_pct"] or 0.0)


def _bars(row: Row) -> Bars:
    return Bars(tuple((c, _share(row, c)) for c in ("valve", "tuning", "load")))


def _value(row: Row, name: str, digits: str = "") -> Cell:
    value = row[name]
    text = number(value) if not digits or value is None else f"{value:{digits}}"
    return Cell(text, value)


def _cause(row: Row) -> Cell:
    cause = row["cause"] or ""
    return Cell(cause, kind=cause if cause in ("valve", "tuning", "load") else "")


WORST = (
    Column("loop", "Loop"),
    Column("description", "Description", wide=True),
    Column("trend", "PV that night"),
    Column(
        "oscillation_significance",
        "Signif.",
        True,
        "Oscillation significance, % h: amplitude, regularity, hours",
    ),
    Column("oscillating_pct", "Osc. %", True, "Share of the night in which the loop oscillates"),
    Column("period_s", "Period", True),
    Column("confidence", "V T L", hint="Confidence that valve, tuning or load is the cause, %"),
    Column("cause", "Cause"),
    Column("action", "Action", wide=True),
    Column("reason", "Reason", wide=True),
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


ALL = (
    Column("loop", "Loop"),
    Column("description", "Description"),
    Column("type", "Type"),
    Column("area", "Area"),
    Column("oscillation_significance", "Signif.", True),
    Column("oscillating_pct", "Osc. %", True),
    Column("osc_valve_pct", "Valve %", True),
    Column("osc_tuning_pct", "Tuning %", True),
    Column("osc_load_pct", "Load %", True),
    Column("cause", "Cause"),
    Column("average_absolute_error_pct", "Error %", True, "Average absolute error, % of span"),
    Column("valve_travel_pct_per_h", "Travel %/h", True),
    Column("variability_pct", "Variab. %", True),
    Column("action", "Action"),
)


def _all_row(night: Night, row: Row) -> tuple[Cell, ...]:
    texts = tuple(Cell(row[c] or "") for c in ("description", "type", "area"))
    shares = tuple(_value(row, c, ".0f") for c in ALL_SHARES)
    costs = tuple(_value(row, c) for c in ALL_COSTS)
    first = (linked(night, row["loop"]), *texts, _value(row, "oscillation_significance"))
    return (*first, *shares, _cause(row), *costs, Cell(row["action"] or ""))


ALL_SHARES = ("oscillating_pct", "osc_valve_pct", "osc_tuning_pct", "osc_load_pct")
ALL_COSTS = ("average_absolute_error_pct", "valve_travel_pct_per_h", "variability_pct")


def ranking(night: Night) -> Table:
    """All loops of the night."""
    return Table("ranking", "", ALL, tuple(_all_row(night, r) for r in night.rows), "", True, "cause")


def _news(night: Night, row: Row) -> tuple[str, str]:
    """What is new about a loop since the night before, and its colour; '' where nothing is."""
    old = night.before.get(row["loop"])
    if old is None or old["status"] != "ok" or row["status"] != "ok":
        return "", ""
    now, then = (r["oscillation_significance"] or 0.0 for r in (row, old))
    if oscillates(row) and not oscillates(old):
        return "began to oscillate", "worse"
    if oscillates(old) and not oscillates(row):
        return "stopped oscillating", "better"
    if oscillates(old) and now < HALVED * then:
        return "oscillates less than half as much", "better"
    if row["cause"] != old["cause"]:
        return f"cause was {old['cause']}, is {row['cause']}", "unclear"
    return "", ""


NEWS = (
    Column("loop", "Loop"),
    Column("news", "Since the night before"),
    Column("before", "Signif. before", True),
    Column("now", "Signif. now", True),
    Column("action", "Action", wide=True),
)


def news_table(night: Night, tones: Sequence[str], name: str, title: str) -> Table:
    """Loops of which there is something new, of the colours asked for."""
    found = [(row, *_news(night, row)) for row in night.rows]
    rows = tuple(
        (
            linked(night, row["loop"]),
            Cell(text, kind=tone),
            _value(night.before[row["loop"]], "oscillation_significance"),
            _value(row, "oscillation_significance"),
            Cell(proposal(row)),
        )
        for row, text, tone in found
        if text and tone in tones
    )
    return Table(name, f"{title} ({len(rows)})", NEWS, rows)


def _news_blocks(night: Night) -> tuple[Block, ...]:
    tables = (
        news_table(night, ("worse", "unclear"), "new", "New"),
        news_table(night, ("better",), "better", "Better"),
    )
    return tuple(t if t.rows else Text((f"{t.title.split(' (')[0]}: nothing.",), "note") for t in tables)


def _tiles(night: Night) -> Tiles:
    assessed = [r for r in night.rows if r["status"] == "ok"]
    causes = [r["cause"] for r in assessed if needs_a_look(r)]
    items = [(f"{len(assessed)} of {len(night.rows)}", "loops assessed", "")]
    items.append((str(sum(oscillates(r) for r in assessed)), "oscillate", "worse"))
    items += [(str(causes.count(c)), f"caused by {c}", c) for c in ("valve", "tuning", "load")]
    items.append((str(causes.count("undecided")), "undecided", "unclear"))
    return Tiles(tuple(items))


def lost_table(night: Night) -> Table:
    """Loops that were not assessed, and why."""
    columns = (Column("loop", "Loop"), Column("status", "Status"), Column("reason", "Why", wide=True))
    lost = sorted((r for r in night.rows if r["status"] != "ok"), key=lambda r: r["loop"])
    rows = tuple((Cell(r["loop"]), Cell(r["status"] or ""), Cell(r["reason"] or "")) for r in lost)
    return Table("not-assessed", "", columns, rows, searchable=len(rows) > 12)


def _since(night: Night) -> Section:
    if not night.before_name:
        return Section("Since the night before", (Text(("This is the first night in the store.",)),))
    return Section(f"Since {night.before_name}", _news_blocks(night))


def page(night: Night) -> Page:
    """The morning page of a night."""
    lost = sum(r["status"] != "ok" for r in night.rows)
    sections = (
        Section("The night in short", (_tiles(night),)),
        Section("Loops worth a look", (worst_table(night),)),
        _since(night),
        Section("Areas", (area_table(night.rows),)),
        Section("All loops", (ranking(night),)),
        Section(f"Not assessed ({lost})", (lost_table(night),)),
    )
    subtitle = f"{counted(len(night.rows), 'loop')}, the worst first by oscillation significance."
    return Page("index", f"Loops in the morning of {night.name}", subtitle, sections)
