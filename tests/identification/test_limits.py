"""The limits of an explanation: each is read by something, and each table reaches what it decides about."""

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
    """Names of all attributes that the program reads anywhere."""
    files = [f for part in ("identification", "tuning", "analyzer") for f in (ROOT / part).rglob("*.py")]
    trees = (ast.parse(f.read_text(encoding="utf-8")) for f in files)
    return {node.attr for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Attribute)}


def test_every_limit_is_read():
    """A limit that no line reads decides nothing; the weights of a source's signs are read by the signs' names, and
    those of lanes by their figures' names."""
    read = read_names() | {rule.limit or rule.figure for rule in RULES}
    declared = {f.name for s in fields(Config()) for f in fields(getattr(Config(), s.name))}
    assert {name for name in declared - read if not name.startswith("sign_")} == set()


def under(s: Recording, table: str, **changed: Any) -> str:
    """The verdict on a recording with a table of limits changed."""
    limits: ExplainLimits = replace(LIMITS, **{table: replace(getattr(LIMITS, table), **changed)})
    s = replace(s, limits=limits)
    return answer(explain(s), s).verdict


def test_the_recorder_takes_its_limits():
    """A sensor's steps of half a percent are named; not where steps of one percent are a historian's."""
    s = recording(Plant(grid=0.5), 5)
    assert under(s, "recorder") == "quantization"
    assert under(s, "recorder", grid_step=1.0) != "quantization"


def test_the_controllers_check_takes_its_limits():
    """Settings a fifth off are named; not where twice the stated setting is still believed."""
    s = recording(Plant(), 6, kp_factor=1.25)
    assert under(s, "controller") == "controller-settings"
    assert under(s, "controller", setting=np.log(2.0)) != "controller-settings"


@pytest.mark.parametrize("table", [f.name for f in fields(ExplainLimits)])
def test_a_run_hands_its_tables_down(table):
    """The tables that a file may change are those that an explanation is given."""
    config = Config()
    changed = replace(config, **{f"explain_{table}": "another"})
    assert getattr(changed.explain, table) == "another"
    assert getattr(config.explain, table) == getattr(LIMITS, table)
