"""`explain --held-out`: a finding of one recording is tested on other recordings of the same loop."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from identification.mismatch.explanation import pooled_misfit
from identification.mismatch.proof import Misfit
from tests.analyzer.explain.test_explain import export, run_command


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings of a loop with backlash and one of the same loop after a repair of its linkage."""
    at = tmp_path_factory.mktemp("held")
    export(at, "week.parquet", 1, 2.0)
    export(at, "next.parquet", 2, 2.0)
    export(at, "mended.parquet", 3, 0.0)
    return at


def answer_for(folder: Path, *others: str) -> dict:
    """The answer for the first week, with other recordings held out."""
    words = [w for name in others for w in ("--held-out", folder / name)]
    status, answer = run_command(
        "explain", folder / "week.parquet", *words, "--loops", folder / "loops.csv", "--loop", "A", "--format", "json"
    )  # fmt: skip
    assert status == 0
    return json.loads(answer.splitlines()[-1])


def test_backlash_is_also_found_in_the_next_week(folder: Path) -> None:
    """A backlash that both weeks contain reduces the misfit of the week that was not fitted, and the answer states by
    how much.
    """
    answer = answer_for(folder, "next.parquet")
    assert answer["verdict"] == "backlash"
    (there,) = answer["held_out_on"]
    assert there["recording"] == "next.parquet"
    assert there["share"] > 0.1
    assert there["explained"]["rmse"] < there["baseline"]["rmse"]
    assert answer["effects"][0]["held_out_share"] == pytest.approx(there["share"])
    assert answer["fit"]["explained"]["held_out"]["rmse"] == pytest.approx(there["explained"]["rmse"])


@pytest.mark.slow
def test_an_effect_that_other_recordings_contradict_is_not_reported(folder: Path) -> None:
    """If the other recording contradicts a finding, no effect is reported, and the reason is given."""
    answer = answer_for(folder, "mended.parquet")
    assert answer["verdict"] == "unexplained"
    assert answer["effects"] == []
    assert "backlash" in answer["reason"]
    assert "other recordings" in answer["reason"]


@pytest.mark.slow
def test_page_and_text_name_each_recording(folder: Path, tmp_path: Path) -> None:
    """Text and page name each held-out recording."""
    common = ("--held-out", folder / "next.parquet", "--loops", folder / "loops.csv", "--loop", "A")
    assert "next.parquet" in run_command("explain", folder / "week.parquet", *common)[1]
    run_command("explain", folder / "week.parquet", *common, "--format", "html", "--out", tmp_path)
    (page,) = tmp_path.glob("*.html")
    assert "next.parquet" in page.read_text()


def test_missing_recording_is_one_line(folder: Path) -> None:
    """A held-out file that does not exist ends in one line with status 2."""
    status, answer = run_command(
        "explain", folder / "week.parquet", "--held-out", folder / "gone.parquet", "--loops", folder / "loops.csv",
        "--loop", "A",
    )  # fmt: skip
    assert status == 2
    assert "gone.parquet" in answer


def test_misfits_add_up_by_their_squares() -> None:
    """The combined misfit of two recordings equals the misfit of both recordings joined."""
    rng = np.random.default_rng(1)
    moves = [rng.normal(0, 3, 500), rng.normal(0, 1, 1500)]
    left = [rng.normal(0, 1, 500), rng.normal(0, 0.5, 1500)]
    for x in (*moves, *left):
        x -= x.mean()
    parts = [
        Misfit(float(e.std()), 100 * (1 - float(e.std() / m.std()))) for e, m in zip(left, moves, strict=True)
    ]
    all_of = pooled_misfit(parts, [500, 1500])
    assert all_of.rmse == pytest.approx(float(np.concatenate(left).std()))
    assert all_of.fit_pct == pytest.approx(
        100 * (1 - np.concatenate(left).std() / np.concatenate(moves).std())
    )
