"""One loop and night, one answer: `rank`, `tune` and `explain` tell the same decision."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from analyzer.cli import main

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


@pytest.mark.parametrize("loop", [FOLLOWER, WORN, CALM])
def test_tune_decides_as_the_night_did(loop: str, store: Path, ranked: dict[str, dict[str, Any]]) -> None:
    """With the night's store and without one `tune` tells the cells of `rank`: of a follower, a worn valve, a calm
    loop."""
    for more in ((), ("--store", str(store))):
        told = json.loads(
            said("tune", MILL, "--loops", LOOPS, *NIGHT, "--loop", loop, "--format", "json", *more)
        )
        assert cells(told["decision"]) == cells(ranked[loop])
        assert f"action: {ranked[loop]['action']}" in told["text"]


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
