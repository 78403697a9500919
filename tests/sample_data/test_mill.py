"""The sample mill agrees with its README, measured with plain numpy on the files in the repository."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data"
sys.path.insert(0, str(SAMPLE))

import make  # noqa: E402
import physics  # noqa: E402
from historian import compressed, reported  # noqa: E402
from mill import MILL, RETUNED_S, Loop, Unit, simulate  # noqa: E402
from physics import run, slip  # noqa: E402

WEEK = 7 * 8640  # samples at 10 s
BEFORE = slice(RETUNED_S // 10 - WEEK, RETUNED_S // 10)
AFTER = slice(
    RETUNED_S // 10 + 900, None
)  # from 2.5 h after the first retune; all seven retunes are complete
CLEAR = ("LIC2102", "TIC2104", "LIC2105", "TIC2106", "LIC2107")
LOOPS = {loop.tag: loop for loop in MILL}


@pytest.fixture(scope="module")
def mill() -> pd.DataFrame:
    return pd.read_parquet(SAMPLE / "mill.parquet")


def percent(mill: pd.DataFrame, tag: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """SP, PV [% of span] and OP [%] of one loop."""
    unit = LOOPS[tag].unit
    sp, pv = ((mill[f"{tag}.{x}"].to_numpy() - unit.lo) / (unit.hi - unit.lo) * 100.0 for x in ("SP", "PV"))
    return sp, pv, mill[f"{tag}.OP"].to_numpy()


def regular_peak(error: np.ndarray) -> float:
    """Height of the first autocorrelation peak after the first negative lag, as the median over spans of 4 h."""
    peaks = []
    for span in error[: error.size // 1440 * 1440].reshape(-1, 1440):
        spectrum = np.abs(np.fft.rfft(span - span.mean(), 2880)) ** 2
        shape = np.fft.irfft(spectrum)[:360]
        negative = np.flatnonzero(shape < 0.0)
        peaks.append(np.max(shape[negative[0] :]) / shape[0] if negative.size else 0.0)
    return float(np.median(peaks))


def assess(mill: pd.DataFrame, tag: str, span: slice) -> np.ndarray:
    """Average absolute error [%], OP travel [%/h], 2 sigma of e [%] and the peak of the autocorrelation."""
    sp, pv, op = (x[span] for x in percent(mill, tag))
    e = sp - pv
    return np.array([np.mean(abs(e)), np.mean(abs(np.diff(op))) * 360.0, 2.0 * np.std(e), regular_peak(e)])


def before_after(mill: pd.DataFrame, tag: str) -> np.ndarray:
    """The four assessments after the retune, divided by those before."""
    return assess(mill, tag, AFTER) / assess(mill, tag, BEFORE)


def dominant_period(mill: pd.DataFrame, tag: str, span: slice) -> float:
    """Period [s] of the strongest spectral line of e between 1 min and 1 h."""
    sp, pv, _ = (x[span] for x in percent(mill, tag))
    e = (sp - pv)[: sp.size // 4320 * 4320].reshape(-1, 4320)
    power = np.mean(np.abs(np.fft.rfft((e - e.mean(axis=1, keepdims=True)) * np.hanning(4320))) ** 2, axis=0)
    power[: 43200 // 3600] = 0.0
    return 43200.0 / int(np.argmax(power))


def test_files_are_there_and_small() -> None:
    """The six files exist; the Parquet file is smaller than 6 MB and the CSV file smaller than 1.5 MB."""
    for name in ("mill.parquet", "loops.csv", "changes.csv", "mill-day.csv", "truth.json", "README.md"):
        assert (SAMPLE / name).stat().st_size > 100
    assert (SAMPLE / "mill.parquet").stat().st_size < 6e6
    assert (SAMPLE / "mill-day.csv").stat().st_size < 1.5e6


def test_parquet_is_two_weeks_at_ten_seconds(mill: pd.DataFrame) -> None:
    """The export is wide, in UTC, and complete at 10 s over two weeks; each loop has three tags."""
    stamps = mill["timestamp"]
    assert str(stamps.dt.tz) == "UTC"
    assert stamps.iloc[0] == pd.Timestamp("2026-03-02", tz="UTC")
    assert len(mill) == 14 * 8640
    assert stamps.diff().iloc[1:].eq(pd.Timedelta(seconds=10)).all()
    for tag in LOOPS:
        assert {f"{tag}.SP", f"{tag}.PV", f"{tag}.OP"} <= set(mill.columns)


def test_values_are_clean_decimals(mill: pd.DataFrame) -> None:
    """Every value is the double nearest to a decimal number of at most three places."""
    values = mill.drop(columns="timestamp").select_dtypes("number").to_numpy().ravel()
    values = values[np.isfinite(values)]
    assert np.array_equal(values, np.round(values, 3))


def test_same_seed_same_mill() -> None:
    """Two runs of the generator agree in every bit."""
    first, second = (simulate(days=0.2, tags=("LIC2103", "FIC2117")) for _ in range(2))
    for tag, trend in first.items():
        for name in ("sp", "pv", "op", "stem", "manual"):
            assert np.array_equal(getattr(trend, name), getattr(second[tag], name))


def test_committed_file_is_what_the_generator_makes(mill: pd.DataFrame) -> None:
    """A new run of the generator reproduces the first three hours of the file."""
    tags = tuple(tag for tag, loop in LOOPS.items() if not loop.only_last_h and not loop.compressed)
    made = make.export(simulate(days=0.125, tags=tags))
    numbers = made.drop(columns="timestamp").select_dtypes("number")
    same = np.isclose(numbers.to_numpy(), mill[numbers.columns].head(len(made)).to_numpy(), rtol=0, atol=1e-9)
    assert same.mean() > 0.99


def test_tables_are_what_the_generator_states() -> None:
    """loops.csv and changes.csv agree with the generator's list of loops."""
    for name, table in (("loops.csv", make.loops_table()), ("changes.csv", make.changes_table())):
        pd.testing.assert_frame_equal(
            pd.read_csv(SAMPLE / name, keep_default_na=False), table, check_dtype=False
        )


def test_changes_start_from_the_settings_in_loops_csv() -> None:
    """The old settings of the seven retunes are those of loops.csv; five loops are level loops, two are
    temperature loops."""
    changes = pd.read_csv(SAMPLE / "changes.csv").merge(pd.read_csv(SAMPLE / "loops.csv"), on="loop")
    assert changes["type"].value_counts().to_dict() == {"level": 5, "temperature": 2}
    assert np.allclose(changes["kp_old"], changes["kp"])
    assert np.allclose(changes["ti_old"], changes["ti"])


@pytest.mark.parametrize(
    ("gain", "ti", "stated"), [("band", "min", (40.0, 1.0)), ("engineering", "repeats/min", (1.25, 1.0))]
)
def test_settings_are_stated_in_the_controllers_units(
    gain: str, ti: str, stated: tuple[float, float]
) -> None:
    """A gain of 2.5 and an integral time of 60 s are a proportional band of 40 % and 1 min. Over a range of 200
    they are 1.25 and 1 repeat per minute."""
    unit = Unit("t/h", 0.0, 200.0, 1.0, gain, ti)
    loop = Loop("X", "", "flow", "", "none", (1.0, 1.0, 1.0), (2.5, 60.0), unit=unit)
    assert make.stated(loop, loop.tuning) == stated


@pytest.mark.parametrize("tag", CLEAR)
def test_five_loops_improve_in_all_four_assessments(mill: pd.DataFrame, tag: str) -> None:
    """Error and variability fall by at least 25 %, travel by at least 40 %, and the regular oscillation
    disappears."""
    error, travel, variability, _ = before_after(mill, tag)
    assert error <= 0.75
    assert travel <= 0.60
    assert variability <= 0.75
    assert assess(mill, tag, BEFORE)[3] > 0.8
    assert assess(mill, tag, AFTER)[3] < 0.45


def test_loop_one_improves_a_little(mill: pd.DataFrame) -> None:
    """Error, travel and variability of LIC2101 fall by 3 to 20 %."""
    ratios = before_after(mill, "LIC2101")[:3]
    assert np.all((ratios > 0.80) & (ratios < 0.97)), ratios


def test_loop_three_saves_travel_only(mill: pd.DataFrame) -> None:
    """Travel of LIC2103 falls by a quarter. Error and oscillation stay the same, at the period of the loop that
    feeds LIC2103."""
    error, travel, variability, peak = before_after(mill, "LIC2103")
    assert travel <= 0.75
    assert 0.85 < error < 1.15
    assert 0.85 < variability < 1.15
    assert 0.85 < peak < 1.15
    for span in (BEFORE, AFTER):
        source = dominant_period(mill, "FIC2110", span)
        assert dominant_period(mill, "LIC2103", span) == pytest.approx(source, rel=0.05)


def test_loops_without_a_retune_do_not_change(mill: pd.DataFrame) -> None:
    """Error and travel of the loops without a retune differ by less than 15 % between the two weeks."""
    for tag in ("FIC2110", "TIC2111", "PIC2112", "FIC2113", "PIC2114", "TIC2115", "PIC2116", "PIC2119"):
        assert np.all(np.abs(before_after(mill, tag)[:2] - 1.0) < 0.15), tag


@pytest.mark.parametrize("tag", [*CLEAR, "LIC2101"])
def test_oscillations_are_larger_than_the_noise(mill: pd.DataFrame, tag: str) -> None:
    """Before the retune the amplitude of the oscillation is at least three times the standard deviation of the
    noise."""
    sp, pv, _ = (x[BEFORE] for x in percent(mill, tag))
    assert np.sqrt(2.0) * np.std(sp - pv) > 3.0 * LOOPS[tag].noise


@pytest.mark.parametrize("tag", [tag for tag in LOOPS if LOOPS[tag].cause in make.CYCLING])
def test_oscillations_have_the_true_period(mill: pd.DataFrame, tag: str) -> None:
    """Every oscillating loop has the period that truth.json states, of at least 12 samples."""
    period = json.loads((SAMPLE / "truth.json").read_text())[tag]["period_s"]
    assert period >= 120.0
    assert dominant_period(mill, tag, BEFORE) == pytest.approx(period, rel=0.1)


def test_unfit_loops_are_unfit(mill: pd.DataFrame) -> None:
    """One loop is mostly in manual, one is at its limit, one is too short, and one is compressed to straight
    segments."""
    assert mill["FIC2117.MODE"].eq("MAN").mean() > 0.85
    assert np.mean(mill["TIC2118.OP"] >= 100.0) > 0.7
    assert mill["FIC2120.PV"].notna().sum() == 900
    straight = np.abs(np.diff(mill["PIC2119.PV"], 2)) < 0.1
    assert straight.mean() > 0.9


def test_day_export_has_its_defects_and_the_mills_values(mill: pd.DataFrame) -> None:
    """The CSV file of one day has the intended defects; without them its values are those of the Parquet file."""
    raw = (SAMPLE / "mill-day.csv").read_bytes()
    assert raw.startswith(b"\xef\xbb\xbf")
    day = pd.read_csv(SAMPLE / "mill-day.csv", sep=";", dtype=str, encoding="utf-8-sig")
    stamps = pd.to_datetime(day["Timestamp"], format="%d.%m.%Y %H:%M:%S", utc=True)
    assert stamps.is_monotonic_decreasing
    assert stamps.duplicated().any()
    assert -stamps.diff().min() > pd.Timedelta(minutes=20)
    assert {"Bad Input", "I/O Timeout"} <= set(day["TIC2104.PV"]) | set(day.to_numpy().ravel())
    found = pd.to_numeric(day["LIC2102.PV"].str.replace(",", "."), errors="coerce").to_numpy()
    stored = mill.set_index("timestamp").loc[stamps, "LIC2102.PV"].to_numpy()
    assert 0 < np.isnan(found).sum() < 0.05 * found.size
    assert np.array_equal(found[~np.isnan(found)], stored[~np.isnan(found)])


def test_readme_names_every_loop_and_its_period() -> None:
    """The README's table has each loop with the period in truth.json."""
    rows = [row for row in (SAMPLE / "README.md").read_text().splitlines() if row.startswith("| `")]
    truth = json.loads((SAMPLE / "truth.json").read_text())
    for tag, fact in truth.items():
        (row,) = [row for row in rows if row.startswith(f"| `{tag}`")]
        assert row.split("|")[-2].strip() == (f"{fact['period_s']:.0f}" if fact["period_s"] else "–")


def test_step_response_is_the_closed_form() -> None:
    """In manual, a step of OP gives K (1 - exp(-(t - L)/T)), also with a dead time that is not a multiple of
    the step."""
    n, gain, lag, delay, at = 400, 2.0, 50.0, 7.33, 100
    zero, push = np.zeros(n), np.zeros(n)
    push[at] = 1.0
    valve, process = (0.0, 0.0, 0.0), (gain, lag, delay)
    sp, one = np.full(n, 50.0), np.ones(n)
    pv, _, _ = run(sp, zero, zero, one, one, push, np.ones(n, dtype=bool), 50.0, valve, process)
    late = (
        np.arange(n) - at - delay - 0.6
    )  # the actuator's lag delays a slow process by the actuator's time constant
    assert np.max(np.abs(pv - 50.0 - np.where(late > 0, gain * (1.0 - np.exp(-late / lag)), 0.0))) < 0.02


def test_limit_cycle_is_the_published_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """K 80, T 200, L 1, backlash 1 %, Kp 1, Ti 10 oscillate with a period of 38 s and a PV amplitude of 0.60 %.

    Source: Figure 1 of "Tuning of Control Loops with Valve Problems". Its valve has no actuator lag.
    """
    monkeypatch.setattr(physics, "ACTUATOR_S", 1e-3)
    n = 3000
    zero, one, sp = np.zeros(n), np.ones(n), np.full(n, 50.0)
    sp[10:] = 51.0
    auto = np.zeros(n, dtype=bool)
    pv, _, _ = run.py_func(
        sp, zero, zero, one, 10.0 * one, zero, auto, 50.0, (1.0, 0.0, 0.0), (80.0, 200.0, 1.0)
    )
    e = (pv - sp)[-1000:]
    ups = np.flatnonzero((e[:-1] < 0.0) & (e[1:] >= 0.0))
    assert np.diff(ups).mean() == pytest.approx(38.0, abs=0.5)
    assert np.ptp(e) / 2.0 == pytest.approx(0.60, abs=0.02)


def test_stem_waits_for_the_stickband_and_jumps() -> None:
    """After a reversal during slip, a stem with S = 6 and J = 5 rests over 6 % of OP and then jumps by 5 %."""
    force = np.concatenate([np.linspace(0.0, 5.6, 5601), np.linspace(5.6, -1.0, 6601)])
    stem, x, way = np.empty(force.size), 0.0, 0.0
    for k, goal in enumerate(force):
        x, way = slip.py_func(x, way, goal, 5.5, 0.5, 0.5)
        stem[k] = x
    turn = 5600
    leaves = int(np.argmax(stem[turn:] < stem[turn] - 0.1)) + turn
    assert force[turn] - force[leaves] == pytest.approx(6.0, abs=0.15)
    assert stem[turn] - stem[leaves + 40] == pytest.approx(5.0, abs=0.15)


def test_historian_reports_by_exception_within_its_bound() -> None:
    """Reported values differ from the trend by at most 1.5 steps, compressed values by at most their bound."""
    x = np.cumsum(np.random.default_rng(1).standard_normal(2000)) * 0.1
    assert np.max(np.abs(reported(x, 0.05) - x)) <= 0.075 + 1e-9
    assert np.max(np.abs(compressed(x, 0.4, 0.001) - x)) <= 0.4 + 0.001


def test_set_points_of_a_cascade_and_a_ratio_follow_their_source(mill: pd.DataFrame) -> None:
    """The set point of a slave loop is its master's output over the slave's range. The set point of a ratio
    loop is a multiple of its leader's PV."""
    for tag, loop in LOOPS.items():
        sp, _, _ = percent(mill, tag)
        if loop.master:
            assert np.abs(sp - mill[f"{loop.master}.OP"].to_numpy()).max() < 0.2
        if loop.ratio_of:
            _, leader, _ = percent(mill, loop.ratio_of)
            assert np.abs(sp - loop.ratio * leader).max() < 0.3


def test_a_batch_rises_and_comes_back(mill: pd.DataFrame) -> None:
    """Three to five times a day the batch's set point ramps up by its height, stays there and steps back."""
    (loop,) = (x for x in MILL if x.batch)
    sp, pv, _ = percent(mill, loop.tag)
    steps = np.flatnonzero(np.diff(sp) < -0.9 * loop.batch)
    assert 14 * 3 <= steps.size <= 14 * 5
    assert np.ptp(sp) == pytest.approx(loop.batch, abs=0.1)
    assert np.corrcoef(sp, pv)[0, 1] > 0.9
