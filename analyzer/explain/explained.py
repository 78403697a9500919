"""Explanation of one loop: the request, the findings, the answer, and the answer as plain data.

The data are the contract of `triage explain --format json`; text, page and store use them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from analyzer.columns import Row
from analyzer.explain.case import Case
from analyzer.explain.models import SCALE, UserModel, judged, plain_start, rescaled, span_note
from analyzer.loop.experiments.found import ExperimentResults
from analyzer.words.decision import as_data as decision_data
from analyzer.words.experiments import in_a_clause
from identification.controller.pi_regression import ControlLaw
from identification.controller.pid_regression import integral_time
from identification.mismatch.answer import Answer, answer
from identification.mismatch.diagnosis import explain
from identification.mismatch.explanation import Explanation, proven_on
from identification.mismatch.model_file import to_data
from identification.mismatch.recording import Recording
from identification.mismatch.words import reason
from reports.plain import json_ready

PARTS_IN_REASON = ("note", "caution", "shown", "outside")
"""Parts of an answer that the data include in their reason, and under a separate key if there is such an effect."""


@dataclass(frozen=True, slots=True)
class Explained:
    """Explanation of one loop: the request, the findings, the answer in numbers and as data, the user's own model."""

    case: Case
    found: Explanation
    said: Answer
    data: dict[str, Any]
    user_model: UserModel | None = None

    def model(self) -> dict[str, Any]:
        """The improved model, or the baseline model without findings, as data for a file."""
        c, found, s = self.case, self.found, self.case.prepared.scale
        scale = dict(zip(SCALE, (s.low, s.span, s.op_low, s.op_span), strict=True))
        names = tuple(e.name for e in self.said.effects)
        # the constants for pages and proof, not those with the best one-step-ahead prediction
        return to_data(c.spec.loop, found.p.inputs, found.proven.drawn[1], names, found.late_s, scale)


def explained(
    c: Case,
    progress: Callable[[str], None],
    user_model: Mapping[str, Any] | None = None,
    held_out: Mapping[str, Case] | None = None,
) -> Explained:
    """Explain one loop.

    progress : called with each step; user_model : the user's own model, which is judged and is one more start of the
    search; held_out : other recordings of the loop by name, on which the explanation is proven.
    """
    own, others, scale = None, held_out or {}, c.prepared.scale
    with np.errstate(all="ignore"):  # a diverging candidate loses; its overflow needs no warning
        start = None if user_model is None else plain_start(user_model)
        found = proven_on(
            explain(c.recording, progress, start), [in_percent_of(c, x) for x in others.values()]
        )
        result = answer(found, c.recording)
        if user_model is not None:
            own = judged(user_model, found, c.recording, span_note(scale, user_model))
    data = as_data(c, result, own)
    if c.recording.stated is None:  # if they are stated, the controller check reports
        data |= law_data(found.law, c.recording.dt_s)
    if c.learned is not None and c.learned.model is not None:
        data["experiments"] = json_ready(experiment_data(c.learned))
        clause = in_a_clause(c.learned)
        data["reason"] = f"{data['reason']} {clause[:1].upper()}{clause[1:]}."
    if others:  # with each, if an effect was found to be tested on it
        data["held_out_on"] = [
            {
                "recording": name,
                "baseline": asdict(x.baseline),
                "explained": asdict(x.explained),
                "share": x.share,
            }
            for name, x in zip(others, found.others, strict=False)
        ]
    return Explained(c, found, result, data, own)


def with_night(data: dict[str, Any], decision: Row | None) -> dict[str, Any]:
    """An answer with the night's decision on the loop, which the explanation may only supplement."""
    return data if decision is None else data | {"night": json_ready(decision_data(decision))}


def experiment_data(of: ExperimentResults) -> dict[str, Any]:
    """Results of experiments: kind of response, constants with 90 % intervals, and their time courses."""
    model = of.model
    assert model is not None  # called only with a model
    return {
        "kind": str(model.kind),
        "constants": {k: asdict(e) for k, e in model.estimates.items()},
        "courses": [str(m.experiment.course) for m in model.used],
        "weights": list(model.weights),
    }


def in_percent_of(c: Case, other: Case) -> Recording:
    """Another recording in the percent of the fitted one; without stated ranges they differ."""
    pv, op = rescaled(other.prepared.scale, c.prepared.scale, other.recording.pv, other.recording.op)
    return replace(other.recording, pv=pv, op=op, sp=None)


def as_data(c: Case, result: Answer, user_model: UserModel | None = None) -> dict[str, Any]:
    """The answer as JSON-compatible data."""
    data = answer_data(c.spec.loop, result, f"{reason(result)} {c.shortened}".strip())
    if user_model is not None:
        judgement = {"fitted": asdict(user_model.fitted), "held_out": asdict(user_model.held_out)}
        data["fit"]["brought"] = judgement | {"note": user_model.note}
    if result.outside is not None:
        outside = asdict(result.outside)
        data["outside"] = {k: outside[k] for k in ("name", "block", "parameters")}
    return json_ready(data)


def answer_data(loop: str, result: Answer, why: str) -> dict[str, Any]:
    """The answer alone, in the form of the contract."""
    shown = {k: v for k, v in asdict(result).items() if k not in PARTS_IN_REASON}
    return {"loop": loop} | shown | {"reason": why}


def law_data(law: ControlLaw | None, dt_s: float) -> dict[str, Any]:
    """The law that reproduces OP, as a further key: Kp [% OP/% PV], Ti [s], none without integral action, and the
    explained share of OP."""
    if law is None or law.kp * law.ki <= 0.0:
        return {}
    ti_s = integral_time(law.kp, law.ki, law.residual.size) * dt_s
    return json_ready({"controller": {"kp": law.kp, "ti_s": ti_s, "explained": law.explained}})


def abstained(loop: str, reason: str) -> dict[str, Any]:
    """The answer if the record does not allow an explanation."""
    return json_ready(answer_data(loop, Answer("unexplained", "none", (), {}, {}, {}, None), reason))
