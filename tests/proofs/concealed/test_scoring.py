"""Runner and scorer compare answers with the truth, only after the last answer."""

import sys

import pytest

from proofs.concealed import proof, run, score

STUB = """
import json, sys
import pandas as pd
a = sys.argv
assert "truth" not in " ".join(a)
if a[1] == "explain":
    open(a[a.index("--save-model") + 1], "w").write("{}")
    name = "backlash" if a[a.index("--loop") + 1] == "L0000" else "none"
    width = {"backlash_pct": {"value": 2.0, "low": 0.0, "high": 99.0, "unit": "%"}}
    effect = {"name": name, "block": "valve", "parameters": width, "alternatives": []}
    block = "valve" if name == "backlash" else "none"
    print(json.dumps({"verdict": name, "block": block, "effects": [effect] if name != "none" else []}))
else:
    rows = pd.read_parquet(a[3])
    tag = a[a.index("--loop") + 1]
    sim = pd.DataFrame({"timestamp": rows.timestamp, "PV": rows[tag + ".PV"]})
    sim.to_parquet(a[a.index("--out") + 1])
"""


def test_runner_and_scorer_score_a_known_program(sealed, tmp_path):
    """A stub program that knows one name scores this name, raises no false alarm, and recovers everything that
    it simulates."""
    stub = tmp_path / "stub.py"
    stub.write_text(STUB)
    answers = tmp_path / "answers"
    run.run(f"{sys.executable} {stub}", sealed, answers, 2)
    stamp = (answers / "L0000.json").stat().st_mtime_ns
    run.run(f"{sys.executable} {stub}", sealed, answers, 2)
    assert (answers / "L0000.json").stat().st_mtime_ns == stamp
    rows, params = score.judge(sealed, answers)
    rows = rows.set_index("loop")
    assert rows.strict["L0000"]
    assert rows.recovered["L0000"] > 1.0
    assert list(rows.verdict[["L0004", "L0005"]]) == ["none", "none"]
    assert rows.strict.sum() == 3
    assert params.inside.all()


def test_proof_is_replaced_not_repeated(sealed, tmp_path):
    """The section of the results is in the file once after several runs, and the rest of the file stays."""
    target = tmp_path / "PROOF.md"
    target.write_text("# Proof\n\nRigs.\n")
    for _ in range(2):
        score.report(sealed, tmp_path, target)
    text = target.read_text()
    assert text.count("## Sealed cases") == 1
    assert "Rigs." in text
    assert (tmp_path / "proof-concealed.png").stat().st_size > 5000


def test_intervals_are_exact():
    """No alarm in 133 cases gives a rate below 2.8 %, by the closed form 1 - 0.025^(1/n)."""
    assert proof.interval(0, 133)[1] == pytest.approx(1 - 0.025 ** (1 / 133))
    assert proof.interval(133, 133) == (pytest.approx(0.025 ** (1 / 133)), 1.0)
