"""The limits of a method, which no file changes: each is read by something and stated whole."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

import analyzer.limits
import identification.limits
import tuning.limits
from analyzer.config import limit_of
from identification.limits import Limits
from tests.identification.test_limits import read_names

MODULES = analyzer.limits, identification.limits, tuning.limits
TABLES = list(
    {type(x): x for module in MODULES for x in vars(module).values() if isinstance(x, Limits)}.values()
)
"""All of them."""


@pytest.mark.parametrize("limits", TABLES, ids=lambda x: type(x).__name__)
def test_every_number_of_a_method_is_read_and_stated_whole(limits: Limits):
    """None is without unit, meaning and source, each lies in its range, and some line reads it."""
    assert {f.name for f in fields(limits)} <= read_names()
    for f in fields(limits):
        said = limit_of(f)
        assert all((said.unit, said.meaning, said.source)), f.name
        numbers = np.ravel(getattr(limits, f.name))
        assert said.least <= numbers.min() <= numbers.max() <= said.most, f.name
