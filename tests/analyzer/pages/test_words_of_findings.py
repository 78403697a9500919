"""A finding contains figures; its words are made when it is stored, and are the same for each source of the
finding.
"""

from __future__ import annotations

import json
import math

from analyzer.loop.decisions import (
    Cause,
    Finding,
    MissingData,
    OscillationFigures,
    Requirement,
    RequirementKind,
    Sign,
    SignKind,
    Status,
)
from analyzer.plantwide.structure import Tie
from analyzer.store.rows import finding_of, night_row, piece_row
from analyzer.words import sentences
from analyzer.words.reason import SIGN_TEXTS, sign_in_full

SIGNS = (
    Sign(Cause.VALVE, 0.9, SignKind.EVIDENCE, (41.3, 0.75, 12)),
    Sign(Cause.LOAD, 0.25, SignKind.PERIODIC_LOAD, (20.0, 9.0)),
    Sign(Cause.VALVE, 0.5, SignKind.AGAIN),
)
STORED = [
    {
        "points_to": "valve",
        "strength": 0.9,
        "text": "backlash or stiction predicts PV better than an ideal valve, in 75 % of 12 stretches between "
        "reversals of OP",
        "name": "evidence",
        "figures": "log likelihood +41",
    },
    {
        "points_to": "load",
        "strength": 0.25,
        "text": "a periodic load that keeps its phase for 9 periods explains PV better than an irregular one",
        "name": "periodic load",
        "figures": "log likelihood +20",
    },
    {
        "points_to": "valve",
        "strength": 0.5,
        "text": "most stretches between moves of the stem show this fault",
        "name": "",
        "figures": "",
    },
]
"""The same signs as the store has kept them since its first version."""
FOUND = Finding(
    "FIC1",
    "2026-03-02",
    Status.OK,
    Requirement(MissingData.FINER, RequirementKind.PV_AS_MEASURED, (98.0, 0.8)),
    MissingData.FINER,
    OscillationFigures(20.0, 90.0, 60.0, 2.0),
    Cause.UNDECIDED,
    signs=SIGNS,
)


def test_each_kind_has_its_words() -> None:
    """Each kind of sign and each kind of need has its sentences."""
    assert set(SIGN_TEXTS) == set(SignKind)
    assert set(sentences("needs")) == set(RequirementKind)


BOTH_WAYS = {
    SignKind.EVIDENCE: ((0.0,), (9.0,), (9.0, 0.5, 4)),
    SignKind.WIDTH: ((0.3,),),
    SignKind.AMPLIFICATION: ((), (2.0,), (50.0,)),
    SignKind.REGULARITY: ((1.5, 0.9, 1.0), (1.5, 0.1, 1.0), (2.9, 0.9, 0.0), (2.9, 0.1, 0.0)),
    SignKind.RINGING: ((math.inf, 90.0), (5.0, 90.0)),
    SignKind.SMOOTH_LOAD: ((2.0,),),
    SignKind.PERIODIC_LOAD: ((40.0, 12.0),),
    SignKind.KEPT_PHASE: ((0.99, 700.0),),
    SignKind.LIKELIER: (("valve", 40.0), ("load", 40.0)),
    SignKind.CALM_EVIDENCE: ((9.0,),),
    SignKind.CALM_WIDTH: ((0.4,),),
    SignKind.AGAIN: ((),),
    SignKind.DEAD_VALVE: ((40.0,),),
    SignKind.FOLLOWS: (("F1", None, 0.9), ("F1", 30.0, 0.9)),
    SignKind.OF_BELOW: tuple(("F1", cause, tie) for cause in (*Cause, None) for tie in Tie),
    SignKind.OF_ABOVE: tuple(("F1", tie) for tie in Tie),
}
"""Figures that use each sentence of a sign."""


def test_every_sentence_of_a_sign_exists_and_is_used() -> None:
    """Figures of each size give a sentence without a brace, and each sentence is used."""
    assert set(BOTH_WAYS) == set(SignKind)
    signs = [Sign(Cause.LOAD, 0.5, kind, each) for kind, figures in BOTH_WAYS.items() for each in figures]
    assert not [text for text in map(sign_in_full, signs) if not text or "{" in text]
    used = {SIGN_TEXTS[s.kind](*s.figures)[0] for s in signs}
    assert used == set(sentences("signs"))
    assert used > set(sentences("figures_of_signs"))


def test_the_store_keeps_the_same_words() -> None:
    """Signs are stored in a row as cause, strength, text, name and figures."""
    assert night_row(FOUND)["signs"] == json.dumps(STORED)


def test_a_piece_keeps_figures_and_gives_the_same_night() -> None:
    """A piece that a worker writes contains no sentence, and the night made of it has the words of the finding."""
    piece = piece_row(FOUND)
    assert "explains" not in piece["signs"]
    assert "measured" not in json.loads(piece["reason"])[2]
    again = finding_of(piece)
    assert (again.signs, again.lacking) == (FOUND.signs, FOUND.lacking)
    assert night_row(again) == night_row(FOUND)
    assert "needs PV as measured; it is constant for 98 % of the samples" in night_row(again)["reason"]
