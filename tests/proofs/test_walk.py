"""The comparison of all commands detects a contradiction, and finds none on the mill and on two plants."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from proofs.walk import MILL, of_row, parted, walked

SHARED = Path(__file__).parents[3] / "shared" / "plants"
PLANTS = {p: (str(SHARED / p / "export.parquet"), "--loops", str(SHARED / p / "loops.csv")) for p in "ab"}
ROW: dict[str, Any] = {
    **{"loop": "A", "cause": "valve", "valve_fault": "backlash", "backlash_pct": 2.0, "stickband_pct": None},
    **{
        "source_loop": None,
        "action": "retune",
        "kp_new": 1.5,
        "ti_new": 20.0,
        "reason": "valve backlash 2 %",
    },
}


def test_a_cell_that_differs_is_reported() -> None:
    """Both cells are reported if two answers differ in the fault and in Kp. Differences after the sixth digit
    are not reported."""
    other = ROW | {"valve_fault": "stiction", "kp_new": 1.6, "ti_new": 20.0000001}
    assert list(parted(ROW, other, "tune")) == [
        "tune: valve_fault stiction, rank backlash",
        "tune: kp_new 1.6, rank 1.5",
    ]
    assert not list(parted(ROW, dict(ROW), "tune"))


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({}, 0),
        ({"action": "undecided", "kp_new": None}, 1),
        ({"action": "repair valve"}, 1),
        ({"kp_new": None}, 1),
    ],
)
def test_a_row_that_contradicts_itself_is_reported(change: dict[str, Any], reported: int) -> None:
    """Reported are a known cause without a decision, settings without the action to retune, and this action
    without settings."""
    assert len(list(of_row(ROW | change))) == reported


@pytest.mark.skipif(
    os.environ.get("TRIAGE_WALK") != "all", reason="takes half an hour: TRIAGE_WALK=all runs it"
)
@pytest.mark.parametrize("options", [MILL, *PLANTS.values()], ids=["mill", *PLANTS])
def test_every_command_gives_one_answer(options: tuple[str, ...]) -> None:
    """`rank`, `tune` with and without the store, `explain` and its page report the same for each loop."""
    if not Path(options[0]).exists():
        pytest.skip("../shared is absent")
    assert walked(options, 2)[1] == []
