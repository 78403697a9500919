"""A decision is a separate value, the same in store and list, and is not read from sentences."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np
import pytest

from analyzer.config import PlantLimits
from analyzer.loop.decisions import (
    CAUSES,
    Action,
    Cause,
    Fault,
    Finding,
    LacksError,
    MissingData,
    Remedy,
    Requirement,
    RequirementKind,
    SignKind,
    SourceLoop,
    Status,
    counts,
)
from analyzer.night import chunk
from analyzer.night.nights import Night
from analyzer.plantwide.night import following
from analyzer.store.rows import night_row
from proofs.plant import CONFIG, START_S, series, spec

CONTRACT = {
    Cause: "valve|tuning|load|none|undecided",
    Fault: "backlash|stiction|none|undecided",
    Action: (
        "retune|repair valve|see source loop|find disturbance|check limit|check settings|check measurement|"
        "needs data|none|undecided"
    ),
}
"""The words of `triage rank --format csv` according to DESIGN.md."""
NIGHT = Night("2026-03-02", START_S, START_S + 86400.0)


@pytest.mark.parametrize("kind", CONTRACT)
def test_the_words_are_those_of_the_contract(kind):
    """Causes, faults and actions are stored and listed exactly with the words of the contract."""
    assert "|".join(kind) == CONTRACT[kind]
    assert {f"{word}" for word in kind} == set(CONTRACT[kind].split("|"))


@pytest.mark.parametrize(("share", "expected"), [(None, False), (19.999, False), (20.0, True), (100.0, True)])
def test_a_loop_counts_as_oscillating_from_a_fifth_of_the_time_on(share, expected):
    """A loop counts as oscillating from 20 % of the time on, and not if its share is unknown."""
    assert counts(share) is expected


@pytest.mark.parametrize("own", [(0.0, 0.0, 0.0), (99.0, 80.0, 10.0), (10.0, 99.0, 96.0)])
def test_a_follower_is_under_load_for_any_own_signs(own):
    """For a follower the load is at least as probable as the coherence and more probable than valve and tuning; no
    own action.
    """
    root = SourceLoop("FIC101", 0.9, None, 96.0)
    confidence, remedy = dict(zip(CAUSES, own, strict=True)), Remedy(Action.RETUNE, kp_new=1.0)
    alone = Finding("L", "2026-03-02", Status.OK, confidence=confidence, remedy=remedy)
    found = following(alone, root, None, (SignKind.FOLLOWS, ()), PlantLimits())
    assert (found.cause, found.fault, found.remedy.action) == (Cause.LOAD, Fault.NONE, Action.SEE_SOURCE_LOOP)
    assert found.remedy.kp_new is None
    assert found.confidence[Cause.LOAD] >= max(90.0, own[2])
    assert max(found.confidence[Cause.VALVE], found.confidence[Cause.TUNING]) <= 25.0


def test_missing_data_are_passed_between_processes():
    """An error that states what a record lacks keeps its text and kind in another process."""
    error = pickle.loads(
        pickle.dumps(LacksError(Requirement(MissingData.SAMPLES, RequirementKind.SAMPLES, (200, 12))))
    )
    assert (error.needs.lack, str(error)) == (MissingData.SAMPLES, "needs 200 samples, has 12")


def row_without(n: int, *roles: str) -> dict[str, object]:
    """The row of a night for a loop of n samples with a sine, without some tags."""
    stamp = START_S + np.arange(n, dtype=float)
    sine = 50.0 + 5.0 * np.sin(2 * np.pi * stamp / 60.0)
    found = {f"L.{r.upper()}": series(stamp, sine) for r in ("sp", "pv", "op") if r not in roles}
    if "sp" in found:
        found["L.SP"] = series(stamp, np.full(n, 50.0))
    stated = spec(**dict.fromkeys(roles))
    kept = chunk.Rows()
    chunk._loop_row(stated, found, NIGHT, CONFIG, True, kept)
    (finding,) = kept.nights
    return night_row(finding)


def test_the_store_states_what_a_loop_lacks():
    """Too few samples and an oscillating loop without OP are distinguished in the column `lack`, in addition to the
    sentence.
    """
    short, blind = row_without(50), row_without(7200, "op", "sp")
    assert (short["status"], short["lack"]) == (Status.NOT_ASSESSED, MissingData.SAMPLES)
    assert (blind["status"], blind["lack"]) == (Status.OK, MissingData.OP)
    assert "needs OP" in str(blind["reason"])


def test_nothing_reads_a_decision_from_a_sentence():
    """Only the modules that read files and /proc test the beginning or the end of a text."""
    root = Path(__file__).resolve().parents[3]
    allowed = {
        "own_limits.py",
        "spec.py",
        "workers.py",
        "tables.py",
        "markdown.py",
        "html.py",
        "reading.py",
        "texts.py",
    }
    found = [
        f"{path.name}: {line.strip()}"
        for package in ("analyzer", "tuning", "reports")
        for path in sorted((root / package).rglob("*.py"))
        if "history" not in path.parts and path.name not in allowed
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r"\.(startswith|endswith)\(|\bin \w*\.?(reason|note|needs)\b", line)
    ]
    assert found == []
