"""One loop and night have one answer: `rank`, `tune`, `explain` and the pages give the same decision."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.pages.night import pages_of_night
from analyzer.store.store import Store
from proofs.walk import cells, of_page, of_tune

MILL, STATED = "sample_data/mill.parquet", Path("sample_data/loops.csv")
NIGHT = ("--since", "2026-03-03", "--until", "2026-03-04")
FOLLOWER, WORN, CALM = "LIC2103", "TIC2106", "FIC2113"
TESTED = (FOLLOWER, WORN, CALM)
OTHERS = ("FIC2110", "LIC2107", "TIC2111", "FIC2122", "TIC2121", "TIC2118", "PIC2116")
"""A source, a level, a cascade with its worn slave, a loop at its limit and one without fault."""
"""Loops for `tune`; tests/proofs/test_walk.py runs it for the complete mill and for two plants."""


def output_of(*words: str) -> str:
    """The output of a command on stdout."""
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(scope="module")
def arguments(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, ...]:
    """Ten loops of a night of the mill, as arguments of commands."""
    path = tmp_path_factory.mktemp("stated") / "loops.csv"
    head, *rows = STATED.read_text("utf-8").splitlines()
    kept = [row for row in rows if row.split(",")[0] in (*TESTED, *OTHERS)]
    path.write_text("\n".join((head, *kept)) + "\n", "utf-8")
    return MILL, "--loops", str(path), *NIGHT


@pytest.fixture(scope="module")
def store(arguments: tuple[str, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of that night."""
    folder = tmp_path_factory.mktemp("one") / "store"
    output_of("run", *arguments, "--store", str(folder))
    return folder


@pytest.fixture(scope="module")
def ranked(store: Path) -> dict[str, dict[str, Any]]:
    """Its rows by loop."""
    return {row["loop"]: row for row in json.loads(output_of("rank", str(store), "--format", "json"))}


@pytest.mark.parametrize("loop", TESTED)
def test_tune_agrees_with_the_night(
    loop: str, arguments: tuple[str, ...], store: Path, ranked: dict[str, dict[str, Any]]
) -> None:
    """`tune` gives the cells of `rank`, with the store of the night, for each tested loop."""
    assert list(of_tune(arguments, ranked[loop], str(store))) == []


def test_every_page_agrees_with_the_row(store: Path, ranked: dict[str, dict[str, Any]]) -> None:
    """For each loop of the mill, action, cause, reason and settings on the page are those of `rank`."""
    pages = {page.title: page for page in pages_of_night(Store(store))}
    assert [line for loop, row in ranked.items() for line in of_page(pages[loop], row)] == []


def test_a_forecast_is_of_the_settings_that_were_decided(
    arguments: tuple[str, ...], store: Path, ranked: dict[str, dict[str, Any]]
) -> None:
    """The settings in the text of `tune` are those of the row, and only a loop with the action retune has
    settings.
    """
    text = output_of("tune", *arguments, "--loop", WORN, "--store", str(store))
    row = ranked[WORN]
    assert ("new settings:" in text) == (row["action"] == "retune")
    if row["action"] == "retune":
        assert f"kp {row['kp_new']:.3g}" in text


def test_explain_begins_with_what_the_night_found(
    arguments: tuple[str, ...], store: Path, ranked: dict[str, dict[str, Any]]
) -> None:
    """`explain` gives the decision of the night before its own result, in text and as data."""
    words = ("explain", *arguments, "--loop", WORN, "--store", str(store))
    answer = json.loads(output_of(*words, "--format", "json"))
    assert cells(answer["night"]) == cells(ranked[WORN])
    assert f"found: cause {ranked[WORN]['cause']}; valve {ranked[WORN]['valve_fault']}" in " ".join(
        output_of(*words).split()
    )


def test_a_night_that_the_store_lacks_is_one_line(store: Path) -> None:
    """For a night that the store does not have, one line names the nights that it has."""
    other = ("--since", "2026-03-04", "--until", "2026-03-05", "--loop", CALM, "--store", str(store))
    result = CliRunner().invoke(main, ["tune", MILL, "--loops", str(STATED), *other])
    assert result.exit_code == 2
    assert "holds no night 2026-03-04" in result.stderr
    assert "2026-03-03" in result.stderr
