"""`triage rank --groups`: a row a group, as table, CSV, JSON or Markdown."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from typing import Any

from analyzer.columns import GROUP_LIST, names, row_of
from analyzer.plantwide.view import GroupView, read_groups
from analyzer.store.store import Store
from analyzer.words.present import figure
from analyzer.words.units import duration, row_settings
from reports.texts import harmless, visible

Row = dict[str, Any]


def grouped(store: Store, night: str | None = None, top: int | None = None) -> tuple[list[Row], str]:
    """Rows of the groups of a night, those that cost most first.

    Raises
    ------
    InputError
        Where there is no such store or night.
    """
    name = night or store.require()
    store.read("nights", name, ["loop"])
    return [group_row(g) for g in read_groups(store, name)][:top], name


def group_row(g: GroupView) -> Row:
    """What is told of a group."""
    source = g.source
    own = g.loops[source["loop"]] if source else None
    return row_of(
        {
            "group": g.number,
            "group_period_s": g.period_s,
            "loops": float(len(g.rows)),
            "fix_first": source["loop"] if source else None,
            "source_pct": source["source_pct"] if source else None,
            "candidates": json.dumps({r["loop"]: round(r["source_pct"], 1) for r in g.candidates}),
            "unseen_pct": g.unseen_pct,
            "source_cause": own["cause"] if own else None,
            "source_action": with_settings(g),
            "others_gain_pct": g.gain_pct,
            "members": json.dumps([r["loop"] for r in g.rows]),
            "sentence": sentence(g),
        },
        GROUP_LIST,
    )


def with_settings(g: GroupView) -> str:
    """The action at the source with the settings to type in, where there are any."""
    source = g.source
    own = g.loops[source["loop"]] if source else None
    if own is None or (own["kp_new"] is None and own["ti_new"] is None):
        return g.action
    return f"{g.action}: {row_settings(own, 'kp_new', 'ti_new')}"


def sentence(g: GroupView) -> str:
    """One cause, so many loops: what is shared, where it starts, what the others would gain."""
    head = f"One oscillation of {duration(g.period_s)} in {len(g.rows)} loops"
    if g.source is not None:
        loop, pct = g.source["loop"], g.source["source_pct"]
        tail = f"it starts at {loop} ({pct:.0f} %)"
    else:
        named = ", ".join(f"{r['loop']} {r['source_pct']:.0f} %" for r in g.candidates)
        tail = f"it starts at one of {named}, or outside what is recorded ({g.unseen_pct:.0f} %)"
    return f"{head}; {tail}; without it the others' average errors fall by {figure(g.gain_pct)} % of span together"


def rendered(rows: Sequence[Row], form: str, night: str) -> str:
    """Groups as text in one of the formats."""
    return {"table": _table, "csv": _csv, "json": _json, "markdown": _markdown}[form](rows, night)


SHOWN = ("group", "loops", "period", "starts at", "action there", "others gain %", "members")


def _cells(row: Row) -> tuple[str, ...]:
    candidates = json.loads(row["candidates"])
    start = ", ".join(f"{loop} {pct:.0f} %" for loop, pct in candidates.items())
    members = [m for m in json.loads(row["members"]) if m != row["fix_first"]]
    cells = (
        *(row["group"], f"{row['loops']:.0f}", duration(row["group_period_s"]), start or "unseen"),
        *(row["source_action"] or "undecided", figure(row["others_gain_pct"]), ", ".join(members)),
    )
    return tuple(map(visible, cells))


def _table(rows: Sequence[Row], night: str) -> str:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from analyzer.pages.rank import interactive

    if not rows:
        return f"Night {night}: no loops share an oscillation"
    table = Table(box=SIMPLE_HEAD, title=f"Night {night}: one cause, several loops", title_justify="left")
    for name in SHOWN:
        table.add_column(name, justify="right" if name in ("loops", "others gain %") else "left")
    for row in rows:
        table.add_row(*(Text(cell) for cell in _cells(row)))
    console = Console(width=None if interactive() else 180)
    with console.capture() as capture:
        console.print(table)
    return "\n".join(line.rstrip() for line in capture.get().rstrip().splitlines())


def _csv(rows: Sequence[Row], night: str) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names(GROUP_LIST))
    for row in rows:
        cells = ("" if v is None else v for v in row.values())
        writer.writerow(harmless(visible(v)) if isinstance(v, str) else v for v in cells)
    return out.getvalue().rstrip("\n")


def _json(rows: Sequence[Row], night: str) -> str:
    lists = ("candidates", "members")
    return json.dumps([{k: json.loads(v) if k in lists else v for k, v in r.items()} for r in rows], indent=1)


def _markdown(rows: Sequence[Row], night: str) -> str:
    from reports.markdown import escaped

    lines = ["| " + " | ".join(SHOWN) + " |", "|" + "|".join("---" for _ in SHOWN) + "|"]
    lines += ["| " + " | ".join(map(escaped, _cells(row))) + " |" for row in rows]
    return "\n".join(lines)
