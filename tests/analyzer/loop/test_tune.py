"""`triage tune` on small exports: the proposal, its pictures, and the reason if there is no proposal."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from proofs.plant import START_S, Sketch, Trends, simulate

TANK = Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5)
STATED = "0.9,40,0,100"


@pytest.fixture(scope="module")
def tank() -> Trends:
    """Two and a half hours of a tank with a backlash of 2.5 %."""
    return simulate(TANK, 2.5)


def tune_result(folder: Path, trends: Trends, stated: str = STATED, *more: str) -> Result:
    """Result of `triage tune` on an export of one loop with kp, ti, pv_lo and pv_hi as stated."""
    stamp = pd.to_datetime(START_S + np.arange(trends.pv.size), unit="s")
    columns = {"timestamp": stamp, "L.SP": trends.sp, "L.PV": trends.pv, "L.OP": trends.op}
    pd.DataFrame(columns).to_parquet(folder / "export.parquet")
    (folder / "loops.csv").write_text(f"loop,kp,ti,pv_lo,pv_hi\nL,{stated}\n")
    command = ["tune", str(folder / "export.parquet"), "--loops", str(folder / "loops.csv"), "--loop", "L"]
    return CliRunner().invoke(main, [*command, *more])


def clean(result: Result, status: int) -> str:
    """The output of a command that ended with the given exit status."""
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == status, result.output
    assert "Traceback" not in result.output
    return result.output


def refused(result: Result) -> str:
    """The one line of a command that had nothing to process."""
    clean(result, 2)
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1
    return result.stderr


@pytest.fixture(scope="module")
def tuned(tank, tmp_path_factory) -> tuple[str, Path]:
    """The output for the tank with its true settings, and the folder of its pictures."""
    folder = tmp_path_factory.mktemp("tuned")
    return clean(tune_result(folder, tank, STATED, "--out", str(folder / "pictures")), 0), folder / "pictures"


def test_backlash_gets_settings_and_three_pictures(tuned):
    """A tank with backlash gets a longer Ti at about its gain, its backlash within 10 %, a forecast and three
    pictures.
    """
    out, pictures = tuned
    assert "action: retune" in out
    kp, ti = map(float, re.search(r"new settings: kp ([\d.e+]+), ti ([\d.e+]+) s", out).groups())
    assert 0.7 < kp / TANK.kp < 1.4
    assert ti > 5 * TANK.ti
    width = float(re.search(r"backlash_pct: ([\d.]+)", out)[1])
    assert width == pytest.approx(TANK.backlash, rel=0.1)
    assert re.search(r"stem travel: .* -\d\d %", out)
    made = {p.name: p.read_bytes() for p in pictures.iterdir()}
    page = made.pop("settings.html").decode()
    assert set(made) == {"limit-cycle.svg", "travel-map.svg", "forecast.svg"}
    assert all(picture.startswith(b"<svg ") for picture in made.values())
    for name, label in (
        ("limit-cycle", "valve N(A)"),
        ("travel-map", "proposed"),
        ("forecast", "stem, proposed"),
    ):
        assert f">{label}<" in made[f"{name}.svg"].decode()
    assert "Try settings" in page
    assert "SIMC" in page


def test_settings_typed_in_reduce_the_travel_of_the_tank(tuned):
    """On the true tank, under the same load and noise, the proposal reduces the stem's travel by more than 80 %."""
    kp, ti = map(float, re.search(r"new settings: kp ([\d.e+]+), ti ([\d.e+]+) s", tuned[0]).groups())
    after = simulate(replace(TANK, kp=kp, ti=ti), 4.0)
    before = simulate(TANK, 4.0)
    late = slice(2 * 3600, None)
    assert np.abs(np.diff(after.stem[late])).sum() < 0.2 * np.abs(np.diff(before.stem[late])).sum()
    assert np.abs(after.pv[late] - 50).mean() < np.abs(before.pv[late] - 50).mean()


def test_settings_come_in_the_units_stated(tmp_path, tuned):
    """If settings are stated in minutes, Ti is given in minutes: the value in seconds over sixty."""
    (tmp_path / "loops.csv").write_text(f"loop,kp,ti,pv_lo,pv_hi,ti_unit\nL,0.9,{40 / 60},0,100,min\n")
    files = [str(tuned[1].parent / "export.parquet"), "--loops", str(tmp_path / "loops.csv")]
    minutes = clean(CliRunner().invoke(main, ["tune", *files, "--loop", "L"]), 0)
    ti_s, ti_min = (float(re.search(r"ti ([\d.e+]+) (?:s|min) ", x)[1]) for x in (tuned[0], minutes))
    assert ti_min == pytest.approx(ti_s / 60, rel=0.01)


def test_missing_values_change_little(tmp_path, tank):
    """A minute of NaN in PV changes neither the action nor the width of the backlash."""
    holed = tank.pv.copy()
    holed[100:160] = np.nan
    out = clean(tune_result(tmp_path, replace(tank, pv=holed)), 0)
    assert "action: retune" in out
    assert float(re.search(r"backlash_pct: ([\d.]+)", out)[1]) == pytest.approx(TANK.backlash, rel=0.1)


def test_integral_off_is_an_abstention(tmp_path, tank):
    """A stated Ti of 0 for a loop that oscillates by integral action is reported, with the settings that OP
    follows.
    """
    out = clean(tune_result(tmp_path, tank, "0.9,0,0,100", "--out", str(tmp_path / "pictures")), 0)
    assert "action: check settings" in out
    assert "no integral action" in out
    assert re.search(r"recorded about Kp 0\.(89|9|90|91)\d* %/%, Ti (39|40|41)", out)


def test_wrong_sign_is_an_abstention(tmp_path, tank):
    """A gain with the wrong sign gets no settings, and its sign is reported."""
    out = clean(tune_result(tmp_path, tank, "-0.9,40,0,100"), 0)
    assert "new settings:" not in out
    assert re.search(r"stated Kp -0\.9 %/%, Ti 40 s; recorded about Kp 0\.(89|9|90|91)", out)


def test_stale_settings_get_no_advice(tmp_path, tank):
    """If loops.csv is outdated, there are no settings and no forecast, and both pairs are given with their units."""
    out = clean(tune_result(tmp_path, tank, "0.45,120,0,100"), 0)
    assert "action: check settings" in out
    assert "stated Kp 0.45 %/%, Ti 120 s" in out
    assert "new settings:" not in out
    assert "forecast" not in out


def test_load_is_left_alone(tmp_path):
    """A loop that oscillates because of a load gets no settings."""
    swung = Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, load_std=0.3, sine=3.0, sine_s=300.0)
    out = clean(tune_result(tmp_path, simulate(swung, 2.0), "0.8,120,0,100"), 0)
    assert "action: find disturbance" in out
    assert "The load oscillates" in out
    assert "new settings:" not in out


def test_loop_without_fault_gets_no_settings(tmp_path):
    """A loop without fault and with hardly any load gets no settings."""
    no_fault = Sketch("none", (1.4, 90.0, 10.0), 0.8, 120.0, load_std=0.02, noise=0.02)
    out = clean(tune_result(tmp_path, simulate(no_fault, 1.0), "0.8,120,0,100"), 0)
    assert "action: none" in out
    assert "No fault found" in out


def flat(n: int, **trends: np.ndarray) -> Trends:
    """A loop at 50 %, PV with a little noise, with the given trends replaced."""
    rest = np.full(n, 50.0)
    noisy = 50 + 0.05 * np.random.default_rng(0).standard_normal(n)
    return Trends(**{"sp": rest, "pv": noisy, "op": rest, "stem": rest, **trends})


N = 3600
UNFIT = {
    "OP that never moves": (flat(N, pv=flat(N).pv + np.linspace(0, 9, N)), "manual 100 %"),
    "no samples of PV": (flat(N, pv=np.full(N, np.nan)), "none that is good"),
    "a record of a minute": (flat(60), "needs 200 good PV samples, has 60"),
}


@pytest.mark.parametrize("name", UNFIT)
def test_unfit_records_are_refused_in_one_line(tmp_path, name):
    """A record in manual, without PV, or too short is refused with what it lacks."""
    trends, wanted = UNFIT[name]
    assert wanted in refused(tune_result(tmp_path, trends))


def test_op_at_its_limit_is_an_action(tmp_path):
    """If OP is at its limit, the limit is to be checked; there is no model, and the reason is given."""
    out = clean(tune_result(tmp_path, flat(N, pv=flat(N).pv - 10, op=np.full(N, 100.0))), 0)
    assert "action: check limit" in out
    assert "needs OP within its limits" in out
    assert "new settings:" not in out


def test_compressed_trends_give_no_settings(tmp_path, tank):
    """Trends of straight segments give no settings, and trends without compression are required."""
    at = np.arange(tank.pv.size)
    kept = at[::100]
    thinned = replace(tank, pv=np.interp(at, kept, tank.pv[kept]), op=np.interp(at, kept, tank.op[kept]))
    out = clean(tune_result(tmp_path, thinned), 0)
    assert "without compression" in out
    assert "action: needs data" in out
    assert "new settings:" not in out


def test_dead_time_beyond_the_record_gives_no_settings(tmp_path):
    """If PV has not responded to OP by the end of the record, no settings are proposed."""
    rng = np.random.default_rng(2)
    op = 50 + np.cumsum(0.05 * rng.standard_normal(1200))
    pv = 50 + 0.05 * rng.standard_normal(1200)
    result = tune_result(tmp_path, Trends(np.full(1200, 50.0), pv, op, op))
    assert "new settings:" not in clean(result, result.exit_code)
    assert result.exit_code in (0, 2)


def test_unstated_settings_are_requested(tmp_path, tank):
    """Without kp and ti in loops.csv the line names both."""
    assert "no kp and ti in loops.csv" in refused(tune_result(tmp_path, tank, ",,0,100"))


def test_unknown_loop_names_the_nearest(tmp_path, tank):
    """A loop that does not exist is reported with the loops that do."""
    tune_result(tmp_path, tank)
    files = [str(tmp_path / "export.parquet"), "--loops", str(tmp_path / "loops.csv")]
    line = refused(CliRunner().invoke(main, ["tune", *files, "--loop", "LL"]))
    assert "loop LL is not among the 1 loops" in line
