"""Beliefs of a store: each night's follow from those of the night before it and from the night, so that neither the
order of runs nor a night run twice matters, and one command makes them anew."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from analyzer.belief.belief import Belief, belief_of, kept_as, step
from analyzer.belief.pool import Pooled
from analyzer.belief.wear import growth, wear
from analyzer.columns import BELIEFS, Row, row_of
from analyzer.config import Config
from analyzer.loop.decisions import CAUSES, Lane
from analyzer.store import notes
from analyzer.store.care import Problem
from analyzer.store.store import Store
from analyzer.store.table import DamagedError, rows_table
from analyzer.words import belief as words
from identification.errors import InputError, NotNowError

Held = tuple[tuple[float | None, float | None], tuple[float, float]]
"""Settings in force, as loops.csv states them, and those that nights have told to type in instead."""
Followed = tuple[str, Sequence[Row], Sequence[str]]
"""A night, the rows of its beliefs, and sentences on loops of which they failed."""
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
"""What beliefs follow from."""


def settle(store: Store, night: str, config: Config) -> list[str]:
    """Write the beliefs of a night and of all after it, and of any before that has none; sentences on loops of which
    that failed."""
    names = store.nights()
    first = min([night, *(n for n in names if not store.file("beliefs", n).exists())])
    known = _beliefs_before(store, first)
    if known is None:
        return settle_anew(store, config)
    return _write_all(store, _followed(store, [n for n in names if n >= first], known, config))


def _beliefs_before(store: Store, night: str) -> dict[str, Belief] | None:
    """What was believed before a night, nothing of the first of all; None where that cannot be read."""
    earlier = [n for n in store.nights() if n < night]
    return read_beliefs(store, earlier[-1]) if earlier else {}


def held_pairs(store: Store, night: str) -> dict[str, Held]:
    """Settings that are told of loops before a night; none where the store has no beliefs before it."""
    told = [(loop, b.told.pair, b) for loop, b in (_beliefs_before(store, night) or {}).items()]
    return {loop: ((b.kp, b.ti), (pair.kp, pair.ti)) for loop, pair, b in told if pair is not None}


def settle_anew(store: Store, config: Config) -> list[str]:
    """Make all beliefs of a store anew from its nights; sentences as of `settle`."""
    return _write_all(store, _followed_anew(store, config))


def _followed_anew(store: Store, config: Config) -> Iterator[Followed]:
    """All nights with their beliefs, from what the oldest knew of nights before it, which have been deleted."""
    names = store.nights()
    known = (read_beliefs(store, names[0]) if names else None) or {}
    pruned = {k: b for k, b in known.items() if min(b.valve.since or names[0], b.cycle.since) < names[0]}
    return _followed(store, names, pruned, config)


def unfounded(store: Store, config: Config) -> list[Problem]:
    """Beliefs of a store that do not follow from its nights; none where a table of nights is damaged, or an earlier
    version kept no beliefs."""
    if not store.files("beliefs"):
        return []
    try:
        followed = list(_followed_anew(store, config))
    except (InputError, NotNowError):
        return []
    remedy = "'triage store beliefs' makes them anew"
    paths = [store.file("beliefs", night) for night, rows, _ in followed if not _same(store, night, rows)]
    return [Problem(f"{path}: not what the nights say", remedy) for path in paths]


def _write_all(store: Store, followed: Iterator[Followed]) -> list[str]:
    lost: list[str] = []
    for night, rows, more in followed:
        store.write("beliefs", night, rows_table(rows, BELIEFS))
        lost += more
    return lost


def _same(store: Store, night: str, rows: Sequence[Row]) -> bool:
    try:
        held = store.read_if_there("beliefs", night)
    except DamagedError:
        return False
    except NotNowError:  # said of the table itself
        return True
    kept = [] if held is None else held.to_pylist()
    return {r["loop"]: r for r in kept} == {r["loop"]: row_of(r, BELIEFS) for r in rows}


def read_beliefs(store: Store, night: str) -> dict[str, Belief] | None:
    """The beliefs of a night by loop; None where there are none that this version can read."""
    try:
        rows = store.read("beliefs", night, ["loop", "state"]).to_pylist()
        return {r["loop"]: belief_of(r["state"]) for r in rows}
    except (InputError, KeyError, TypeError, ValueError):  # damaged, or of another version
        return None


def _followed(
    store: Store, names: Sequence[str], known: Mapping[str, Belief], config: Config
) -> Iterator[Followed]:
    """Nights, oldest first, with their beliefs, from what was believed before them."""
    beliefs = dict(known)
    repaired = {
        loop: [n.time_s for n in own if words.says_repaired(n.text)]
        for loop, own in notes.read_notes(store.path).items()
    }
    for name in names:
        rows = {r["loop"]: r for r in store.own_rows("nights", name, READ)}
        out, lost = [], []
        for loop in (*rows, *(k for k in beliefs if k not in rows)):
            before, row = beliefs.get(loop), rows.get(loop)
            # what a pruned store knew of its oldest night is not counted again
            known_already = before is not None and before.night >= name
            try:
                own = repaired.get(loop, ())
                now = before if row is None or known_already else step(before, row, own, config)
                if now is not None:
                    out.append(_belief_row(before, now, row, name, config))
                    beliefs[loop] = now
            except Exception as error:  # a belief that fails is that loop's alone, and never the night's end
                lost.append(f"{loop}: no belief of night {name} ({type(error).__name__}: {error})")
        yield name, out, lost


def _belief_row(
    before: Belief | None, now: Belief, row: Row | None, night: str, config: Config
) -> dict[str, Any]:
    """A belief as a row: what is told where the night tells anything, figures, and what the next night goes on
    from."""
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
    told = words.told(now, row) | {"lanes": lanes or None}
    return known | told | {"news": text or None, "news_tone": tone or None}


def _constants_kept(pools: Mapping[str, Pooled | None]) -> str:
    """Pooled constants: value, ends of the 90 % interval, and spread between nights."""
    said = {k: [float(f"{x:.4g}") for x in (p.value, p.low, p.high, p.spread)] for k, p in pools.items() if p}
    return json.dumps(said, separators=(",", ":"))
