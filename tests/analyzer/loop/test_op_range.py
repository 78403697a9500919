"""An OP that cannot be in percent of its range is detected, and no figure is reported in percent of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.config import QualityLimits
from analyzer.lanes.lanes import in_lanes
from analyzer.loop.record.quality import op_in_range
from analyzer.night import chunk
from analyzer.night.nights import Night
from analyzer.store.rows import night_row
from proofs.plant import CONFIG, START_S, Sketch, Trends, series, simulate, spec

PIPE = Sketch("valve", (12.0, 150.0, 6.0), 0.65, 30.0, backlash=2.5, load_std=0.1)
NIGHT = Night("2026-03-02", START_S, START_S + 86400.0)
IN_PERCENT = (
    *("valve_travel_pct_per_h", "reversals_per_h", "at_limits_pct", "op_mean_pct", "gain", "slope_pct_per_s"),
    *("backlash_pct", "stickband_pct", "slip_jump_pct"),
)


def row_of(trends: Trends, op_hi: float | None) -> dict[str, object]:
    """The row of a night for a loop whose OP is exported from 0 to 1."""
    stated = {} if op_hi is None else {"op_lo": 0.0, "op_hi": op_hi}
    stamp = START_S + np.arange(trends.pv.size, dtype=float)
    trends = replace(trends, op=0.01 * trends.op)
    found = {f"L.{name.upper()}": series(stamp, getattr(trends, name)) for name in ("sp", "pv", "op")}
    kept = chunk.Rows()
    chunk._loop_row(spec("L", kp=0.65, ti=30.0, scan_s=1.0, **stated), found, NIGHT, CONFIG, True, kept)
    return night_row(in_lanes(kept.nights[0], CONFIG.lanes))


@pytest.fixture(scope="module")
def worn():
    """Six hours of a flow with backlash."""
    return simulate(PIPE, 6.0)


def test_an_op_from_0_to_1_gives_no_figure_in_percent(worn):
    """With OP from 0 to 1 and no stated range, a worn valve is reported for repair, without figures in percent of OP.

    The reason says what to state.
    """
    row = row_of(worn, None)
    assert (row["cause"], row["action"], row["lack"]) == ("valve", "repair valve", "OP's range")
    assert [row[name] for name in IN_PERCENT] == [None] * len(IN_PERCENT)
    assert "state op_lo and op_hi" in str(row["reason"])
    assert "stroke it in steps" not in str(row["reason"])


def test_a_stated_range_gives_the_same_answer_as_percent(worn):
    """With op_hi 1 stated, the width is right within 15 % and the loop gets settings, as in percent."""
    row = row_of(worn, 1.0)
    assert row["action"] == "retune"
    assert row["backlash_pct"] == pytest.approx(2.5, rel=0.15)
    assert row["lack"] is None


def test_a_loop_without_fault_needs_its_range_too():
    """A loop without fault whose OP is from 0 to 1 needs the stated range, and is not reported as free of faults."""
    row = row_of(simulate(replace(PIPE, backlash=0.0), 3.0), None)
    assert (row["cause"], row["action"], row["lack"]) == ("none", "needs data", "OP's range")


@pytest.mark.parametrize(
    ("low", "high", "resting", "fits"),
    [
        (0.3, 0.7, 0.0, False),
        (0.3, 1.0, 0.3, False),
        (0.0, 1.5, 0.4, True),
        (99.0, 100.0, 0.4, True),
        (20.0, 60.0, 0.0, True),
        (4.0, 200.0, 0.0, False),
        (-1.5, 1.0, 0.0, False),
        (1.0, 1.0, 1.0, True),
    ],
)
def test_which_op_fits_a_range_of_0_to_100(low, high, resting, fits):
    """A valve that is constant at its limit fits the range; one that moves freely only near the limit, or beyond it,
    does not.

    An OP from 0 to 1 that is at 1.0 for a third of the time is at its own limit. This is no limit of 0 to 100.
    """
    op = np.linspace(low, high, 1000)
    at = low if low == 0.0 else high
    op[: int(1000 * resting)] = at
    assert op_in_range(op, QualityLimits()) is fits


@pytest.mark.parametrize(
    ("other", "stated", "is_reported"), [(12.0, "", True), (60.0, "", False), (12.0, "4,20", False)]
)
def test_a_current_is_no_percent(tmp_path, other, stated, is_reported):
    """If the OPs of all loops lie between 4 and 20, they are reported as mA, and no figure is given in % of OP.

    This does not hold if one OP is in percent, or if the range is stated.
    """
    k = np.arange(2000)
    oscillation = np.sin(2 * np.pi * k / 50)
    table = pd.DataFrame({"time": pd.date_range("2026-03-02", periods=2000, freq="10s")})
    for loop, middle in (("A", 12.0), ("B", other)):
        table[[f"{loop}.SP", f"{loop}.PV", f"{loop}.OP"]] = np.column_stack(
            [0 * k, oscillation, middle - 3 * oscillation]
        )
    table.to_csv(tmp_path / "x.csv", index=False, float_format="%.3f")
    (tmp_path / "loops.csv").write_text(f"loop,op_lo,op_hi\nA,{stated or ','}\nB,{stated or ','}\n")
    arguments = ["check", str(tmp_path / "x.csv"), "--loops", str(tmp_path / "loops.csv")]
    output = CliRunner().invoke(main, arguments, catch_exceptions=False).output
    assert ("like mA" in output) == is_reported
    assert ("without them nothing is reported in % of OP" in output) == is_reported
