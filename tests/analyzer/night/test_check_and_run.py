"""The questions that a record is fit for according to `check` are those that `run` answers."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from proofs.plant import Sketch, simulate, write_export

FLOW = Sketch("none", (1.1, 12.0, 4.0), 0.3, 20.0, kind="flow")


@pytest.mark.parametrize(
    ("columns", "every", "lack", "text"),
    [
        ("L,0.3,20,0,100", 1, None, "fit for all questions"),
        ("L,0.3,20,0,10000", 1, "OP's range", "fit for all but new settings: recorded OP lies between"),
    ],
)
def test_check_and_run_agree(tmp_path, columns, every, lack, text):
    """A record that lacks something for `run` is not fit for all questions in `check`, with the same words."""
    trends = simulate(FLOW, 8.0)
    thin = type(trends)(*(getattr(trends, n)[::every] for n in ("sp", "pv", "op", "stem")))
    export = write_export(tmp_path / "x.parquet", {"L": thin}, dt_s=every)
    loops, store = tmp_path / "loops.csv", str(tmp_path / "store")
    loops.write_text(f"loop,kp,ti,op_lo,op_hi\n{columns}\n")
    arguments = [str(export), "--loops", str(loops)]
    checked = CliRunner().invoke(main, ["check", *arguments], catch_exceptions=False).output
    assert text in checked
    done = CliRunner().invoke(
        main, ["run", *arguments, "--store", store, "--jobs", "1"], catch_exceptions=False
    )
    assert done.exit_code == 0, done.output
    (row,) = json.loads(CliRunner().invoke(main, ["rank", store, "--format", "json"]).output)
    needs = text.split(": ")[-1]
    assert (needs in row["reason"]) == (lack is not None)
    assert (row["action"] == "needs data") == (lack is not None)
