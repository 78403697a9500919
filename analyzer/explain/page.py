"""The page of an explanation: the effect, its confidence, its pictures, and the alternatives."""

from __future__ import annotations

import numpy as np

from analyzer.explain import drawings, words
from analyzer.explain.explained import Explained
from analyzer.explain.words import NOTES, Data, number_text, places, rms, share, title
from analyzer.history.plant_clock import UTC_NAME
from analyzer.pages.words import duration, number, stamp
from analyzer.words.decision import decided
from identification.mismatch.starts import HELD_OUT
from identification.mismatch.words import check, located_sentence, remarks
from reports.pages import Block, Facts, Page, Section, Table, Text, Tiles
from reports.texts import slug


def explanation_page(e: Explained, zone: str = UTC_NAME) -> Page:
    """The page of one loop's explanation, with times on the plant's clock."""
    data, named = e.data, bool(e.found.accepted)
    with np.errstate(all="ignore"):  # a diverging model is drawn as far as it is finite
        sections = (
            _section("What it is", *_verdict_blocks(e)),
            _section("Recording and simulation", *drawings.drawn_trends(e)),
            _section("What was found", drawings.found_plot(e), words.parameters(data), words.moved(data)),
            _section("Where the misfit is", *_where_blocks(data), drawings.misfit_panels(e)),
            _section("How well it fits", words.misfits(data, _fit_note(e)), words.others(data)),
            _section("What it could also be", words.alternatives(data)),
            _section("All candidates", words.tried(e.found.first, e.found.accepted), closed=named),
            _section("Does the controller do what is stated?", *_controller_blocks(e), closed=True),
        )
    spec = e.case.spec
    about = [spec.description, spec.type, spec.area, _recorded_line(e, zone)]
    return Page(
        f"{slug(spec.loop)}-explained",
        f"{spec.loop}: {title(e.said.verdict)}",
        ", ".join(filter(None, about)),
        tuple(s for s in sections if s.blocks),
        footer=_footer(e),
        zone=zone,
    )


def _section(name: str, *blocks: Block | None, closed: bool = False) -> Section:
    """A section of the given blocks, without missing pictures and without tables that have no rows."""
    shown = (b for b in blocks if b is not None and (not isinstance(b, Table) or b.rows))
    return Section(name, tuple(shown), closed=closed)


def abstention(data: Data) -> Page:
    """The page of a loop whose recording cannot be explained at all."""
    text = Text((data["reason"][:1].upper() + data["reason"][1:] + ".",), "lead")
    name = f"{slug(data['loop'])}-explained"
    return Page(name, f"{data['loop']}: not explained", "", (Section("What is missing", (text,)),))


def _recorded_line(e: Explained, zone: str) -> str:
    r = e.case.prepared.record
    begun, length = f"{stamp(r.start_s, zone)} {zone}", duration(len(r) * r.dt_s)
    return f"{begun}, {length}, a sample each {number_text(r.dt_s, 's')}"


def _footer(e: Explained) -> str:
    s = e.case.prepared.scale
    unit = f" {e.case.spec.pv_unit}" if e.case.spec.pv_unit else ""
    how = "of the recorded range because none is stated, " if s.recorded else ""
    pv = f"{number_text(s.low)} to {number_text(s.low + s.span)}{unit}"
    op = f"{number_text(s.op_low)} to {number_text(s.op_low + s.op_span)}"
    return f"Percent of PV are {how}{pv}; percent of OP of {op}. Intervals are 90 %."


def _verdict_blocks(e: Explained) -> tuple[Block | None, ...]:
    user_model = None if e.user_model is None else Text((e.user_model.note,))
    night = e.data.get("night")
    first = None if night is None else Text((decided(e.data),), "lead")
    night_note = "" if night is None else words.night_note(night, e.data["verdict"], e.data["block"])
    texts = tuple(
        filter(None, (words.improvement(e.data), night_note, words.no_better(e.data), check(e.data)))
    )
    return first, Text((e.data["reason"],), "lead"), Text(texts), user_model, Tiles(tuple(_tiles(e)))


def _tiles(e: Explained) -> list[tuple[str, str, str]]:
    d, (plain, _) = e.data, e.found.proven.overall
    seat = "where to look first" if d["verdict"] == "unexplained" else "block of the effect"
    tiles = [(d["block"], seat, "")] if d["block"] != "none" else []
    if e.found.accepted and words.improves(d):
        both, where = " → ".join(map(rms, words.held_out(d))), "in its band, " if d["fit"]["in_band"] else ""
        tiles.append((both, f"rms misfit on held-out data, {where}baseline and improved", "better"))
    else:
        rest = ": load and noise" if d["verdict"] == "none" else ""
        tiles.append((rms(plain.rmse), f"rms misfit of the baseline model{rest}", ""))
    held = next((x["held_out_share"] for x in d["effects"] if x["held_out_share"] is not None), None)
    if held is not None and not words.no_better(d):
        tiles.append((share(held), "of the misfit on held-out data removed", "better"))
    for first in d["effects"][:1]:
        if first["alternatives"]:
            alike = "other effects fit as well or are indistinguishable"
            tiles.append((str(len(first["alternatives"])), alike, "incomparable"))
    return tiles


def _where_blocks(data: Data) -> tuple[Block, ...]:
    where = data["where"]
    signals = [("Signals", ", ".join(where["signals"]))] if where.get("signals") else []
    facts = (*signals, *places(where))
    shown = (Facts(facts),) if facts else ()
    if not where.get("features"):
        return (*shown, Text((NOTES["untested"],), "note"))
    return (Text((located_sentence(where),)), *shown, words.features(data))


def _fit_note(e: Explained) -> str:
    fit, share_held = e.data["fit"], 100 * HELD_OUT
    held = NOTES["other_recordings" if e.found.others else "last_part"].format(share=share_held)
    horizon = fit["horizon_s"] and duration(fit["horizon_s"])
    refitted = NOTES["anew"].format(horizon=horizon) if horizon else ""
    return " ".join(filter(None, (held, NOTES["fit"], refitted, *remarks(fit))))


def _controller_blocks(e: Explained) -> tuple[Block, ...]:
    drawn, s, law = drawings.law_plot(e), e.case.recording, e.found.law
    if drawn is None or s.stated is None or law is None:
        return ()
    ti_s = law.kp / law.ki * s.dt_s if law.ki else None
    facts = (
        ("Kp as stated, in percent", number(s.stated.kp)),
        ("Kp identified, in percent", number(law.kp)),
        ("Ti as stated", number_text(s.stated.ti * s.dt_s, "s")),
        ("Ti identified", number_text(ti_s, "s")),
        ("Share of OP explained", share(law.explained)),
    )
    return (Facts(facts), drawn)
