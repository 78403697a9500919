"""The answer as plain data that JSON can hold (contract of `triage explain --format json`), and its sentence."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from analyzer.explain.case import Case
from analyzer.explain.user_model import Brought
from identification.controller.pi_regression import ControlLaw
from identification.controller.settings import integral_time
from identification.mismatch.answer import Answer, EffectFound
from identification.mismatch.words import sentence, unexplained_reason


def as_data(c: Case, said: Answer, brought: Brought | None = None) -> dict[str, Any]:
    """The answer as data that JSON can hold."""
    effects = [
        _found(e) | {"held_out_share": e.held_out_share, "alternatives": list(e.alternatives)}
        for e in said.effects
    ]
    fit = said.fit if brought is None else said.fit | {"brought": brought.as_data()}
    data = {
        "loop": c.spec.loop,
        "verdict": said.verdict,
        "block": said.block,
        "effects": effects,
        "where": said.where,
        "fit": fit,
        "moved": said.moved,
        "remaining": said.remaining,
        "reason": f"{reason_of(said)} {c.shortened}".strip(),
    }
    if said.outside is not None:
        data["outside"] = _found(said.outside)
    return json_ready(data)


def _found(e: EffectFound) -> dict[str, Any]:
    numbers = {
        k: {"value": v.value, "low": v.low, "high": v.high, "unit": v.unit} for k, v in e.parameters.items()
    }
    return {"name": e.name, "block": e.block, "parameters": numbers}


def law_data(law: ControlLaw | None, dt_s: float) -> dict[str, Any]:
    """The law that gives OP, as a further key: Kp [% OP/% PV], Ti [s], none without integral action, and the share of
    OP that it explains."""
    if law is None or law.kp * law.ki <= 0.0:
        return {}
    ti_s = integral_time(law.kp, law.ki, law.residual.size) * dt_s
    return json_ready({"controller": {"kp": law.kp, "ti_s": ti_s, "explained": law.explained}})


def reason_of(said: Answer) -> str:
    """The verdict in words, with what the recording lacks."""
    if said.verdict == "unexplained":
        return unexplained_reason(said)
    caution = f" The figures are rough: it {said.caution}." if said.caution else ""
    return " ".join(part for part in (sentence(said) + caution, said.shown) if part)


def json_ready(x: Any) -> Any:
    """The same with numbers that JSON knows: no NaN, no infinity, no numpy types."""
    if isinstance(x, dict):
        return {str(k): json_ready(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [json_ready(v) for v in x]
    if isinstance(x, np.generic):
        x = x.item()
    if isinstance(x, float):
        return float(f"{x:.6g}") if math.isfinite(x) else None
    return x


def abstained(loop: str, reason: str) -> dict[str, Any]:
    """The answer where the question cannot be answered from the record."""
    return {
        "loop": loop,
        "verdict": "unexplained",
        "block": "none",
        "effects": [],
        "where": {},
        "fit": {},
        "moved": {},
        "remaining": None,
        "reason": reason,
    }
