"""The limits of an explanation: each one is used, and each table reaches its decisions."""

from __future__ import annotations

import ast
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.lanes.lanes import RULES
from identification.limits import LIMITS, ExplainLimits
from identification.mismatch.answer import answer
from identification.mismatch.diagnosis import explain
from identification.mismatch.recording import Recording
from tests.identification.plain_loop import Plant, recording

ROOT = Path(__file__).parents[2]


@cache
def read_names() -> set[str]:
    """Names of all attributes that the program reads."""
    files = [f for part in ("identification", "tuning", "analyzer") for f in (ROOT / part).rglob("*.py")]
    trees = (ast.parse(f.read_text(encoding="utf-8")) for f in files)
    return {node.attr for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Attribute)}


def test_every_limit_is_read():
    """Every declared limit is read. The weights of a source's signs are read by the names of the signs, and
    those of lanes by the names of their figures."""
    read = read_names() | {rule.limit or rule.figure for rule in RULES}
    declared = {f.name for s in fields(Config()) for f in fields(getattr(Config(), s.name))}
    assert {name for name in declared - read if not name.startswith("sign_")} == set()


def verdict_with(s: Recording, table: str, **changed: Any) -> str:
    """The verdict on a recording with a changed table of limits."""
    limits: ExplainLimits = replace(LIMITS, **{table: replace(getattr(LIMITS, table), **changed)})
    s = replace(s, limits=limits)
    return answer(explain(s), s).verdict


def test_the_recorder_uses_its_limits():
    """Steps of 0.5 % are reported as quantization, and not if the limit allows steps of 1 % from a historian."""
    s = recording(Plant(grid=0.5), 5)
    assert verdict_with(s, "recorder") == "quantization"
    assert verdict_with(s, "recorder", grid_step=1.0) != "quantization"


def test_the_check_of_the_controller_uses_its_limits():
    """Settings that are 25 % wrong are reported, and not if the limit allows twice the stated setting."""
    s = recording(Plant(), 6, kp_factor=1.25)
    assert verdict_with(s, "controller") == "controller-settings"
    assert verdict_with(s, "controller", setting=np.log(2.0)) != "controller-settings"


@pytest.mark.parametrize("table", [f.name for f in fields(ExplainLimits)])
def test_a_run_passes_its_tables_to_the_explanation(table):
    """The tables that a file may change are those of the explanation."""
    config = Config()
    changed = replace(config, **{f"explain_{table}": "another"})
    assert getattr(changed.explain, table) == "another"
    assert getattr(config.explain, table) == getattr(LIMITS, table)
