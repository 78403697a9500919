"""A belief as text and back: what the belief of the next night goes on from."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from analyzer.belief.belief import Belief, Calm, Told
from analyzer.belief.cycle import CycleBelief
from analyzer.belief.phases import PhaseKnown
from analyzer.belief.pool import Pool
from analyzer.belief.remedy import Pair, RemedyBelief
from analyzer.belief.valve import ValveBelief
from analyzer.loop.decisions import Action, Cause, Due, Fault

PROFILES = ("alone", "summed", "best")
"""What a belief in a valve says of each width."""


def kept_as(belief: Belief) -> str:
    """A belief as the store keeps it (JSON)."""
    return json.dumps(asdict(belief), separators=(",", ":"))


def belief_of(text: str) -> Belief:
    """A belief as the store kept it; KeyError, TypeError or ValueError where another version wrote it."""
    kept = json.loads(text)
    cycle, remedy, told = kept["cycle"], kept["remedy"], kept["told"]
    valve = kept["valve"]
    recent = tuple((n, tuple(p)) for n, p in valve["recent"])
    return Belief(
        kept["loop"],
        kept["night"],
        kept["end_s"],
        kept["kp"],
        kept["ti"],
        ValveBelief(**{**valve, **{k: tuple(valve[k]) for k in PROFILES}, "recent": recent}),
        CycleBelief(**{**cycle, "odds": tuple(cycle["odds"]), "cause": Cause(cycle["cause"])}),
        RemedyBelief(
            {Action(a): v for a, v in remedy["votes"].items()},
            tuple(Pair(**p) for p in remedy["pairs"]),
            _value(Action, remedy["action"]),
            _pair(remedy["held"]),
            remedy["advised"],
            remedy["settled"],
        ),
        {k: Pool(**p) for k, p in kept["constants"].items()},
        tuple((n, w, s) for n, w, s in kept["widths"]),
        _calm(kept["before"]),
        _calm(kept["last"]),
        Told(
            Cause(told["cause"]),
            {Cause(c): p for c, p in told["confidence"].items()},
            Fault(told["fault"]),
            told["source"],
            _value(Action, told["action"]),
            _value(Due, told["due"]),
            _pair(told["pair"]),
            told["own"],
            told["calmed"],
        ),
        kept["straight_pct"],
        kept["recorder"],
        tuple(
            PhaseKnown(**{**p, "shown": tuple(tuple(x) for x in p["shown"])}) for p in kept.get("phases", ())
        ),
    )


def _value(kind: Any, text: str | None) -> Any:
    return None if text is None else kind(text)


def _pair(kept: dict[str, Any] | None) -> Pair | None:
    return None if kept is None else Pair(**kept)


def _calm(kept: dict[str, Any] | None) -> Calm | None:
    return None if kept is None else Calm(**kept)
