"""Loops with integral action alone: a healthy one stays, one that rings is named and gets a longer integral time."""

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
    """The loop's row of a night."""
    (folder / "trends").mkdir()
    c.trends("L", 10).to_parquet(folder / "trends" / "trends.parquet")
    pd.DataFrame([{"loop": "L", **c.row}]).to_csv(folder / "loops.csv", index=False)
    paths = str(folder / "trends"), "--loops", str(folder / "loops.csv"), "--store", str(folder / "store")
    told = CliRunner().invoke(main, ["run", *paths, "--jobs", "1"])
    assert told.exit_code == 0, told.output
    told = CliRunner().invoke(main, ["rank", str(folder / "store"), "--format", "json"])
    assert told.exit_code == 0, told.output
    (row,) = json.loads(told.stdout)
    return row


def test_a_healthy_one_stays(tmp_path: Path) -> None:
    """A slow integral before a lag is not blamed."""
    row = night(controlled(FORM, "healthy", SEED, 1.0), tmp_path)
    assert (row["cause"], row["action"]) == ("none", "none")


@pytest.mark.parametrize("tight", [3.0, 5.0])
def test_one_that_rings_is_named_and_calmed(tight: float, tmp_path: Path) -> None:
    """With nine or twenty-five times the integral it rings; typed in, the advice raises the error by a sixth at most
    and calms OP."""
    before = controlled(FORM, "healthy", SEED, 1.0, tight)
    row = night(before, tmp_path)
    assert (row["cause"], row["action"], float(row["kp_new"])) == ("tuning", "retune", 0.0)
    after = controlled(FORM, "healthy", SEED, 1.0, tight, (0.0, float(row["ti_new"])))
    error = [np.abs(c.sp - c.pv).mean() for c in (before, after)]
    travel = [np.abs(np.diff(c.op)).sum() for c in (before, after)]
    assert error[1] < 1.17 * error[0]
    assert travel[1] < 0.7 * travel[0]
