"""What to do about a loop in three lines, and the hand-over sheet for maintenance with the valves and their tests."""

from __future__ import annotations

from analyzer.lanes.lanes import lanes_in
from analyzer.limits import PAGES
from analyzer.loop.decisions import Action, Cause, Fault, Lane, Status
from analyzer.pages.reading import ShownNight, link_to
from analyzer.pages.words import ALL_LOOPS, Row, cells, duration, page_table, plain_cell, texts, with_noun
from analyzer.words.belief import wear_text
from analyzer.words.units import changed_settings
from reports.pages import Cell, Page, Section, Table, section, there

NAME = "maintenance"


def _fault_width(row: Row) -> float | None:
    """Stickband or play [% of OP]; None where there is none."""
    return row["stickband_pct"] or row["backlash_pct"] or None


def _stroke(row: Row) -> tuple[str, str]:
    """Steps of the stroke test of a valve at fault [%], and what it does in them; '' where it does not answer."""
    width, kind = _fault_width(row) or 0.0, texts("by_hand").get(row["valve_fault"], "")
    return f"{width / PAGES.stroke_steps:.2g}", kind.format(width=width) if width else ""


def valve_test(row: Row) -> str:
    """The stroke test of a valve at fault in a few words; its order says how it is done."""
    step, answer = _stroke(row)
    return f"steps of {step} %: {answer}" if answer else "steps of 5 %: PV, or the stem, does not answer"


def _case(row: Row) -> str:
    """The order that a row asks for."""
    action = Action(row["action"])
    if action is Action.REPAIR_VALVE and not _stroke(row)[1]:
        return "dead valve"
    if action is Action.NONE and row["cause"] == Cause.LOAD:
        return "moved from outside"
    if action is Action.UNDECIDED and row["cause"] == Cause.NONE:
        return next((str(x) for x in (Lane.AT_LIMIT, Lane.WINDUP) if x in lanes_in(row)), action)
    return action


def _expected(row: Row) -> str:
    """What new settings make of the cycle."""
    if None not in (row["expected_period_s"], row["expected_pv_amplitude_pct"]):
        swing = f"{row['expected_pv_amplitude_pct']:.2g} % of span"
        return f"a cycle of {duration(row['expected_period_s'])} and {swing}: the valve stays as it is"
    if row["cause"] == Cause.VALVE:
        return "the cycle comes to rest, by simulation, though the valve stays as it is"
    return "the swing dies away within a few periods"


def work_order(row: Row) -> tuple[tuple[str, str], ...]:
    """Lead and text of three lines, '' where there is nothing to say; none for a night that advised nothing."""
    if not row["action"]:
        return ()
    said = {name: row.get(name) or "" for name in ("loop", "advice", "reason")}
    said |= {
        "form": row.get("form") or "ideal",
        "source": row.get("source_loop") or "the loop that it follows",
    }
    said |= {"lack": f": {row['lack']}" if row.get("lack") else "", "period": duration(row.get("period_s"))}
    if row["action"] == Action.REPAIR_VALVE:
        said |= dict(zip(("step", "answer"), _stroke(row), strict=True))
    if row["action"] == Action.RETUNE:
        said |= {"settings": changed_settings(row), "expected": _expected(row)}
    order = {part: text.format(**said) for part, text in texts("orders")[_case(row)].items()}
    look = order["look"] or order.get("else", "")
    return ("Do", order["do"]), ("Look for", look), ("Then", order["after"])


def wearing(night: ShownNight) -> Table:
    """Valves whose width grows, the fastest first: for the next shutdown."""
    rows = [r for r in night.rows if r["wear_pct_per_month"] is not None]
    rows.sort(key=lambda r: -r["wear_pct_per_month"])
    told = (cells(r, "wear", loop=link_to(night, r["loop"]), forecast=Cell(wear_text(r))) for r in rows)
    return page_table("wear", told)


def faulty(night: ShownNight) -> Table:
    """Valves at fault, by making a cycle or for all that nights say: those to be repaired first, then by width."""
    assessed = [r for r in night.rows if r["status"] == Status.OK]
    faults = (Fault.BACKLASH, Fault.STICTION)
    rows = [r for r in assessed if r["cause"] == Cause.VALVE or r["valve_fault"] in faults]
    rows.sort(key=lambda r: (r["action"] != Action.REPAIR_VALVE, -(_fault_width(r) or 0.0)))
    return page_table("valves", (_valve_cells(night, r) for r in rows))


def _valve_cells(night: ShownNight, row: Row) -> tuple[Cell, ...]:
    """A valve's row, with what the store does not hold and place for what is found."""
    fault = "" if row["valve_fault"] in (None, Fault.NONE) else row["valve_fault"]
    own = {"loop": link_to(night, row["loop"]), "valve_fault": Cell(fault, kind="valve"), "found": Cell("")}
    own |= {"width": plain_cell(row["stickband_pct"] or row["backlash_pct"]), "test": Cell(valve_test(row))}
    return cells(row, "valves", **own)


def worn(night: ShownNight) -> Table:
    """The valves that travel most."""
    rows = [r for r in night.rows if r["valve_travel_pct_per_h"] is not None]
    rows.sort(key=lambda r: -r["valve_travel_pct_per_h"])
    shown = rows[: PAGES.travelled]
    return page_table("travel", (cells(r, "travel", loop=link_to(night, r["loop"])) for r in shown))


def maintenance_page(night: ShownNight) -> Page:
    """The sheet of a night."""
    first, growing = faulty(night), wearing(night)
    sections = there(
        Section(f"Valves at fault ({len(first.rows)})", (first,)),
        section(f"Valves that wear ({len(growing.rows)})", growing if growing.rows else None),
        Section("Valves that travel most", (worn(night),)),
    )
    valves = with_noun(len(first.rows), "valve")
    subtitle = f"{valves} at fault in the night of {night.name}, for the valve shop."
    return Page(NAME, "Hand-over to maintenance", subtitle, sections, (ALL_LOOPS,))
