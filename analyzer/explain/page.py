"""The page of an explanation: what is wrong, how sure it is, what it looks like, what it could also be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.explain import plots
from analyzer.explain.fit_tables import fit_tables
from analyzer.explain.one_loop import Explained
from analyzer.explain.page_words import (
    FEATURES,
    HIDDEN,
    MOVED,
    called,
    carried_by,
    chance,
    change,
    figure,
    found_in,
    interval,
    rms,
    share,
    spans_said,
    title,
)
from analyzer.explain.views import Tried
from analyzer.history.plant_clock import UTC_NAME
from analyzer.pages.words import duration, number, stamp
from identification.mismatch.words import check, discriminating_test, located_sentence
from reports.pages import Block, Cell, Column, Facts, Page, Section, Table, Text, Tiles
from reports.texts import slug

HARDLY = 0.05
"""Relative change of the plain loop's constants under which they count as kept."""
BENT = "What was left out had to be made up for by these; with it they move back."
SHOWN = 12
"""Names shown of those that were tried."""


def page(e: Explained, zone: str = UTC_NAME) -> Page:
    """The page of one loop's explanation, with times on the plant's clock."""
    sections = [
        Section("What it is", _verdict(e)),
        Section("Recording and simulation", plots.trends(e)),
        *_found(e),
        Section("Where the misfit lives", (*_where(e.data["where"]), plots.misfit_panels(e))),
        Section("How well it fits", fit_tables(e)),
        *_alternatives(e.data),
        *_tried(e),
        *_controller(e),
    ]
    spec = e.case.spec
    about = [spec.description, spec.type, spec.area, _recorded(e, zone)]
    heading = f"{spec.loop}: {title(e.said.verdict)}"
    return Page(
        f"{slug(spec.loop)}-explained",
        heading,
        ", ".join(a for a in about if a),
        tuple(sections),
        footer=_footer(e),
        zone=zone,
    )


def abstention(data: Mapping[str, Any]) -> Page:
    """The page of a loop whose recording cannot be explained at all."""
    text = Text((data["reason"][:1].upper() + data["reason"][1:] + ".",), "lead")
    name = f"{slug(data['loop'])}-explained"
    return Page(name, f"{data['loop']}: not told", "", (Section("What is missing", (text,)),))


def _recorded(e: Explained, zone: str) -> str:
    r = e.case.prepared.record
    return (
        f"{stamp(r.start_s, zone)} {zone}, {duration(len(r) * r.dt_s)}, a sample each {figure(r.dt_s, 's')}"
    )


def _footer(e: Explained) -> str:
    s = e.case.prepared.scale
    unit = f" {e.case.spec.pv_unit}" if e.case.spec.pv_unit else ""
    how = "of the recorded range, for none is stated, " if s.recorded else ""
    pv = f"{figure(s.low)} to {figure(s.low + s.span)}{unit}"
    op = f"{figure(s.op_low)} to {figure(s.op_low + s.op_span)}"
    return f"Percent of PV are {how}{pv}; percent of OP of {op}. Intervals are 90 %."


def _verdict(e: Explained) -> tuple[Block, ...]:
    d = e.data
    brought = [Text((d["fit"]["brought"]["note"],))] if "brought" in d["fit"] else []
    return (Text((d["reason"],), "lead"), Text((check(d),)), *brought, Tiles(_tiles(e)))


def _tiles(e: Explained) -> tuple[tuple[str, str, str], ...]:
    d, size = e.data, {k: rms(x) for k, x in e.views.misfit.items()}
    seat = "where to look first" if d["verdict"] == "unexplained" else "where it sits"
    tiles = [(d["block"], seat, "")] if d["block"] != "none" else []
    horizon = d["fit"]["horizon_s"]
    over = f"within windows of {duration(horizon)}" if horizon else "over the recording"
    if e.found.accepted:
        what = f"rms misfit {over}, plain and improved"
        less = e.views.misfit["model"] < e.views.misfit["baseline"]
        tiles.append((f"{size['baseline']} → {size['model']}", what, "better" if less else ""))
    else:
        rest = ": load and noise" if d["verdict"] == "none" else ""
        tiles.append((size["baseline"], f"rms misfit of the plain simulation{rest}", ""))
    held = next((x["held_out_share"] for x in d["effects"] if x["held_out_share"] is not None), None)
    if held is not None:
        tiles.append((share(held), "of the misfit on held-out data removed", "better"))
    others = d["effects"][0]["alternatives"] if d["effects"] else []
    if others:
        tiles.append((str(len(others)), "other names fit as well or look alike", "incomparable"))
    return tuple(tiles)


def _found(e: Explained) -> list[Section]:
    drawn = () if e.views.shape is None else (plots.shape_plot(e.views.shape),)
    blocks = (*drawn, *_parameters(e.data), *_moved(e.data["moved"]))
    return [Section("What was found", blocks)] if blocks else []


def _where(where: Mapping[str, Any]) -> tuple[Block, ...]:
    facts = [("Signals", ", ".join(where.get("signals", [])))] if where.get("signals") else []
    if where.get("spans"):
        facts.append(("Spans", spans_said(where["spans"])))
    for key, name, unit in (("pv_range", "PV", "%"), ("op_range", "OP", "%"), ("band_s", "Periods", "s")):
        if where.get(key):
            facts.append((name, f"{number(where[key][0])} to {figure(where[key][1], unit)}"))
    if where.get("direction"):
        facts.append(("Direction of OP", where["direction"]))
    blocks: list[Block] = [Text((located_sentence(where),))] if where.get("features") else []
    blocks += [Facts(tuple(facts))] if facts else []
    features = where.get("features", [])
    if not features:
        return (
            *blocks,
            Text(("The record holds too few memories of the loop for a test of where.",), "note"),
        )
    columns = (
        Column("feature", "Tied to"),
        Column("p", "Chance", True, "Of as much on errors tied to nothing, over all rows together"),
        Column("carries", "Carries it"),
        Column("place", "How", wide=True),
    )
    rows = tuple(
        (
            Cell(FEATURES[f["name"]], kind="strong" if f["carries"] else ""),
            Cell(chance(f["p"]), f["p"]),
            Cell("yes" if f["carries"] else "no"),
            Cell(carried_by(f)),
        )
        for f in features
    )
    note = (
        "The plain loop's one-step errors in one joint regression: each row is what it adds to the others; chances "
        "from blocks in other orders."
    )
    return (*blocks, Table("where", "", columns, rows, note))


def _parameters(data: Mapping[str, Any]) -> tuple[Block, ...]:
    columns = (
        Column("effect", "Effect"),
        Column("parameter", "Parameter"),
        Column("value", "Value", True),
        Column("interval", "90 % interval", True),
        Column("unit", "Unit"),
    )
    rows = [
        (
            Cell(x["name"]),
            Cell(called(k)),
            Cell(number(v["value"]), v["value"]),
            Cell(interval(v)),
            Cell(v["unit"]),
        )
        for x in found_in(data)
        for k, v in x["parameters"].items()
        if k not in HIDDEN
    ]
    return (Table("parameters", "Parameters", columns, tuple(rows)),) if rows else ()


def _moved(moved: Mapping[str, Sequence[float]]) -> tuple[Block, ...]:
    if not moved:
        return ()
    columns = (
        Column("constant", "Of the plain loop"),
        Column("before", "Plain", True),
        Column("after", "Improved", True),
        Column("change", "Change", True),
        Column("unit", "Unit"),
    )
    rows = []
    for key, (a, b) in moved.items():
        name, unit = MOVED.get(key, (key, ""))
        rows.append((Cell(name), Cell(number(a), a), Cell(number(b), b), Cell(change(a, b)), Cell(unit)))
    most = max(abs(b / a - 1) if a else 0.0 for a, b in moved.values())
    note = "They hardly move: what was left out had not bent them." if most < HARDLY else BENT
    return (Table("moved", "How the plain loop's constants moved", columns, tuple(rows), note),)


def _alternatives(data: Mapping[str, Any]) -> list[Section]:
    named = data["effects"][0] if data["effects"] else None
    if named is None or not named["alternatives"]:
        return []
    columns = (Column("name", "Could also be"), Column("test", "What would tell them apart", wide=True))
    rows = tuple(
        (Cell(a, kind="strong"), Cell(discriminating_test(named["name"], a))) for a in named["alternatives"]
    )
    return [Section("What it could also be", (Table("alternatives", "", columns, rows),))]


def _tried(e: Explained) -> list[Section]:
    if not e.views.tried:
        return []
    columns = (
        Column("name", "Added to the plain loop"),
        Column("gain", "Gain", True, "Log likelihood [nat]"),
        Column("net", "After its penalty", True, "Less what its constants and the search cost"),
        Column("said", ""),
    )
    rows = tuple((Cell(r.name), *_gains(r), Cell(_standing(r))) for r in e.views.tried[:SHOWN])
    note = "Each name was fitted with all constants free; the best of so many gains about five nat by chance."
    table = Table("candidates", "", columns, rows, note)
    return [Section("All that was tried", (table,), closed=bool(e.found.accepted))]


def _gains(r: Tried) -> tuple[Cell, Cell]:
    return Cell(str(round(r.gain)), r.gain), Cell(str(round(r.penalised)), r.penalised)


def _standing(r: Tried) -> str:
    if r.taken:
        return "taken"
    return "does not pay" if r.penalised <= 0 else "less, or not proven"


def _controller(e: Explained) -> list[Section]:
    drawn, said, law = e.views.obeyed, e.case.subject.stated, e.found.law
    if drawn is None or said is None or law is None:
        return []
    plot = plots.shape_plot(drawn, "law")
    ti = law.kp / law.ki * e.case.subject.dt_s if law.ki else None
    facts = Facts(
        (
            ("Kp as stated, in percent", number(said.kp)),
            ("Kp that gives OP", number(law.kp)),
            ("Ti as stated", figure(said.ti * e.case.subject.dt_s, "s")),
            ("Ti that gives OP", figure(ti, "s")),
            ("Share of OP explained", share(law.explained)),
        )
    )
    return [Section("Does the controller do what is stated?", (facts, plot), closed=True)]
