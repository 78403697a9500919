"""Beliefs of a store: those of each night follow from the previous night's and from the night, so that neither the
order of runs nor a repeated night matters, and one command recomputes them."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import pyarrow as pa

from analyzer.belief.belief import Belief, belief_of, kept_as, step
from analyzer.belief.inputs import FOLLOWS, all_have_inputs, has_inputs, inputs_of
from analyzer.belief.pool import Pooled
from analyzer.belief.wear import growth, wear
from analyzer.columns import BELIEFS, Row, row_of
from analyzer.columns import names as names_of
from analyzer.config import Config
from analyzer.loop.decisions import CAUSES, Lane
from analyzer.store import notes
from analyzer.store.maintenance import Problem
from analyzer.store.store import Store
from analyzer.store.table import DamagedError, marked, rows_table
from analyzer.words import belief as words
from identification.errors import InputError, NotNowError

Held = tuple[tuple[float | None, float | None], tuple[float, float]]
"""Settings in force, as in loops.csv, and those that nights recommended instead."""
LOOPS_AT_ONCE = 1000
"""Loops whose beliefs are in memory at a time."""
UNREADABLE = (InputError, KeyError, TypeError, ValueError)
"""Exceptions for beliefs that are damaged, or of another version."""
READ = (
    *("loop", "night", "status", "start_s", "duration_s"),
    *("kp", "ti", "form", "gain_unit", "ti_unit", "op_unit"),
    *("oscillation_significance", "oscillating_pct", "period_s", "cause", "valve_fault", "source_loop"),
    *("pv_amplitude_pct", "average_absolute_error_pct"),
    *("master", "lack", *(f"osc_{c}_pct" for c in CAUSES)),
    *("action", "due", "kp_new", "ti_new", "advice", "expected_period_s", "expected_pv_amplitude_pct"),
    *("lanes", "reason", "straight_pct", "witness", "evidence", "settings_changed", "experiment"),
    *("backlash_pct", "stickband_pct", "slip_jump_pct"),
    *("phases", "pv_lo", "pv_hi", "pv_unit", "timezone"),
)
"""Columns from which beliefs are computed."""


class UnreadableError(Exception):
    """Beliefs of a night are damaged, missing, or of another version."""


def update_beliefs(store: Store, night: str, config: Config) -> list[str]:
    """Write the beliefs of a night and of all after it, and of any earlier one without; return sentences on loops
    that failed."""
    names = store.nights()
    first = min([night, *(n for n in names if not store.file("beliefs", n).exists())])
    earlier = [n for n in names if n < first]
    try:
        return _write_all(store, names[len(earlier) :], earlier[-1] if earlier else None, config)
    except UnreadableError:
        return recompute_beliefs(store, config)


def held_pairs(store: Store, night: str) -> dict[str, Held]:
    """Recommended settings of loops before a night; empty if the store has no beliefs before it."""
    earlier, out = [n for n in store.nights() if n < night], {}
    try:
        for loop, state in _states(store, earlier[-1]) if earlier else ():
            if json.loads(state)["told"]["pair"] is not None:
                b = belief_of(state)
                assert b.told.pair is not None
                out[loop] = (b.kp, b.ti), (b.told.pair.kp, b.told.pair.ti)
    except UNREADABLE:
        return {}
    return out


def recompute_beliefs(store: Store, config: Config) -> list[str]:
    """Recompute all beliefs of a store from its nights; return sentences as in `settle`."""
    names = store.nights()
    return _write_all(store, names, names[0] if names else None, config)


def inconsistent_beliefs(store: Store, config: Config) -> list[Problem]:
    """Beliefs of a store that do not follow from its nights; empty if a table of nights is damaged, or an earlier
    version stored no beliefs."""
    if not store.files("beliefs"):
        return []
    names, wrong = store.nights(), set[str]()
    try:
        if _consistent(store, names, config):
            return []
        loops = list(dict.fromkeys(loop for name in names for loop in _loops(store, name, "nights")))
        repaired = _repaired(store)
        for part in in_parts(loops):
            beliefs = _pruned(store, names[0], part)
            for name in names:
                rows, _ = _with_night(store, name, part, beliefs, repaired, config)
                if name not in wrong and not _same(store, name, rows, part):
                    wrong.add(name)
    except (InputError, NotNowError):
        return []
    remedy = "'triage store beliefs' computes them again"
    paths = [store.file("beliefs", night) for night in sorted(wrong)]
    return [Problem(f"{path}: inconsistent with the nights", remedy) for path in paths]


def _consistent(store: Store, names: Sequence[str], config: Config) -> bool:
    """Whether the newest night's beliefs follow from the previous night's, and those of the others carry the digest
    of their inputs, or of the oldest one are about deleted nights; False for a single night."""
    repaired = _repaired(store)
    if len(names) < 2 or not all_have_inputs(store, names, repaired, config):
        return False
    with suppress(UnreadableError):
        whole = has_inputs(store, names[0], None, repaired, config)
        parts = in_parts(_loops(store, names[0], "beliefs"))
        if not (whole or any(_pruned(store, names[0], part) for part in parts)):
            return False
        loops = [*_loops(store, names[-1], "nights"), *_loops(store, names[-2], "beliefs")]
        for part in in_parts(list(dict.fromkeys(loops))):
            known = read_beliefs(store, names[-2], part)
            rows, _ = _with_night(store, names[-1], part, known, repaired, config)
            if not _same(store, names[-1], rows, part):
                return False
        return True
    return False


def _write_all(store: Store, names: Sequence[str], before: str | None, config: Config) -> list[str]:
    """Write the beliefs of nights, oldest first, each from those of the previous night; a first night without a
    previous one starts from its own beliefs about deleted nights."""
    lost: list[str] = []
    repaired = _repaired(store)
    for name in names:
        store.write("beliefs", name, _believed(store, name, before, repaired, config, lost))
        before = name
    return lost


def _believed(
    store: Store,
    name: str,
    before: str | None,
    repaired: Mapping[str, Sequence[float]],
    config: Config,
    lost: list[str],
) -> Iterator[pa.Table]:
    """The beliefs of a night in parts; sentences on loops that failed are added to `lost`."""
    earlier = () if before in (None, name) else _loops(store, before, "beliefs")
    if before == name:
        with suppress(UnreadableError):
            earlier = _loops(store, name, "beliefs")
    digest = inputs_of(store, name, None if before == name else before, repaired, config)
    for part in in_parts(list(dict.fromkeys([*_loops(store, name, "nights"), *earlier]))):
        if before is None:
            known = {}
        else:
            known = _pruned(store, name, part) if before == name else read_beliefs(store, before, part)
        rows, failed = _with_night(store, name, part, known, repaired, config)
        lost += failed
        yield marked(rows_table(rows, BELIEFS), FOLLOWS, digest)


def in_parts(loops: Sequence[str]) -> Iterator[Sequence[str]]:
    """Parts of the loops, as many at a time as memory allows."""
    return (loops[k : k + LOOPS_AT_ONCE] for k in range(0, len(loops), LOOPS_AT_ONCE))


def _loops(store: Store, night: str, table: str) -> list[str]:
    """The loops of a table of a night."""
    try:
        return list(store.read(table, night, ["loop"]).column(0).to_pylist())
    except UNREADABLE as error:
        if table == "nights":
            raise
        raise UnreadableError from error


def _repaired(store: Store) -> dict[str, list[float]]:
    """Times of valve repairs of each loop from notes [s since 1970-01-01 UTC]."""
    return {
        loop: [n.time_s for n in own if words.reports_repair(n.text)]
        for loop, own in notes.read_notes(store.path).items()
    }


def _pruned(store: Store, night: str, loops: Collection[str]) -> dict[str, Belief]:
    """The oldest night's beliefs about earlier nights, which have been deleted."""
    try:
        known = read_beliefs(store, night, loops)
    except UnreadableError:
        return {}
    return {k: b for k, b in known.items() if min(b.valve.since or night, b.cycle.since) < night}


def _same(store: Store, night: str, rows: Sequence[Row], loops: Collection[str]) -> bool:
    try:
        held = store.own_rows("beliefs", night, names_of(BELIEFS), loops)
    except DamagedError:
        return False
    except NotNowError:  # reported for the table itself
        return True
    except InputError:
        return not rows
    return {r["loop"]: r for r in held} == {r["loop"]: row_of(r, BELIEFS) for r in rows}


def _states(store: Store, night: str, loops: Collection[str] | None = None) -> Iterator[tuple[str, str]]:
    """The stored beliefs of some loops of a night, or of all."""
    found = store.own_rows("beliefs", night, ("loop", "state"), loops)
    return ((r["loop"], r["state"]) for r in found)


def read_beliefs(store: Store, night: str, loops: Collection[str] | None = None) -> dict[str, Belief]:
    """The beliefs of some loops of a night, or of all. Raises UnreadableError if there are none that this version can
    read."""
    try:
        return {loop: belief_of(state) for loop, state in _states(store, night, loops)}
    except UNREADABLE as error:
        raise UnreadableError from error


def _with_night(
    store: Store,
    name: str,
    loops: Sequence[str],
    beliefs: dict[str, Belief],
    repaired: Mapping[str, Sequence[float]],
    config: Config,
) -> tuple[list[Row], list[str]]:
    """Update the beliefs of some loops with a night, in place, and return them as rows; and sentences on loops that
    failed."""
    rows = {r["loop"]: r for r in store.own_rows("nights", name, READ, loops)}
    out: list[Row] = []
    lost = []
    for loop in loops:
        before, row = beliefs.get(loop), rows.get(loop)
        # a pruned store's beliefs already include its oldest night
        known_already = before is not None and before.night >= name
        try:
            own = repaired.get(loop, ())
            now = before if row is None or known_already else step(before, row, own, config)
            if now is not None:
                out.append(_belief_row(before, now, row, name, config))
                beliefs[loop] = now
        except Exception as error:  # a failing belief affects that loop alone, never the night
            lost.append(f"{loop}: no belief of night {name} ({type(error).__name__}: {error})")
    return out, lost


def _belief_row(
    before: Belief | None, now: Belief, row: Row | None, night: str, config: Config
) -> dict[str, Any]:
    """A belief as a row: the decision if there is one, figures, and the state for the next night."""
    worn = now.valve.worn_pct(config.belief)
    pools = {name: pool.pooled for name, pool in now.constants.items()}
    known: dict[str, Any] = {
        "loop": now.loop,
        "night": night,
        "believed_nights": float(now.cycle.nights),
        "believed_since": now.cycle.since,
        "worn_pct": worn if now.valve.nights else None,
        "worn_nights": float(now.valve.nights),
        "certain_since": now.valve.certain or None,
        "constants": _constants_kept(pools),
        "state": kept_as(now),
    }
    width = pools.get("width")
    if width is not None:
        known |= {"width_pct": width.value, "width_low_pct": width.low, "width_high_pct": width.high}
    found = wear(now.widths, config.wear) if now.valve.certain else None
    known |= found or {}
    if row is None or now.night != night:
        return known
    grown = [(p, g) for p in now.phases if (g := growth(p, config.wear)) is not None]
    known["growing"] = "; ".join(words.growing(p, g, row) for p, g in grown) or None
    text, tone = words.news(before, now, row)
    if not text and grown and not any(growth(p, config.wear) for p in (before.phases if before else ())):
        text, tone = words.growing(*grown[0], row), "worse"
    lanes = ", ".join(filter(None, (row["lanes"], Lane.WEAR if found is not None else None)))
    reported = words.reported_columns(now, row) | {"lanes": lanes or None}
    return known | reported | {"news": text or None, "news_tone": tone or None}


def _constants_kept(pools: Mapping[str, Pooled | None]) -> str:
    """Pooled constants: value, ends of the 90 % interval, and spread between nights."""
    constants = {
        k: [float(f"{x:.4g}") for x in (p.value, p.low, p.high, p.spread)] for k, p in pools.items() if p
    }
    return json.dumps(constants, separators=(",", ":"))
