"""One loop explained: the case asked, what was found, the answer, and what a page draws of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analyzer.explain.answer_data import as_data, law_data
from analyzer.explain.case import Case
from analyzer.explain.saved_model import saved_model
from analyzer.explain.user_model import Brought, judged
from analyzer.explain.views import Views, views
from identification.mismatch.answer import Answer, answer
from identification.mismatch.diagnosis import explain
from identification.mismatch.explanation import Explanation
from identification.mismatch.model_file import constants
from identification.mismatch.other_recordings import proven_on
from identification.mismatch.recording import Recording
from identification.record import Floats
from identification.simulation.parameters import Slot, neutral

SPAN_DIFFERS = 0.01
"""Relative difference of two PV spans from which a model's percent are not the record's; ours."""


@dataclass(frozen=True, slots=True)
class Explained:
    """One loop explained: what was asked, what was found, the answer in numbers and as data, what a page draws of it,
    and the user's own model."""

    case: Case
    found: Explanation
    said: Answer
    data: dict[str, Any]
    views: Views
    brought: Brought | None = None

    def model(self) -> dict[str, Any]:
        """The model found, the plain loop where nothing was, as data to be written."""
        return saved_model(self.case, self.found, self.said)


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
        own = None if brought is None else judged(brought, found, c.subject, span_note(c, brought))
        drawn = views(found, c.subject, said, own)
    data = as_data(c, said, own)
    if c.subject.stated is None:  # where they are stated, the controller's check says what is to be said
        data |= law_data(found.law, c.subject.dt_s)
    if others:
        data["held_out_on"] = on_others(found, tuple(others))
    return Explained(c, found, said, data, drawn, own)


def in_percent_of(c: Case, other: Case) -> Recording:
    """Another recording in the percent of the one that is fitted; without stated ranges theirs differ."""
    then, now, s = c.prepared.scale, other.prepared.scale, other.subject
    pv = then.pv_pct(now.low + s.pv * now.span / 100.0)
    op = then.op_pct(now.op_low + s.op * now.op_span / 100.0)
    return replace(s, pv=pv, op=op, sp=None)


def on_others(found: Explanation, names: tuple[str, ...]) -> list[dict[str, Any]]:
    """Misfits on each recording held out, as data; none where nothing was found that could be held against them."""
    return [
        {
            "recording": name,
            "baseline": {"rmse": x.baseline.rmse, "fit_pct": x.baseline.fit_pct},
            "explained": {"rmse": x.explained.rmse, "fit_pct": x.explained.fit_pct},
            "share": x.share,
        }
        for name, x in zip(names, found.others, strict=False)
    ]


def plain_start(brought: Mapping[str, Any]) -> Floats:
    """Constants of the plain loop in a model, shape (SIZE,): the rest of it is judged, not believed."""
    own, out = constants(dict(brought)), neutral()
    for slot in (Slot.T, Slot.L, Slot.K):
        out[slot] = own[slot]
    return out


def span_note(c: Case, brought: Mapping[str, Any]) -> str:
    """What to say where a model was made with another PV span than the record now has; empty where not."""
    scale = brought.get("scale")
    then = scale.get("pv_span") if isinstance(scale, dict) else None
    if not isinstance(then, int | float) or abs(then / c.prepared.scale.span - 1.0) < SPAN_DIFFERS:
        return ""
    now = c.prepared.scale.span
    return (
        f"it was made with a PV span of {then:.4g}, this record has {now:.4g}: its gain is off by their ratio"
    )
