"""The page of an explanation: what is wrong, how sure it is, what it looks like, what it could also be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from analyzer.explain import drawings, words
from analyzer.explain.explained import Explained
from analyzer.explain.words import number_text, places, rms, share, title
from analyzer.history.plant_clock import UTC_NAME
from analyzer.pages.words import duration, number, stamp
from identification.mismatch.words import check, located_sentence, seen_ahead, two_plain_loops
from reports.pages import Block, Facts, Page, Section, Table, Text, Tiles
from reports.texts import slug

Data = Mapping[str, Any]
UNTESTED = "The record holds too few memories of the loop for a test of where."
FIT = "Fit % is 100 where the simulation is exact and 0 where the mean does as well; load and noise keep it lower."


def explanation_page(e: Explained, zone: str = UTC_NAME) -> Page:
    """The page of one loop's explanation, with times on the plant's clock."""
    with np.errstate(all="ignore"):  # a model that runs away is drawn as far as it goes
        sections = (
            Section("What it is", _verdict_blocks(e)),
            Section("Recording and simulation", drawings.drawn_trends(e)),
            Section("What was found", _found(e)),
            Section("Where the misfit lives", (*_where_blocks(e.data), drawings.misfit_panels(e))),
            Section(
                "How well it fits", (words.misfits(e.data, _fit_note(e)), *_if_filled(words.others(e.data)))
            ),
            Section("What it could also be", _if_filled(words.alternatives(e.data))),
            Section(
                "All that was tried",
                _if_filled(words.tried(e.found.first, e.found.accepted)),
                closed=bool(e.found.accepted),
            ),
            Section("Does the controller do what is stated?", _controller_blocks(e), closed=True),
        )
    spec = e.case.spec
    about = [spec.description, spec.type, spec.area, _recorded_line(e, zone)]
    return Page(
        f"{slug(spec.loop)}-explained",
        f"{spec.loop}: {title(e.said.verdict)}",
        ", ".join(a for a in about if a),
        tuple(s for s in sections if s.blocks),
        footer=_footer(e),
        zone=zone,
    )


def abstention(data: Data) -> Page:
    """The page of a loop whose recording cannot be explained at all."""
    text = Text((data["reason"][:1].upper() + data["reason"][1:] + ".",), "lead")
    name = f"{slug(data['loop'])}-explained"
    return Page(name, f"{data['loop']}: not told", "", (Section("What is missing", (text,)),))


def _recorded_line(e: Explained, zone: str) -> str:
    r = e.case.prepared.record
    begun, length = f"{stamp(r.start_s, zone)} {zone}", duration(len(r) * r.dt_s)
    return f"{begun}, {length}, a sample each {number_text(r.dt_s, 's')}"


def _footer(e: Explained) -> str:
    s = e.case.prepared.scale
    unit = f" {e.case.spec.pv_unit}" if e.case.spec.pv_unit else ""
    how = "of the recorded range, for none is stated, " if s.recorded else ""
    pv = f"{number_text(s.low)} to {number_text(s.low + s.span)}{unit}"
    op = f"{number_text(s.op_low)} to {number_text(s.op_low + s.op_span)}"
    return f"Percent of PV are {how}{pv}; percent of OP of {op}. Intervals are 90 %."


def _if_filled(table: Table) -> tuple[Block, ...]:
    return (table,) if table.rows else ()


def _verdict_blocks(e: Explained) -> tuple[Block, ...]:
    brought = [] if e.brought is None else [Text((e.brought.note,))]
    return (Text((e.data["reason"],), "lead"), Text((check(e.data),)), *brought, Tiles(tuple(_tiles(e))))


def _tiles(e: Explained) -> list[tuple[str, str, str]]:
    d, (plain, better) = e.data, e.found.proven.overall
    seat = "where to look first" if d["verdict"] == "unexplained" else "where it sits"
    tiles = [(d["block"], seat, "")] if d["block"] != "none" else []
    if e.found.accepted:
        horizon = d["fit"]["horizon_s"]
        over = f"within windows of {duration(horizon)}" if horizon else "over the recording"
        less = "better" if e.found.proven.falls else ""
        tiles.append(
            (f"{rms(plain.rmse)} → {rms(better.rmse)}", f"rms misfit {over}, plain and improved", less)
        )
    else:
        rest = ": load and noise" if d["verdict"] == "none" else ""
        tiles.append((rms(plain.rmse), f"rms misfit of the plain simulation{rest}", ""))
    held = next((x["held_out_share"] for x in d["effects"] if x["held_out_share"] is not None), None)
    if held is not None:
        tiles.append((share(held), "of the misfit on held-out data removed", "better"))
    others = d["effects"][0]["alternatives"] if d["effects"] else []
    if others:
        tiles.append((str(len(others)), "other names fit as well or look alike", "incomparable"))
    return tiles


def _found(e: Explained) -> tuple[Block, ...]:
    drawn = drawings.found_plot(e)
    told = (*_if_filled(words.parameters(e.data)), *_if_filled(words.moved(e.data)))
    return told if drawn is None else (drawn, *told)


def _where_blocks(data: Data) -> tuple[Block, ...]:
    where = data["where"]
    signals = [("Signals", ", ".join(where["signals"]))] if where.get("signals") else []
    facts = (*signals, *places(where))
    told = (Facts(facts),) if facts else ()
    if not where.get("features"):
        return (*told, Text((UNTESTED,), "note"))
    return (Text((located_sentence(where),)), *told, words.features(data))


def _fit_note(e: Explained) -> str:
    fit, held_out = e.data["fit"], e.found.p.limits.proof.held_out
    held = f"the last {100 * held_out:.0f} % of the recording, on which models fitted to the first part are judged"
    if e.found.others:
        held = "the other recordings below, on which nothing but a constant bias was fitted"
    horizon = fit["horizon_s"] and duration(fit["horizon_s"])
    anew = (
        f"The simulations begin anew every {horizon}, so that slow load does not drown them."
        if horizon
        else ""
    )
    parts = (f"Held out: {held}.", FIT, anew, seen_ahead(fit), two_plain_loops(fit))
    return " ".join(part for part in parts if part)


def _controller_blocks(e: Explained) -> tuple[Block, ...]:
    drawn, s, law = drawings.law_plot(e), e.case.subject, e.found.law
    if drawn is None or s.stated is None or law is None:
        return ()
    ti_s = law.kp / law.ki * s.dt_s if law.ki else None
    facts = (
        ("Kp as stated, in percent", number(s.stated.kp)),
        ("Kp that gives OP", number(law.kp)),
        ("Ti as stated", number_text(s.stated.ti * s.dt_s, "s")),
        ("Ti that gives OP", number_text(ti_s, "s")),
        ("Share of OP explained", share(law.explained)),
    )
    return (Facts(facts), drawn)
