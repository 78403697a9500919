"""Loops with integral action alone: one without fault is unchanged, and one that rings gets a longer integral
time.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from analyzer.cli import main
from proofs.controllers_plant import Controlled, controlled

FORM, SEED = "integral only", 4


def night(c: Controlled, folder: Path) -> dict[str, Any]:
    """The row of the loop for a night."""
    (folder / "trends").mkdir()
    c.trends("L", 10).to_parquet(folder / "trends" / "trends.parquet")
    pd.DataFrame([{"loop": "L", **c.row}]).to_csv(folder / "loops.csv", index=False)
    paths = str(folder / "trends"), "--loops", str(folder / "loops.csv"), "--store", str(folder / "store")
    done = CliRunner().invoke(main, ["run", *paths, "--jobs", "1"])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(main, ["rank", str(folder / "store"), "--format", "json"])
    assert done.exit_code == 0, done.output
    (row,) = json.loads(done.stdout)
    return row


def test_a_loop_without_fault_is_unchanged(tmp_path: Path) -> None:
    """A slow integral controller of a lag has no cause and no action."""
    row = night(controlled(FORM, "healthy", SEED, 1.0), tmp_path)
    assert (row["cause"], row["action"]) == ("none", "none")


@pytest.mark.parametrize("tight", [3.0, 5.0])
def test_a_loop_that_rings_is_named_and_its_travel_reduced(tight: float, tmp_path: Path) -> None:
    """With nine or twenty-five times the integral gain the loop rings.

    With the advised settings the error rises by at most 17 %, and the travel of OP falls by at least 30 %.
    """
    before = controlled(FORM, "healthy", SEED, 1.0, tight)
    row = night(before, tmp_path)
    assert (row["cause"], row["action"], float(row["kp_new"])) == ("tuning", "retune", 0.0)
    after = controlled(FORM, "healthy", SEED, 1.0, tight, (0.0, float(row["ti_new"])))
    error = [np.abs(c.sp - c.pv).mean() for c in (before, after)]
    travel = [np.abs(np.diff(c.op)).sum() for c in (before, after)]
    assert error[1] < 1.17 * error[0]
    assert travel[1] < 0.7 * travel[0]
