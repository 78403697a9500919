"""An explanation tries the measured load that loops.csv states first."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import match


def loaded(n: int = 5400) -> pd.DataFrame:
    """A PI loop on a lag of 60 s, one sample a second; its measured load FT9 acts through a lag of 20 s."""
    rng = np.random.default_rng(4)
    rows, load, felt, x, total = np.empty((n, 4)), 0.0, 0.0, 50.0, 50.0
    for k in range(n):
        load = 0.995 * load + 0.3 * rng.normal()
        sp = 50.0 + 5.0 * ((k // 1200) % 2)
        pv = x + 0.05 * rng.normal()
        total += 0.8 * (sp - pv) / 60.0
        op = 0.8 * (sp - pv) + total
        felt += (load - felt) / 20.0
        x += (1.2 * (op - 50.0) + 2.0 * felt + 50.0 - x) / 60.0
        rows[k] = sp, pv, op, 700.0 + 40.0 * load
    table = pd.DataFrame(rows, columns=["TIC1.SP", "TIC1.PV", "TIC1.OP", "FT9"])
    table.insert(0, "timestamp", pd.date_range("2026-03-02", periods=n, freq="s"))
    return table


def test_a_measured_load_is_named_with_its_lag(tmp_path: Path) -> None:
    """If loops.csv states the load as upstream, the explanation names it and its lag; otherwise it does not."""
    loaded().to_csv(tmp_path / "x.csv", index=False, float_format="%.3f")
    answers = []
    for upstream in ("FT9", ""):
        (tmp_path / "loops.csv").write_text(
            f"loop,kp,ti,pv_lo,pv_hi,upstream\nTIC1,0.8,60,0,100,{upstream}\n"
        )
        arguments = [
            "explain",
            str(tmp_path / "x.csv"),
            "--loops",
            str(tmp_path / "loops.csv"),
            "--loop",
            "TIC1",
        ]
        answers.append(json.loads(CliRunner().invoke(main, [*arguments, "--format", "json"]).stdout))
    (effect,) = answers[0]["effects"]
    assert effect["name"] == "coupling"
    assert 15.0 < effect["parameters"]["coupling_lag_s"]["value"] < 25.0
    assert answers[1]["verdict"] != "coupling"


def test_an_unknown_upstream_is_reported() -> None:
    """An upstream loop is replaced by its PV tag; a name that is neither loop nor tag is reported."""
    stated = (LoopSpec("A", upstream="B"), LoopSpec("B", upstream="C"))
    (a, b), notes = match(stated, ["A.PV", "B.PV"])
    assert (a.load, b.load) == ("B.PV", None)
    assert "B: upstream C is neither a loop nor a tag of the export" in notes
