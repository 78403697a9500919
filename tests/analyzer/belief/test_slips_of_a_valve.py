"""If each night finds stiction slip by slip, the nights together find stiction."""

from __future__ import annotations

from pathlib import Path

import pytest

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.history.stamps import parse_time
from analyzer.loop.decisions import Fault
from analyzer.loops.tags import match, read_loops
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.store.store import Store

MILL = Path(__file__).parents[3] / "sample_data"


@pytest.mark.slow
def test_a_valve_whose_friction_scatters_has_stiction_by_all_nights(tmp_path: Path) -> None:
    """FIC2110 of the sample mill has a stickband of 6 % and a slip jump of 5 %: two nights find stiction alone and
    together.
    """
    export = open_export([MILL / "mill.parquet"])
    specs, _ = match(read_loops(MILL / "loops.csv"), export.tags)
    store = Store(tmp_path / "store")
    first, last = (parse_time(x, "--since", "UTC") for x in ("2026-03-02", "2026-03-04"))
    batch.run(Plant(export, [s for s in specs if s.loop == "FIC2110"], Config(), (first, last)), store)
    for name in store.nights():
        (alone,) = store.own_rows("nights", name, ["valve_fault"])
        (together,) = store.rows("nights", name, ["valve_fault"])
        assert alone["valve_fault"] == together["valve_fault"] == Fault.STICTION
    assert len(store.nights()) == 2
