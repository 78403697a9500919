"""A draft of loops.csv: stated loops, loops by tag names, and loops by data for the other tags."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from analyzer.finder.as_csv import SETTINGS, Row
from analyzer.finder.clock import Sampled, sampled
from analyzer.finder.held import LIMITED_SHARE
from analyzer.finder.law import LEAST_BLOCKS
from analyzer.finder.pair import LEAST_LAW_SHARE, SURE_PCT, SUREST_PCT, FoundPair, known_pair
from analyzer.finder.pairs import found_pairs
from analyzer.finder.position_and_mode import may_be_mode, modes, positions
from analyzer.finder.relations import at_rest, equal_at_times, halves, masters_of, ratios_to, scan_of
from analyzer.finder.terms import terms_of
from analyzer.history.export import Export
from analyzer.loops.spec import RECORDED, ROLES, STATED, LoopSpec
from analyzer.loops.tags import find_loops, match

MA_LOW = 3.8
"""Least value of a signal of 4 to 20 mA [mA]. Source: NAMUR NE 43: 3.8 to 20.5 mA are measured values."""
MA_HIGH = 20.5  # Largest value of it [mA]. Source: NAMUR NE 43


FAST_S = 30.0
"""Integral time up to which a loop is as fast as a flow or a pressure [s]; usual flow loops have 3 to 30 s (Corripio,
Tuning of Industrial Control Systems, 2000)."""
UNIT = re.compile(r"[(\[]\s*([^()\[\]\d][^()\[\]]{0,14}?)\s*[)\]]\s*$")
ISA_NAME = re.compile(rf"(?<![A-Za-z])([{''.join(STATED['types'])}])(?:D?[IRT]?C[AV]?|[IT]{{1,2}})[-_ ]?\d")
WITHIN_PCT = 5.0
"""Tolerance of an OP in percent below 0 and above 100."""
MOST_NAMES = 5
"""Maximum number of loops listed in a note."""


def draft(
    export: Export,
    stated: Sequence[LoopSpec] = (),
    span: tuple[float, float] = (-math.inf, math.inf),
    report: Callable[[int, int], None] = lambda done, total: None,
) -> list[Row]:
    """The loops of an export: stated ones unchanged, others by names, then by data of the remaining tags.

    span : of time, of which the last day is used [s since 1970-01-01 UTC]; report : called with the number of tags
    read, and of all. Raises InputError where the export cannot be read.
    """
    taken = {tag for spec in stated for tag in spec.tags}
    open_ones = [s for s in match(stated, export.tags)[0] if s.kp is None or s.ti is None]
    named = [
        s for s in find_loops(export.tags) if s.pv not in taken and s.loop not in {r.loop for r in stated}
    ]
    whole = [spec for spec in named if spec.op is not None]
    taken |= {tag for spec in whole for tag in spec.tags}
    free = [tag for tag in export.tags if tag not in taken]
    tags = [*free, *(tag for spec in (*whole, *open_ones) for tag in spec.tags)]
    samples = sampled(export, list(dict.fromkeys(tags)), span, report)
    recorded = {spec.loop: spec for spec in open_ones}
    rows = [_stated(samples, spec, recorded.get(spec.loop)) for spec in stated]
    rows += [_named(samples, spec) for spec in whole]
    found = by_data(samples.of(free))
    rows += _joined(found, [spec for spec in named if spec.op is None])
    return _without_ranges_of_currents(samples, _with_relations(samples, rows))


def _with_relations(samples: Sampled, rows: Sequence[Row]) -> list[Row]:
    """The rows with what the data show of each found loop beyond its own tags: a ratio, the scan, its rests, and
    candidates for a valve that it shares."""
    own = [k for k, row in enumerate(rows) if row.found_by in ("names", "data") and row.sure]
    own = [k for k in own if rows[k].spec.pv in samples.tags and rows[k].spec.op in samples.tags]
    if not own or len(samples.values) < LEAST_BLOCKS:
        return list(rows)
    specs = [rows[k].spec for k in own]
    pvs, ops = (samples.of([str(getattr(s, role)) for s in specs]).values for role in ("pv", "op"))
    taken = {tag for s in specs for tag in s.tags}
    others = samples.of([tag for tag in samples.tags if tag not in taken])
    halves_of, out, led = halves(ops, others.values), list(rows), _with_leaders(samples, specs, pvs, ops)
    selects: dict[int, list[int]] = {}
    for i, j in equal_at_times(ops):
        selects.setdefault(i, []).append(j)
        selects.setdefault(j, []).append(i)
    for i, k in enumerate(own):
        notes = [rows[k].evidence]
        if selects.get(i):
            notes.append(
                f"OP at times that of {', '.join(specs[j].loop for j in selects[i])}: override_with?"
            )
        if halves_of.get(i):
            notes.append(f"{', '.join(others.tags[j] for j in halves_of[i])}: a half of its split range?")
        resting = at_rest(ops[:, i])
        if resting >= LIMITED_SHARE:
            notes.append(f"OP is constant for {100 * resting:.0f} % of the time: in manual, or at a limit")
        scan = scan_of(ops[:, i])
        if scan is not None:
            notes.append(f"OP moves every {scan * samples.dt_s:g} s: scan_s?")
        out[k] = replace(rows[k], spec=led[i], evidence="; ".join(notes))
    return out


def _with_leaders(
    samples: Sampled, specs: Sequence[LoopSpec], pvs: np.ndarray, ops: np.ndarray
) -> list[LoopSpec]:
    """The rows of loops with their masters, or the loops to whose PVs their set points keep a ratio."""
    led = [i for i, s in enumerate(specs) if s.sp in samples.tags and not s.master]
    if not led or len(specs) < 2:
        return list(specs)
    set_points, out = samples.of([str(specs[i].sp) for i in led]).values, list(specs)
    masters, leaders = masters_of(set_points, ops, led), ratios_to(set_points, pvs, led)
    for i, master, leader in zip(led, masters, leaders, strict=True):
        if master is not None:
            out[i] = replace(specs[i], master=specs[master].loop)
        elif leader is not None:
            out[i] = replace(specs[i], ratio_of=specs[leader].loop)
    return out


def _without_ranges_of_currents(samples: Sampled, rows: Sequence[Row]) -> list[Row]:
    """The rows, without a range of OP if the OPs of all found loops lie within a signal of 4 to 20 mA, as `run` takes
    them (opened.in_milliamperes): a draft that states 0 to 100 would make it percent."""
    own = {row.spec.loop for row in rows if row.found_by in ("names", "data") and row.spec.op in samples.tags}
    found = [row for row in rows if row.spec.loop in own]
    if len(found) < 2 or not len(samples.values):
        return list(rows)
    outputs = samples.of([str(row.spec.op) for row in found]).values
    if not (outputs.min() >= MA_LOW and outputs.max() <= MA_HIGH):
        return list(rows)
    note = "its values lie between 4 and 20, like mA: state op_lo and op_hi"
    return [
        replace(row, evidence=f"{row.evidence}; {row.spec.op}: {note}", op_ranged=False)
        if row.spec.loop in own
        else row
        for row in rows
    ]


def _named(samples: Sampled, spec: LoopSpec) -> Row:
    """A loop by names, with type, ranges and settings from its data."""
    evidence = f"tags of one name: {', '.join(spec.tags)}"
    known = [tag for tag in (spec.pv, spec.op, spec.sp) if tag in samples.tags]
    if known[:2] != [spec.pv, spec.op] or len(samples.values) < LEAST_BLOCKS:
        return Row(spec, "names", SUREST_PCT, evidence)
    own = samples.of(known)
    pair = known_pair(own.values)
    shown = _shown(own, pair)
    law = f"; {_law(own, pair)}" if pair.law_share >= LEAST_LAW_SHARE and pair.kp else ""
    found = replace(spec, type=type_of(spec.loop), pv_unit=unit_of(str(spec.pv)), **shown)
    return Row(found, "names", SUREST_PCT, evidence + law + _beyond(shown, found.type))


def _stated(samples: Sampled, spec: LoopSpec, with_tags: LoopSpec | None) -> Row:
    """A stated loop; if it has tags but no settings, with the settings from its data."""
    own_tags = () if with_tags is None else (with_tags.pv, with_tags.op, with_tags.sp)
    known = [tag for tag in own_tags if tag is not None and tag in samples.tags]
    if len(known) < 2 or len(samples.values) < LEAST_BLOCKS:
        return Row(spec, "stated", 100.0, "stated")
    own = samples.of(known)
    pair = known_pair(own.values)
    shown = _shown(own, pair)
    if "kp" not in shown:
        return Row(spec, "stated", 100.0, f"stated; no settings: {_law(own, pair)}")
    settings = {name: shown[name] for name in SETTINGS if name in shown}
    found = replace(spec, **settings, ti_unit="s", stated=spec.stated | {*settings, "ti_unit"})
    return Row(found, RECORDED, SURE_PCT, f"stated except for its settings; {_law(own, pair)}")


def found_text(rows: Sequence[Row]) -> tuple[str, ...]:
    """Sentences on the loops found by data, and on those left out because of low confidence."""
    seen = [row for row in rows if row.found_by == "data"]
    sure = tuple(
        f"{row.spec.loop}: found by data, {row.sure_pct:.0f} % sure: {row.evidence}"
        for row in seen
        if row.sure
    )
    other = [row.spec.loop for row in seen if not row.sure]
    names = ", ".join(other[:MOST_NAMES]) + (" ..." if len(other) > MOST_NAMES else "")
    unsure = f"{len(other)} loops are less sure and left out ({names}); 'triage loops' writes the evidence for them"
    return (*sure, unsure) if other else sure


def by_data(samples: Sampled) -> list[Row]:
    """Loops found in the data of tags, with the position and the mode of the confident ones."""
    pairs = found_pairs(samples.values)
    sure = [p for p in pairs if p.sure_pct >= SURE_PCT]
    outputs = {samples.values[:, p.op].tobytes(): _name(samples.tags[p.pv], samples.tags[p.op]) for p in sure}
    further = _position_and_mode(samples, sure)
    return [_row(samples, pair, outputs, further.get(pair.op, {}) if pair in sure else {}) for pair in pairs]


def _position_and_mode(samples: Sampled, sure: Sequence[FoundPair]) -> dict[int, dict[str, str]]:
    """Tags of position and mode of the confident loops, by the index of OP."""
    own = {k for p in sure for k in (p.pv, p.op, p.sp)}
    others = [k for k in range(len(samples.tags)) if k not in own]
    found: dict[int, dict[str, str]] = {p.op: {} for p in sure}
    for op, k in positions(samples.values, list(found), others).items():
        found[op]["position"] = samples.tags[k]
    candidates = {samples.tags[k]: samples.values[:, k] for k in others} | dict(samples.texts)
    names = [name for name, tag in candidates.items() if may_be_mode(tag)]
    moves = {op: samples.values[:, op] for op in found}
    for op, k in modes(moves, [candidates[name] for name in names]).items():
        found[op]["mode"] = names[k]
    return found


def _row(samples: Sampled, pair: FoundPair, outputs: dict[bytes, str], further: dict[str, str]) -> Row:
    name = _name(samples.tags[pair.pv], samples.tags[pair.op])
    master = "" if pair.sp is None else outputs.get(samples.values[:, pair.sp].tobytes(), "")
    spec = LoopSpec(
        name,
        type=type_of(samples.tags[pair.pv]),
        pv_unit=unit_of(samples.tags[pair.pv]),
        master="" if master == name else master,
        sp=None if pair.sp is None else samples.tags[pair.sp],
        pv=samples.tags[pair.pv],
        op=samples.tags[pair.op],
        position=further.get("position"),
        mode=further.get("mode"),
    )
    evidence = (
        f"{_law(samples, pair)}; {100 * pair.noise:.0f} % of their noise is common; the next best tag has "
    )
    evidence += f"{100 * pair.runner_up / max(pair.weight, 1e-9):.0f} % of this pair's weight"
    evidence += "" if pair.sp is None else f"; {spec.sp} is where PV is held"
    evidence += f"; {spec.op} moves at once when {spec.sp} does" if pair.answers else ""
    evidence += f"; {spec.position} has the value of {spec.op}" if spec.position else ""
    evidence += f"; {spec.op} is constant only in one value of {spec.mode}" if spec.mode else ""
    shown = _shown(samples, pair, pair.sure_pct >= SURE_PCT)
    return Row(replace(spec, **shown), "data", pair.sure_pct, evidence + _beyond(shown, spec.type))


def _shown(samples: Sampled, pair: FoundPair, certain: bool = True) -> dict[str, Any]:
    """Columns of loops.csv from the data of a loop: recorded ranges, and settings if the law is clear; derivative and
    filter of a pair that is certain."""
    pv, op = (samples.values[:, k] for k in (pair.pv, pair.op))
    (pv_lo, pv_hi), (op_lo, op_hi) = _extremes(pv), _extremes(op)
    if op.min() >= -WITHIN_PCT and op.max() <= 100.0 + WITHIN_PCT:
        op_lo, op_hi = 0.0, 100.0
    shown: dict[str, Any] = {"pv_lo": pv_lo, "pv_hi": pv_hi, "op_lo": op_lo, "op_hi": op_hi}
    terms = _terms(samples, pair, (pv_lo, pv_hi), (op_lo, op_hi)) if certain else {}
    if terms:
        return {**shown, **terms}
    if pair.law_share < LEAST_LAW_SHARE or not pair.kp or pair.ti_samples is None:
        return shown
    ti = 0.0 if math.isinf(pair.ti_samples) else pair.ti_samples * samples.dt_s
    return {**shown, "kp": pair.kp, "ti": ti, "gain_unit": "engineering"}


def _terms(
    samples: Sampled, pair: FoundPair, pv_range: tuple[float, float], op_range: tuple[float, float]
) -> dict[str, Any]:
    """The settings of a controller with a derivative or a filter of PV; nothing for any other."""
    if pair.sp is None:
        return {}
    spans = pv_range[1] - pv_range[0], op_range[1] - op_range[0]
    sp, pv = (100.0 * (samples.values[:, k] - pv_range[0]) / spans[0] for k in (pair.sp, pair.pv))
    found = terms_of(sp, pv, 100.0 * (samples.values[:, pair.op] - op_range[0]) / spans[1], samples.dt_s)
    if found is None:
        return {}
    more = {"td": found.td_s, "td_filter": found.td_filter} if found.td_s else {}
    more |= {"pv_filter_s": found.pv_filter_s} if found.pv_filter_s else {}
    ti = 0.0 if math.isinf(found.ti_s) else found.ti_s
    return {"kp": found.kp * spans[1] / spans[0], "ti": ti, "gain_unit": "engineering", **more}


def _law(samples: Sampled, pair: FoundPair) -> str:
    """The law of a pair, in words."""
    action = "direct" if pair.kp < 0 else "reverse"
    law = (
        f"{'P alone' if pair.ti_samples == math.inf else 'PI'}, {action} acting"
        if pair.law_share
        else "of unknown sign"
    )
    shown = f"explains {100 * pair.law:.0f} % of its moves"
    return f"{samples.tags[pair.op]} follows {samples.tags[pair.pv]} by a law ({law}) that {shown}"


def _beyond(shown: dict[str, Any], kind: str) -> str:
    """What else the settings show: further terms, and a fast loop whose type no name states."""
    text = f"; a derivative of {shown['td']:.3g} s" if "td" in shown else ""
    text += f"; a filter of PV of {shown['pv_filter_s']:.3g} s" if "pv_filter_s" in shown else ""
    if not kind and 0.0 < shown.get("ti", 0.0) <= FAST_S:
        text += f"; its integral time is {shown['ti']:.2g} s, as in a flow or pressure loop: type?"
    return text


def _joined(found: Sequence[Row], open_loops: Sequence[LoopSpec]) -> list[Row]:
    """Loops whose OP is not clear by name, with the OP found by data; and the loops found by data alone."""
    by_pv = {row.spec.pv: row for row in found}
    rows = []
    for spec in open_loops:
        seen = by_pv.pop(spec.pv, None)
        if seen is None:
            rows.append(Row(spec, "names", SUREST_PCT, "a PV by its name; no OP is seen"))
            continue
        known = {role: getattr(spec, role) or getattr(seen.spec, role) for role in ROLES}
        rows.append(replace(seen, spec=replace(seen.spec, loop=spec.loop, **known)))
    return [*rows, *by_pv.values()]


def _name(pv: str, op: str) -> str:
    """The common prefix of both tags, if it is a name; else PV's tag."""
    differs_at = next(
        (k for k, (a, b) in enumerate(zip(pv, op, strict=False)) if a != b), min(len(pv), len(op))
    )
    shared = pv[:differs_at].rstrip("._:/- ")
    whole = all(len(tag) == len(shared) or not tag[len(shared)].isalnum() for tag in (pv, op))
    return shared if len(shared) > 2 and whole else pv


def type_of(tag: str) -> str:
    """The type of a loop by the first letter of its ISA name (FIC101: a flow); '' if unknown."""
    letters = ISA_NAME.search(tag)
    return "" if letters is None else str(STATED["types"][letters[1]])


def unit_of(tag: str) -> str:
    """The unit in brackets at the end of a tag's name, as in 'PV FIC101 (m3/h)'; '' without one."""
    unit = UNIT.search(tag)
    return "" if unit is None or unit[1].upper() in ("PV", "SP", "OP", "CV", "MV") else unit[1]


def _extremes(x: np.ndarray) -> tuple[float, float]:
    """Minimum and maximum of the recorded values, in few digits; different even for a constant."""
    low, high = (float(f"{v:.4g}") for v in (x.min(), x.max()))
    return (low, high) if high > low else (low - 0.5, low + 0.5)
