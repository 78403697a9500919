"""One loop and night, one answer: `rank`, `tune`, `explain` and the pages tell the same decision."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.pages.night import pages_of_night
from analyzer.store.store import Store
from analyzer.words.reason import in_short
from analyzer.words.units import number

MILL, LOOPS = "sample_data/mill.parquet", "sample_data/loops.csv"
NIGHT = ("--since", "2026-03-03", "--until", "2026-03-04")
CELLS = (
    "cause",
    "valve_fault",
    "backlash_pct",
    "stickband_pct",
    "source_loop",
    "action",
    "kp_new",
    "ti_new",
    "reason",
)
FOLLOWER, WORN, CALM = "LIC2103", "TIC2106", "FIC2113"
WALKED = (FOLLOWER, WORN, CALM)
"""Loops that `tune` is asked of; tests/proofs/test_walk.py asks it of the whole mill and of two plants."""


def said(*words: str) -> str:
    """What a command prints on stdout."""
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of one night of the mill."""
    folder = tmp_path_factory.mktemp("one") / "store"
    said("run", MILL, "--loops", LOOPS, *NIGHT, "--store", str(folder))
    return folder


@pytest.fixture(scope="module")
def ranked(store: Path) -> dict[str, dict[str, Any]]:
    """Its rows by loop."""
    return {row["loop"]: row for row in json.loads(said("rank", str(store), "--format", "json"))}


def cells(row: dict[str, Any]) -> dict[str, Any]:
    """The cells in which commands must agree, numbers to six digits."""
    return {k: float(f"{row[k]:.6g}") if isinstance(row[k], float) else row[k] for k in CELLS}


def asked(command: str, loop: str, *more: str) -> dict[str, Any] | None:
    """What a command tells of a loop as data; None where the night has too little of it."""
    words = (command, MILL, "--loops", LOOPS, *NIGHT, "--loop", loop, "--format", "json", *more)
    result = CliRunner().invoke(main, words)
    if result.exit_code == 2 and not result.stdout:
        return None
    assert result.exit_code in (0, 2), result.output
    told: dict[str, Any] = json.loads(result.stdout)
    return told


@pytest.mark.parametrize("loop", WALKED)
def test_tune_decides_as_the_night_did(loop: str, store: Path, ranked: dict[str, dict[str, Any]]) -> None:
    """With the night's store and without one `tune` tells the cells of `rank`; it tells nothing of a loop that the
    night could not assess."""
    for more in ((), ("--store", str(store))):
        told = asked("tune", loop, *more)
        if told is None:
            assert ranked[loop]["status"] == "not assessed"
            continue
        assert cells(told["decision"]) == cells(ranked[loop])
        assert f"action: {ranked[loop]['action']}" in told["text"]


def test_every_page_tells_the_row(store: Path, ranked: dict[str, dict[str, Any]]) -> None:
    """Of each loop of the mill the page's action, cause, reason and settings are those of `rank`."""
    pages = {page.title: page for page in pages_of_night(Store(store))}
    for loop, row in ranked.items():
        first, *_ = pages[loop].sections
        facts = dict(next(s for s in pages[loop].sections if s.title == "What and why").blocks[0].items)
        assert facts["Action"] == row["action"]
        assert facts["Cause"] == (row["cause"] or "not assessed")
        short = in_short(row["reason"])[0]
        assert first.blocks[0].paragraphs[0].lower() == f"{short}.".lower()
        settings = facts.get("Settings to type in", "")
        assert (number(row["kp_new"]) in settings) if row["action"] == "retune" else not settings


def test_a_forecast_is_of_the_settings_that_were_decided(
    store: Path, ranked: dict[str, dict[str, Any]]
) -> None:
    """The settings in the text of `tune` are those of the row, and only a loop that is to be retuned has some."""
    text = said("tune", MILL, "--loops", LOOPS, *NIGHT, "--loop", WORN, "--store", str(store))
    row = ranked[WORN]
    assert ("new settings:" in text) == (row["action"] == "retune")
    if row["action"] == "retune":
        assert f"kp {row['kp_new']:.3g}" in text


def test_explain_begins_with_what_the_night_found(store: Path, ranked: dict[str, dict[str, Any]]) -> None:
    """`explain` tells the night's decision before what the physics adds, in text and as data."""
    asked = ("explain", MILL, "--loops", LOOPS, *NIGHT, "--loop", WORN, "--store", str(store))
    told = json.loads(said(*asked, "--format", "json"))
    assert cells(told["night"]) == cells(ranked[WORN])
    assert f"found: cause {ranked[WORN]['cause']}; valve {ranked[WORN]['valve_fault']}" in " ".join(
        said(*asked).split()
    )


def test_a_night_that_the_store_lacks_is_one_line(store: Path) -> None:
    """Of a night that the store does not hold, one line names those it does."""
    other = ("--since", "2026-03-04", "--until", "2026-03-05", "--loop", CALM, "--store", str(store))
    result = CliRunner().invoke(main, ["tune", MILL, "--loops", LOOPS, *other])
    assert result.exit_code == 2
    assert "holds no night 2026-03-04" in result.stderr
    assert "2026-03-03" in result.stderr
