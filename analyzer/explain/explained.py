"""One loop explained: what was asked, what was found, the answer, and the answer as plain data.

The data are the contract of `triage explain --format json`; text, page and store quote them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from analyzer.explain.case import Case
from analyzer.explain.models import SCALE, Brought, judged, plain_start, span_note
from identification.controller.pi_regression import ControlLaw
from identification.controller.pid_regression import integral_time
from identification.mismatch.answer import Answer, answer
from identification.mismatch.diagnosis import explain, transmitter_end
from identification.mismatch.explanation import Explanation, proven_on
from identification.mismatch.model_file import to_data
from identification.mismatch.recording import Recording
from identification.mismatch.words import sentence, unexplained_reason

TOLD_IN_REASON = ("note", "caution", "shown")
"""Parts of an answer that the data have as their reason."""


@dataclass(frozen=True, slots=True)
class Explained:
    """One loop explained: what was asked, what was found, the answer in numbers and as data, the user's own model."""

    case: Case
    found: Explanation
    said: Answer
    data: dict[str, Any]
    brought: Brought | None = None

    def model(self) -> dict[str, Any]:
        """The model found, the plain loop where nothing was, as data to be written."""
        c, found, s = self.case, self.found, self.case.prepared.scale
        scale = dict(zip(SCALE, (s.low, s.span, s.op_low, s.op_span), strict=True))
        names = tuple(e.name for e in self.said.effects)
        data = to_data(c.spec.loop, found.p.inputs, found.best.model.c, names, found.late_s, scale)
        end = transmitter_end(found.recorder, c.subject.pv)
        if end is not None:
            data["constants"]["CLIP_HI" if end.upper else "CLIP_LO"] = end.value
        return data


def explained(
    c: Case,
    tell: Callable[[str], None],
    brought: Mapping[str, Any] | None = None,
    held_out: Mapping[str, Case] | None = None,
) -> Explained:
    """Explain one loop.

    Parameters
    ----------
    c : Case
    tell : callable
        Is told what is tried.
    brought : mapping or None
        The user's own model, which is judged and is one more start of the search.
    held_out : mapping or None
        Other recordings of the loop by name, on which the explanation is proven.
    """
    start = None if brought is None else plain_start(brought)
    with np.errstate(all="ignore"):  # a candidate that runs away loses; its overflow is nobody's business
        others = {} if held_out is None else dict(held_out)
        found = proven_on(explain(c.subject, tell, start), [in_percent_of(c, x) for x in others.values()])
        said = answer(found, c.subject)
        own = (
            None
            if brought is None
            else judged(brought, found, c.subject, span_note(c.prepared.scale, brought))
        )
    data = as_data(c, said, own)
    if c.subject.stated is None:  # where they are stated, the controller's check says what is to be said
        data |= law_data(found.law, c.subject.dt_s)
    if others:
        data["held_out_on"] = on_others(found, tuple(others))
    return Explained(c, found, said, data, own)


def in_percent_of(c: Case, other: Case) -> Recording:
    """Another recording in the percent of the one that is fitted; without stated ranges theirs differ."""
    then, now, s = c.prepared.scale, other.prepared.scale, other.subject
    pv = then.pv_pct(now.low + s.pv * now.span / 100.0)
    op = then.op_pct(now.op_low + s.op * now.op_span / 100.0)
    return replace(s, pv=pv, op=op, sp=None)


def as_data(c: Case, said: Answer, brought: Brought | None = None) -> dict[str, Any]:
    """The answer as data that JSON can hold."""
    data = {"loop": c.spec.loop} | asdict(said) | {"reason": f"{reason_of(said)} {c.shortened}".strip()}
    for part in TOLD_IN_REASON:
        del data[part]
    outside = data.pop("outside")
    if brought is not None:
        judgement = {"fitted": asdict(brought.fitted), "held_out": asdict(brought.held_out)}
        data["fit"]["brought"] = judgement | {"note": brought.note}
    if outside is not None:
        data["outside"] = {k: outside[k] for k in ("name", "block", "parameters")}
    return json_ready(data)


def law_data(law: ControlLaw | None, dt_s: float) -> dict[str, Any]:
    """The law that gives OP, as a further key: Kp [% OP/% PV], Ti [s], none without integral action, and the share of
    OP that it explains."""
    if law is None or law.kp * law.ki <= 0.0:
        return {}
    ti_s = integral_time(law.kp, law.ki, law.residual.size) * dt_s
    return json_ready({"controller": {"kp": law.kp, "ti_s": ti_s, "explained": law.explained}})


def on_others(found: Explanation, names: Sequence[str]) -> list[dict[str, Any]]:
    """Misfits on each recording held out, as data; none where nothing was found that could be held against them."""
    return [
        {
            "recording": name,
            "baseline": asdict(x.baseline),
            "explained": asdict(x.explained),
            "share": x.share,
        }
        for name, x in zip(names, found.others, strict=False)
    ]


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
    nothing = asdict(Answer("unexplained", "none", (), {}, {}, {}, None))
    told = {k: v for k, v in nothing.items() if k not in (*TOLD_IN_REASON, "outside")}
    return json_ready({"loop": loop} | told | {"reason": reason})
