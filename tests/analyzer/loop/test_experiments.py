"""Experiments in a record, with the commands check, run, tune, explain, test-plan and pages."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.config import Config
from analyzer.loop.experiments.found import experiment_results
from analyzer.night.opened import opened
from analyzer.night.request import export_request

INPUTS = Path(__file__).parents[3].parent / "shared" / "inputs"
shared = pytest.mark.skipif(
    not INPUTS.is_dir(), reason="needs ../shared/inputs, which only the study's machine has"
)


def output_of(*arguments):
    """The output of a command on stdout."""
    done = CliRunner().invoke(main, list(map(str, arguments)), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.stdout


def learned_from(name, loops=None):
    """The results of the experiments in a file of the study for its one loop."""
    export = INPUTS / f"{name}.csv"
    plant = opened(export_request([export], loops and INPUTS / loops, None, Config()))
    one = plant.last_night(plant.loops[0])
    return experiment_results(one.spec, plant.trends(one.spec.tags, one.night), one.prepared, plant.config)


@pytest.fixture(scope="module")
def bump(tmp_path_factory):
    """Two hours in manual at 5 s, OP stepped 40, 45, 38, 44 %: gain 1.2, lag 100 s, dead time 20 s."""
    folder = tmp_path_factory.mktemp("bump")
    t = np.arange(0.0, 7200.0, 1.0)
    op = np.select([t < 1200, t < 3000, t < 5000], [40.0, 45.0, 38.0], 44.0)
    pv, y = np.empty(t.size), 0.0
    for k in range(t.size):
        pv[k] = y
        y += (1.2 * (op[max(k - 20, 0)] - 40.0) - y) / 100.0
    pv += 50.0 + 0.1 * np.random.default_rng(3).normal(size=t.size)
    stamps = pd.date_range("2026-05-04 08:00", periods=t.size, freq="s")
    mode = np.full(t.size, "MAN", dtype=object)
    frame = pd.DataFrame({"timestamp": stamps, "T1.PV": pv, "T1.SP": 50.0, "T1.OP": op, "T1.MODE": mode})
    frame[::5].to_csv(folder / "bump.csv", index=False)
    (folder / "loops.csv").write_text("loop,kp,ti,pv_lo,pv_hi\nT1,0.2,600,0,100\n")
    return folder


def test_a_night_in_manual_with_a_bump_test_has_model_and_settings(bump, tmp_path):
    """`run` stores gain, lag, dead time and new settings of a loop that was in manual all night."""
    output_of(
        "run", bump / "bump.csv", "--loops", bump / "loops.csv", "--store", tmp_path / "s", "--jobs", "1"
    )
    (row,) = json.loads(output_of("rank", tmp_path / "s", "--format", "json"))
    assert row["status"] == "ok"
    assert row["gain"] == pytest.approx(1.2, rel=0.05)
    assert row["time_constant_s"] == pytest.approx(100.0, rel=0.1)
    assert row["dead_time_s"] == pytest.approx(20.0, abs=6.0)
    assert row["action"] == "retune"
    assert row["kp_new"] > 0.4
    assert "model from steps of OP" in row["reason"]
    output_of("pages", tmp_path / "s", "--out", tmp_path / "p")
    (page,) = (tmp_path / "p").glob("T1-*.html")
    assert "Experiments" in page.read_text()
    morning = (tmp_path / "p" / "index.html").read_text()
    assert "<b>0</b> <span>undecided" in " ".join(morning.split()).replace("</b><span>", "</b> <span>")
    beliefs = pd.read_parquet(next((tmp_path / "s").rglob("*beliefs*")))
    assert json.loads(beliefs["constants"][0])["gain"][0] == pytest.approx(1.2, rel=0.05)


def test_check_and_tune_report_the_experiment(bump):
    """`check` lists the experiment with its span; `tune` prints the model, SIMC settings and what the test does not
    identify.
    """
    arguments = bump / "bump.csv", "--loops", bump / "loops.csv"
    checked = output_of("check", *arguments)
    assert "experiment 2026-05-04 08:00 to" in checked
    assert "fit only for a model from its experiments" in checked
    tuned = output_of("tune", *arguments, "--loop", "T1")
    assert "SIMC with tau_c = dead time: kp" in tuned
    assert "not identified by the experiment: the process outside OP 38 to 45 %" in tuned


def test_a_test_plan_names_size_levels_and_times(bump):
    """`test-plan` prints the step size against noise, both directions, the duration, and the expected accuracy of the
    gain.
    """
    plan = output_of("test-plan", bump / "bump.csv", "--loops", bump / "loops.csv", "--loop", "T1")
    assert "step of OP:" in plan
    assert plan.count("→") == 4
    assert "accuracy of the gain" in plan


def test_op_at_zero_before_and_after_a_test_is_no_limit(tmp_path):
    """An oven stepped 0, 30, 0 % by a script, without SP and mode, is a record in manual without OP at a limit."""
    t = np.arange(0.0, 12000.0, 10.0)
    op = np.where((t > 600.0) & (t < 6000.0), 30.0, 0.0)
    pv, y = np.empty(t.size), 0.0
    for k in range(t.size):
        pv[k] = y
        y += 10.0 * (1.5 * op[max(k - 10, 0)] - y) / 900.0
    pv += 25.0 + 0.1 * np.random.default_rng(3).normal(size=t.size)
    stamps = pd.date_range("2026-05-04 08:00", periods=t.size, freq="10s")
    pd.DataFrame({"timestamp": stamps, "T5.PV": pv, "T5.OP": op}).to_csv(tmp_path / "oven.csv", index=False)
    assert "saturated" not in output_of("check", tmp_path / "oven.csv")
    output_of("run", tmp_path / "oven.csv", "--store", tmp_path / "s", "--jobs", "1")
    (row,) = json.loads(output_of("rank", tmp_path / "s", "--format", "json"))
    assert "model from steps of OP" in row["reason"]
    assert "limit" not in row["reason"]
    assert row["action"] == "check settings"  # no settings are stated, and the model has settings


def test_a_loop_in_automatic_has_no_experiment_by_hand():
    """Of the 22 loops of the sample mill, only FIC2117, which operators move in manual, has experiments by hand."""
    mill = Path(__file__).parents[3] / "sample_data"
    arguments = (
        "check",
        str(mill / "mill.parquet"),
        "--loops",
        str(mill / "loops.csv"),
        "--until",
        "2026-03-03",
    )
    lines = CliRunner().invoke(main, arguments, catch_exceptions=False).stdout.splitlines()
    by_hand = [at for at, line in enumerate(lines) if line.startswith("  experiment") and "of OP" in line]
    named = {
        next(x for x in reversed(lines[:at]) if not x.startswith("  ")).partition(":")[0] for at in by_hand
    }
    assert named <= {"FIC2117"}


@shared
def test_the_bump_test_of_the_study():
    """OP stepped 40, 45, 38, 44 % in manual gives gain 1.8, time constant 90 s, dead time 20 s (inputs/README.md)."""
    e = learned_from("bump-test", "bump-test-loops.csv").model.estimates
    assert e["gain"].value == pytest.approx(1.8, rel=0.02)
    assert e["lags_s"].value == pytest.approx(90.0, rel=0.03)
    assert e["dead_time_s"].value == pytest.approx(20.0, abs=1.1)


@shared
@pytest.mark.parametrize("name", ["step-test-even", "step-test-jitter"])
def test_an_oven_stepped_from_its_limit(name):
    """OP 0, 30, 0 % gives gain 2.0 in its own units, lags 2,400 and 450 s and dead time 300 s, with or without
    jitter.
    """
    found = learned_from(name)
    e, scale = found.model.estimates, found.prepared.scale
    assert e["gain"].value * scale.span / scale.op_span == pytest.approx(2.0, rel=0.03)
    assert e["time_constant_s"].value == pytest.approx(2400.0, rel=0.05)
    assert e["second_lag_s"].value == pytest.approx(450.0, rel=0.1)
    assert e["dead_time_s"].value == pytest.approx(300.0, abs=20.0)


@shared
def test_a_long_step_is_fitted_completely():
    """One step at ten samples a second gives gain 0.60, lag 170 s, dead time 150 s (inputs/README.md)."""
    e = learned_from("long-step-test", "long-step-test-loops.csv").model.estimates
    assert e["gain"].value == pytest.approx(0.6, rel=0.02)
    assert e["lags_s"].value == pytest.approx(170.0, rel=0.03)
    assert e["dead_time_s"].value == pytest.approx(150.0, rel=0.03)


@shared
def test_a_warm_up_has_a_heater_s_sign():
    """A heater with lags of 250 and 25 s, started cold under PI, has a positive gain and a sum of lags near 275 s.

    Accepted are sums from 200 to 330 s.
    """
    e = learned_from("warm-up", "warm-up-loops.csv").model.estimates
    assert e["gain"].low > 0
    assert 200.0 < e["lags_s"].value < 330.0
    assert e["second_lag_s"].value == pytest.approx(25.0, rel=0.2)


def test_a_model_against_the_controller_is_not_reported(tmp_path):
    """Set point steps of a loop whose stated controller acts in the other direction give no model."""
    rng, y, integral = np.random.default_rng(5), 0.0, 0.0
    sp = np.repeat([50.0, 55.0, 48.0, 53.0], 900)
    pv, op = np.empty(sp.size), np.full(sp.size, 40.0)
    for k in range(sp.size):
        pv[k] = 50.0 + y + 0.02 * rng.normal()
        integral += (sp[k] - pv[k]) / 60.0
        op[k] = 40.0 + 0.8 * (sp[k] - pv[k] + integral)
        y += (1.2 * (op[max(k - 5, 0)] - 40.0) - y) / 60.0
    stamps = pd.date_range("2026-05-04 08:00", periods=sp.size, freq="s")
    frame = pd.DataFrame({"timestamp": stamps, "T1.PV": pv, "T1.SP": sp, "T1.OP": op})
    frame.to_csv(tmp_path / "steps.csv", index=False)

    def model(kp):
        (tmp_path / "loops.csv").write_text(f"loop,kp,ti,pv_lo,pv_hi\nT1,{kp},60,0,100\n")
        plant = opened(export_request([tmp_path / "steps.csv"], tmp_path / "loops.csv", None, Config()))
        one = plant.last_night(plant.loops[0])
        return experiment_results(
            one.spec, plant.trends(one.spec.tags, one.night), one.prepared, plant.config
        )

    right, wrong = model(0.8), model(-0.8)
    assert right.model.estimates["gain"].value == pytest.approx(1.2, rel=0.1)
    assert wrong.model is None
    assert "opposite sign of its controller" in wrong.without_model[0][1]
