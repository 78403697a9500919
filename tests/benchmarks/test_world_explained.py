"""Loops of benchmarks/world in rows slower than their scan: `explain` reports no effect that is absent."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from analyzer import api
from benchmarks.world.__main__ import export
from benchmarks.world.draw import Drawn, drawn, run
from benchmarks.world.recorder import recorded
from identification.mismatch.explanation import Explanation

WAY = "every 10 s"


def explained(d: Drawn, folder: Path) -> tuple[Explanation, dict]:
    """The explanation of one day of a loop in rows of 10 s, and its data."""
    settings = {"kp": d.controller.kp, "ti": d.controller.ti_s, "scan_s": d.controller.scan_s}
    pd.DataFrame([{"loop": d.name, "pv_lo": 0, "pv_hi": 100, **settings}]).to_csv(
        folder / "loops.csv", index=False
    )
    (file,) = export(folder, {d.name: recorded(run(d), WAY, d.seed)})
    found = api.explain(api.read(file, loops=folder / "loops.csv").loop(d.name))
    return found.found, found.data


def test_a_fault_free_loop_in_slow_rows_is_explained_by_the_baseline_model(tmp_path: Path) -> None:
    """A fault-free loop in slow rows has no effect and no wrong settings, although OP between two rows also
    predicts PV."""
    data = explained(drawn(601, 6, ("healthy",))[5], tmp_path)[1]
    assert (data["verdict"], data["effects"]) == ("none", [])


def test_a_quiet_loop_in_slow_rows_is_not_identified(tmp_path: Path) -> None:
    """A fault-free loop whose OP hardly moves has no effect, and the reason states what is missing."""
    data = explained(drawn(601, 6, ("healthy",))[1], tmp_path)[1]
    assert data["effects"] == []
    assert "Not identified: needs moves" in data["reason"]


def test_a_worn_valve_in_slow_rows_has_no_second_effect(tmp_path: Path) -> None:
    """Backlash in slow rows is the only effect; the model's error between the rows is not reported as a second
    one."""
    d = drawn(601, 6, ("backlash",))[3]
    found, data = explained(d, tmp_path)
    assert [effect["name"] for effect in data["effects"]] == ["backlash"]
    assert data["effects"][0]["parameters"]["backlash_pct"]["value"] == pytest.approx(d.valve.band, rel=0.1)
    assert found.proven.holds_in_band
