"""The flagged loops of a night are explained although single loops fail, and the answers are stored and shown."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from analyzer.config import Config
from analyzer.explain import night as explain_night
from analyzer.explain.explained import abstained
from analyzer.explain.night import (
    FlaggedLoop,
    answer_row,
    answered,
    explain_flagged,
    flagged,
    keep,
    known,
    questions,
)
from analyzer.loops.spec import LoopSpec
from analyzer.night.nights import Night, Plant
from analyzer.night.workers import WorkerDeath
from analyzer.pages import night as night_pages
from analyzer.store.store import Store
from identification.errors import NotAssessedError
from reports.html import render
from reports.page_file import dumps
from reports.pages import Page, Section, Text
from tests.reports.small_store import NASTY, small_store, tags

NIGHT = Night("2026-03-15", 0.0, 1.0)
SPECS = tuple(LoopSpec(tag, pv=f"{tag}.PV", op=f"{tag}.OP") for tag in tags(30))
EXPORT: Any = None
PLANT = Plant(EXPORT, SPECS)
ROW = {"status": "ok", "oscillating_pct": 0.0, "cause": "none", "action": "none"}


@pytest.fixture
def store(tmp_path: Path) -> Store:
    """Two weeks of 30 invented loops."""
    return small_store(tmp_path / "store", hours=False, buckets=50)


def stub_answer(q: FlaggedLoop) -> tuple[dict[str, Any], str]:
    """An answer that needs no recording, without a page; the second nasty loop fails, and the third is not
    explained.
    """
    if q.spec.loop == NASTY[1]:
        raise ZeroDivisionError("broken")
    if q.spec.loop == NASTY[2]:
        raise NotAssessedError("needs OP, has none")
    return abstained(q.spec.loop, "said of " + q.spec.loop) | {"verdict": "backlash", "block": "valve"}, ""


class DyingWorkers:
    """Workers of which every second one dies during its task."""

    def __init__(self, count: int, function: Callable[[FlaggedLoop], dict[str, Any]], limits: object) -> None:
        self.function, self.tasks = function, []

    def __enter__(self) -> DyingWorkers:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def submit(self, task: FlaggedLoop, alone: bool = False) -> None:
        self.tasks.append(task)

    def results(self) -> Iterator[dict[str, Any] | WorkerDeath[FlaggedLoop]]:
        for at, task in enumerate(self.tasks):
            yield (
                WorkerDeath(task, 0, "its worker process was ended by SIGKILL", True)
                if at % 2
                else self.function(task)
            )


@pytest.mark.parametrize(
    ("changed", "worth"),
    [
        ({}, False),
        ({"oscillating_pct": 60.0}, True),
        ({"cause": "valve"}, True),
        ({"action": "retune"}, True),
        ({"oscillating_pct": None, "cause": None, "action": ""}, False),
        ({"oscillating_pct": 90.0, "status": "failed"}, False),
    ],
)
def test_flagged_loops_oscillate_or_have_cause_or_action(changed: dict[str, Any], worth: bool) -> None:
    """A loop is explained if it was assessed and oscillates, has a cause or has an action."""
    assert flagged(ROW | changed) is worth


def test_worst_loop_comes_first_with_its_source_loop(store: Store) -> None:
    """Loops are ordered by significance, and a follower also gets the tags of its source."""
    rows = [
        ROW | {"loop": tag, "cause": "load", "oscillation_significance": size, "source_loop": lead}
        for tag, size, lead in (("FIC0000", 1.0, None), ("FIC0001", 9.0, "FIC0000"))
    ]
    first, second = questions(PLANT, rows, NIGHT)
    assert (first.spec.loop, second.spec.loop) == ("FIC0001", "FIC0000")
    assert first.source is not None
    assert first.source.loop == "FIC0000"
    assert second.source is None


def test_one_failing_loop_never_stops_the_night(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop that fails has its error as answer, and all others are explained."""
    monkeypatch.setattr(explain_night, "_answer_and_page", stub_answer)
    seen: list[tuple[int, int]] = []
    rows = explain_flagged(PLANT, store, NIGHT, progress=lambda *x: seen.append(x))
    by = {r["loop"]: r for r in known(store, NIGHT.name)}
    assert len(by) == len(rows) == seen[-1][0] == seen[-1][1]
    assert {"unexplained", "backlash"} == {r["verdict"] for r in rows}
    if NASTY[1] in by:
        assert "ZeroDivisionError" in by[NASTY[1]]["reason"]
    assert all(json.loads(r["answer"])["loop"] == r["loop"] for r in rows)


def test_dead_worker_loses_only_its_loop(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """If every second worker dies, every second loop reports it, and the other loops have their answers."""
    monkeypatch.setattr(explain_night, "_answer_and_page", stub_answer)
    monkeypatch.setattr("analyzer.night.workers.Workers", DyingWorkers)
    rows = explain_flagged(PLANT, store, NIGHT, 2)
    dead = [r for r in rows if "SIGKILL" in r["reason"]]
    assert abs(2 * len(dead) - len(rows)) <= 1


def test_resumed_night_keeps_what_it_has(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """A resumed night explains only the loops without an answer."""
    monkeypatch.setattr(explain_night, "_answer_and_page", stub_answer)
    whole = explain_flagged(PLANT, store, NIGHT)
    keep(store, NIGHT.name, [whole[0] | {"reason": "kept"}])
    again = explain_flagged(PLANT, store, NIGHT, resume=True)
    assert again[0]["reason"] == "kept"
    assert {r["loop"] for r in again} == {r["loop"] for r in whole}


def test_failure_is_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason of a loop that is not explained is unchanged; an error is given with its type."""
    monkeypatch.setattr(explain_night, "_answer_and_page", stub_answer)
    spec = {s.loop: s for s in SPECS}
    reasons = [answered(FlaggedLoop(EXPORT, spec[n], None, NIGHT, Config()))["reason"] for n in NASTY[1:3]]
    assert reasons == ["not explained: ZeroDivisionError: broken", "needs OP, has none"]


def test_loop_page_shows_the_explanation(store: Store) -> None:
    """The page of a loop has the sentence of the explanation and what to check, escaped; without an explanation it
    has no section.
    """
    name = store.nights()[-1]
    before = {p.title: p for p in night_pages.pages_of_night(store, name, 8)}
    tag = next(t for t in before if t in tags(30))
    evil = "<script>evil</script>"
    data = abstained(tag, evil) | {"verdict": "backlash", "block": "valve"}
    keep(store, name, [answer_row(data, name)])
    after = {p.title: p for p in night_pages.pages_of_night(store, name, 8)}
    title = "Physics missing in the baseline model"
    assert title not in [s.title for s in before[tag].sections]
    section = next(s for s in after[tag].sections if s.title == title)
    assert isinstance(section.blocks[0], Text)
    assert evil in section.blocks[0].paragraphs[0]
    assert "linkage" in section.blocks[0].paragraphs[1]
    assert evil not in render(after[tag], True)


def test_stored_page_is_written_with_the_night(store: Store) -> None:
    """The stored page of an explanation is written with a link from the page of the loop; a broken stored page is not
    written.
    """
    name = store.nights()[-1]
    tag = next(t for t in {p.title: p for p in night_pages.pages_of_night(store, name, 8)} if t in tags(30))
    data = abstained(tag, "reason") | {"verdict": "backlash", "block": "valve"}
    kept = Page(f"{tag}-explained", f"{tag}: backlash", "", (Section("What it is", (Text(("words",)),)),))
    keep(store, name, [answer_row(data, name, dumps(kept))])
    after = {p.title: p for p in night_pages.pages_of_night(store, name, 8)}
    drawn = after[kept.title]
    assert drawn.sections == kept.sections
    assert [text for text, _ in drawn.links] == ["All loops", tag]
    assert ("The explanation", f"{kept.name}.html") in after[tag].links
    keep(store, name, [answer_row(data, name, "{}")])
    assert kept.title not in {p.title for p in night_pages.pages_of_night(store, name, 8)}
