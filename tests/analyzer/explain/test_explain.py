"""`explain` and `simulate` from an export: contract, bad input, and test rigs of public laboratories."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from analyzer.cli import main
from identification.models import Backlash, Fopdt, Loop, Pid
from identification.simulation.closed_loop import closed_loop

pytestmark = pytest.mark.slow

RIGS = Path(__file__).parents[3].parent / "shared" / "recordings" / "rigs"
KEYS = {"loop", "verdict", "block", "effects", "where", "fit", "moved", "remaining", "reason", "night"}
N = 4000
rigs = pytest.mark.skipif(not RIGS.exists(), reason="the real recordings lie outside the repository")


def export(folder: Path, name: str, seed: int, width: float) -> Path:
    """An export of loop A with backlash of that width; the time stamps scatter by a hundredth of a sample."""
    rng = np.random.default_rng(seed)
    sp = 50 + np.repeat(rng.uniform(-7, 7, N // 150 + 1), 150)[:N]
    loop = Loop(Fopdt(1.2, 20.0, 3.4), Pid(1.8, 20.0), Backlash(width) if width else None)
    r = closed_loop(loop, sp, np.cumsum(rng.normal(0, 0.02, N)) + rng.normal(0, 0.08, N))
    stamp = np.round((np.arange(N) + rng.normal(0, 0.01, N)) * 1000)
    frame = pd.DataFrame({"timestamp": pd.Timestamp("2026-03-02") + pd.to_timedelta(stamp, unit="ms")})
    frame["A.SP"], frame["A.PV"], frame["A.OP"] = sp, np.round(r.pv, 2), np.round(r.op, 2)
    frame.to_parquet(folder / name, index=False)
    (folder / "loops.csv").write_text("loop,kp,ti,scan_s,pv_lo,pv_hi\nA,1.8,20,1,0,100\n")
    return folder / name


def run_command(*words: str | Path) -> tuple[int, str]:
    """Exit status and output of a command."""
    done = CliRunner().invoke(main, [str(w) for w in words])
    return done.exit_code, done.output if done.exit_code else done.stdout


@pytest.fixture(scope="module")
def weeks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the export of a week with backlash, the export of the next week, the answer and the model."""
    folder = tmp_path_factory.mktemp("played")
    week = export(folder, "week.parquet", 1, 2.0)
    export(folder, "next.parquet", 2, 2.0)
    answer = run_command(
        "explain", week, "--loops", folder / "loops.csv", "--loop", "A", "--format", "json",
        "--save-model", folder / "model.json",
    )  # fmt: skip
    (folder / "said.json").write_text(answer[1])
    return folder


def test_answer_keeps_its_contract(weeks: Path) -> None:
    """The JSON has the keys of the contract, one verdict, and parameters with a value and an interval."""
    answer = json.loads((weeks / "said.json").read_text())
    assert set(answer) == KEYS
    assert (answer["verdict"], answer["block"]) == ("backlash", "valve")
    width = answer["effects"][0]["parameters"]["backlash_pct"]
    assert width["low"] < 2.0 < width["high"] or abs(width["value"] - 2.0) < 0.1
    assert answer["fit"]["explained"]["held_out"]["rmse"] < answer["fit"]["baseline"]["held_out"]["rmse"]


def test_model_runs_over_next_week(weeks: Path) -> None:
    """On the next recording the model gives one row for each recorded sample, and its error is small."""
    out = weeks / "sim.parquet"
    status, _ = run_command(
        "simulate", weeks / "model.json", weeks / "next.parquet", "--loops", weeks / "loops.csv",
        "--loop", "A", "--out", out,
    )  # fmt: skip
    assert status == 0
    frame, recorded = pd.read_parquet(out), pd.read_parquet(weeks / "next.parquet")
    assert list(frame.columns) == ["timestamp", "PV", "OP"]
    assert (frame["timestamp"].to_numpy() == recorded["timestamp"].to_numpy()).mean() > 0.99
    load = recorded["A.PV"].to_numpy() - frame["PV"].to_numpy()
    assert np.std(np.diff(load)) < 0.2


def test_other_loops_model_is_refused(weeks: Path) -> None:
    """A model of another loop ends with one line and status 2."""
    data = json.loads((weeks / "model.json").read_text()) | {"loop": "B"}
    (weeks / "other.json").write_text(json.dumps(data))
    status, text = run_command(
        "simulate", weeks / "other.json", weeks / "next.parquet", "--loops", weeks / "loops.csv",
        "--loop", "A", "--out", weeks / "no.parquet",
    )  # fmt: skip
    assert status == 2
    assert "a model of B" in text
    assert "Traceback" not in text


def test_a_constant_output_gives_no_explanation(tmp_path: Path) -> None:
    """Without a move of OP the verdict is `unexplained`, with exit status 2."""
    path = export(tmp_path, "still.parquet", 3, 0.0)
    frame = pd.read_parquet(path)
    frame["A.OP"] = 50.0
    frame.to_parquet(path, index=False)
    status, text = run_command(
        "explain", path, "--loops", tmp_path / "loops.csv", "--loop", "A", "--format", "json"
    )
    assert status == 2
    assert '"verdict": "unexplained"' in text


def of_rig(name: str) -> dict:
    """The explanation of a recording of a rig, without loops.csv."""
    loop = name.split("-")[0]
    status, text = run_command("explain", RIGS / f"{name}.parquet", "--loop", loop, "--format", "json")
    assert status == 0
    return json.loads(text)


@rigs
def test_dryer_needs_a_higher_order_only() -> None:
    """The hair dryer gets a second lag, an inverse response or no effect; no valve, sensor fault or drift is
    reported.
    """
    assert of_rig("DRYER")["verdict"] in ("second-lag", "inverse-response", "none")


@rigs
def test_duct_step_shows_its_slow_mode() -> None:
    """The open-loop step of the hot-air duct gives the slow mode."""
    answer = of_rig("DUCT-03_air_step_1_5_90")
    assert "slow-mode" in [e["name"] for e in answer["effects"]]


@rigs
def test_heat_exchanger_valve_is_curved() -> None:
    """The gain of the heat exchanger depends on valve position or PV."""
    answer = of_rig("PHX-2022_06_11_17_30_NORMAL")
    names = {e["name"] for e in answer["effects"]}
    assert names & {"valve-characteristic", "nonlinear-gain", "split-range"}


def test_settings_that_op_follows_are_reported_if_none_are_stated(weeks: Path) -> None:
    """Without kp and ti in loops.csv the answer contains the settings that OP follows, within 5 %; with them it has
    no such key.
    """
    bare = weeks / "bare.csv"
    bare.write_text("loop,scan_s,pv_lo,pv_hi\nA,1,0,100\n")
    status, text = run_command(
        "explain", weeks / "week.parquet", "--loops", bare, "--loop", "A", "--format", "json"
    )
    assert status == 0
    law = json.loads(text)["controller"]
    assert law["kp"] == pytest.approx(1.8, rel=0.05)
    assert law["ti_s"] == pytest.approx(20.0, rel=0.05)
    assert "controller" not in json.loads((weeks / "said.json").read_text())
