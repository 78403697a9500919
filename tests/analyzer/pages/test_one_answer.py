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
from proofs.walk import cells, of_page, of_tune

MILL, STATED = "sample_data/mill.parquet", Path("sample_data/loops.csv")
NIGHT = ("--since", "2026-03-03", "--until", "2026-03-04")
FOLLOWER, WORN, CALM = "LIC2103", "TIC2106", "FIC2113"
WALKED = (FOLLOWER, WORN, CALM)
OTHERS = ("FIC2110", "LIC2107", "TIC2111", "FIC2122", "TIC2121", "TIC2118", "PIC2116")
"""A source, a level, a cascade with its worn slave, a loop at its limit and a healthy one."""
"""Loops that `tune` is asked of; tests/proofs/test_walk.py asks it of the whole mill and of two plants."""


def said(*words: str) -> str:
    """What a command prints on stdout."""
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, ...]:
    """Ten loops of a night of the mill, as commands take them."""
    path = tmp_path_factory.mktemp("stated") / "loops.csv"
    head, *rows = STATED.read_text("utf-8").splitlines()
    kept = [row for row in rows if row.split(",")[0] in (*WALKED, *OTHERS)]
    path.write_text("\n".join((head, *kept)) + "\n", "utf-8")
    return MILL, "--loops", str(path), *NIGHT


@pytest.fixture(scope="module")
def store(asked: tuple[str, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of that night."""
    folder = tmp_path_factory.mktemp("one") / "store"
    said("run", *asked, "--store", str(folder))
    return folder


@pytest.fixture(scope="module")
def ranked(store: Path) -> dict[str, dict[str, Any]]:
    """Its rows by loop."""
    return {row["loop"]: row for row in json.loads(said("rank", str(store), "--format", "json"))}


@pytest.mark.parametrize("loop", WALKED)
def test_tune_decides_as_the_night_did(
    loop: str, asked: tuple[str, ...], store: Path, ranked: dict[str, dict[str, Any]]
) -> None:
    """With the night's store and without one `tune` tells the cells of `rank`; it tells nothing of a loop that the
    night could not assess."""
    assert list(of_tune(asked, ranked[loop], str(store))) == []


def test_every_page_tells_the_row(store: Path, ranked: dict[str, dict[str, Any]]) -> None:
    """Of each loop of the mill the page's action, cause, reason and settings are those of `rank`."""
    pages = {page.title: page for page in pages_of_night(Store(store))}
    assert [line for loop, row in ranked.items() for line in of_page(pages[loop], row)] == []


def test_a_forecast_is_of_the_settings_that_were_decided(
    asked: tuple[str, ...], store: Path, ranked: dict[str, dict[str, Any]]
) -> None:
    """The settings in the text of `tune` are those of the row, and only a loop that is to be retuned has some."""
    text = said("tune", *asked, "--loop", WORN, "--store", str(store))
    row = ranked[WORN]
    assert ("new settings:" in text) == (row["action"] == "retune")
    if row["action"] == "retune":
        assert f"kp {row['kp_new']:.3g}" in text


def test_explain_begins_with_what_the_night_found(
    asked: tuple[str, ...], store: Path, ranked: dict[str, dict[str, Any]]
) -> None:
    """`explain` tells the night's decision before what the physics adds, in text and as data."""
    words = ("explain", *asked, "--loop", WORN, "--store", str(store))
    told = json.loads(said(*words, "--format", "json"))
    assert cells(told["night"]) == cells(ranked[WORN])
    assert f"found: cause {ranked[WORN]['cause']}; valve {ranked[WORN]['valve_fault']}" in " ".join(
        said(*words).split()
    )


def test_a_night_that_the_store_lacks_is_one_line(store: Path) -> None:
    """Of a night that the store does not hold, one line names those it does."""
    other = ("--since", "2026-03-04", "--until", "2026-03-05", "--loop", CALM, "--store", str(store))
    result = CliRunner().invoke(main, ["tune", MILL, "--loops", str(STATED), *other])
    assert result.exit_code == 2
    assert "holds no night 2026-03-04" in result.stderr
    assert "2026-03-03" in result.stderr
