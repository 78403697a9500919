"""`explain --held-out`: what was found in one recording put to the proof on others of the same loop."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from identification.mismatch.explanation import together
from identification.mismatch.proof import Misfit
from tests.analyzer.explain.test_explain import asked, export


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings of a loop with play and one of the same loop after its linkage was mended."""
    at = tmp_path_factory.mktemp("held")
    export(at, "week.parquet", 1, 2.0)
    export(at, "next.parquet", 2, 2.0)
    export(at, "mended.parquet", 3, 0.0)
    return at


def told(folder: Path, *others: str) -> dict:
    """The answer for the first week, other recordings held out."""
    words = [w for name in others for w in ("--held-out", folder / name)]
    status, said = asked(
        "explain", folder / "week.parquet", *words, "--loops", folder / "loops.csv", "--loop", "A", "--format", "json"
    )  # fmt: skip
    assert status == 0
    return json.loads(said.splitlines()[-1])


def test_play_carries_over_to_the_next_week(folder: Path) -> None:
    """A play that is there in both weeks removes misfit in the week that was not fitted; the answer says how much."""
    said = told(folder, "next.parquet")
    assert said["verdict"] == "backlash"
    (there,) = said["held_out_on"]
    assert there["recording"] == "next.parquet"
    assert there["share"] > 0.1
    assert there["explained"]["rmse"] < there["baseline"]["rmse"]
    assert said["effects"][0]["held_out_share"] == pytest.approx(there["share"])
    assert said["fit"]["explained"]["held_out"]["rmse"] == pytest.approx(there["explained"]["rmse"])


@pytest.mark.slow
def test_what_does_not_carry_over_has_no_name(folder: Path) -> None:
    """Where the other recording contradicts it nothing is told as found, and why is said."""
    said = told(folder, "mended.parquet")
    assert said["verdict"] == "unexplained"
    assert said["effects"] == []
    assert "backlash" in said["reason"]
    assert "other recordings" in said["reason"]


@pytest.mark.slow
def test_page_and_text_tell_each_recording(folder: Path, tmp_path: Path) -> None:
    """Text and page name every recording held out with both misfits."""
    common = ("--held-out", folder / "next.parquet", "--loops", folder / "loops.csv", "--loop", "A")
    assert "next.parquet" in asked("explain", folder / "week.parquet", *common)[1]
    asked("explain", folder / "week.parquet", *common, "--format", "html", "--out", tmp_path)
    (page,) = tmp_path.glob("*.html")
    assert "next.parquet" in page.read_text()


def test_missing_recording_is_one_line(folder: Path) -> None:
    """A held-out file that is not there ends in one line with status 2, before anything is computed."""
    status, said = asked(
        "explain", folder / "week.parquet", "--held-out", folder / "gone.parquet", "--loops", folder / "loops.csv",
        "--loop", "A",
    )  # fmt: skip
    assert status == 2
    assert "gone.parquet" in said


def test_misfits_add_up_by_their_squares() -> None:
    """Misfits of two recordings together are those of the two stacked."""
    rng = np.random.default_rng(1)
    moves = [rng.normal(0, 3, 500), rng.normal(0, 1, 1500)]
    left = [rng.normal(0, 1, 500), rng.normal(0, 0.5, 1500)]
    for x in (*moves, *left):
        x -= x.mean()
    parts = [
        Misfit(float(e.std()), 100 * (1 - float(e.std() / m.std()))) for e, m in zip(left, moves, strict=True)
    ]
    all_of = together(parts, [500, 1500])
    assert all_of.rmse == pytest.approx(float(np.concatenate(left).std()))
    assert all_of.fit_pct == pytest.approx(
        100 * (1 - np.concatenate(left).std() / np.concatenate(moves).std())
    )
