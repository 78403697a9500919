"""Beliefs depend on the nights of a store and not on the order of the runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from analyzer.belief.belief import step
from analyzer.belief.nights import inconsistent_beliefs, recompute_beliefs, update_beliefs
from analyzer.columns import NIGHTS, row_of
from analyzer.config import Config
from analyzer.pages.rank import ranked
from analyzer.store import notes
from analyzer.store.maintenance import pruned
from analyzer.store.notes import Note
from analyzer.store.store import Store
from analyzer.store.table import rows_table
from tests.analyzer.belief.nights_of_a_loop import CALM, WORN, row, witness

CONFIG = Config()


def keep(store: Store, night: dict[str, Any], *others: dict[str, Any]) -> None:
    """Store a night of the loop L and of other loops, and compute the beliefs after it."""
    rows = [row_of({k: v for k, v in r.items() if k != "extra"}, NIGHTS) for r in (night, *others)]
    store.write("nights", night["night"], rows_table(rows, NIGHTS))
    update_beliefs(store, night["night"], CONFIG)


def believed(store: Store) -> dict[str, list[dict[str, Any]]]:
    """All beliefs of a store."""
    return {n: store.own_rows("beliefs", n, store.columns("beliefs", n)) for n in store.nights()}


def ten_nights() -> list[dict[str, Any]]:
    """Ten nights of a loop with a small backlash that no single night proves, with a retune after the sixth night."""
    return [row(k, CALM, witness=witness(0.8, 6.0), ti=100.0 if k < 6 else 400.0) for k in range(10)]


def store_of(path: Path, rows: Sequence[dict[str, Any]]) -> Store:
    """A store whose nights were run one by one in the given order."""
    store = Store(path)
    for r in rows:
        keep(store, r)
    return store


def test_the_order_of_runs_does_not_matter(tmp_path: Path) -> None:
    """Nights in order, in reverse order, with one late night, and with two nights run twice give the same beliefs."""
    rows = ten_nights()
    first = believed(store_of(tmp_path / "a", rows))
    assert believed(store_of(tmp_path / "b", rows[::-1])) == first
    assert believed(store_of(tmp_path / "c", [*rows[:4], *rows[5:], rows[4]])) == first
    assert believed(store_of(tmp_path / "d", [*rows, rows[4], rows[9]])) == first


def test_one_command_computes_beliefs_again_and_check_names_the_differences(tmp_path: Path) -> None:
    """The check names beliefs that are missing or that differ from the nights, and one command computes them
    again.
    """
    store = store_of(tmp_path / "s", ten_nights())
    first = believed(store)
    assert inconsistent_beliefs(store, CONFIG) == []
    store.file("beliefs", "2026-03-05").unlink()
    other = store.read("beliefs", "2026-03-08").slice(0, 0)
    store.write("beliefs", "2026-03-08", other)
    assert [p.seen.rsplit("/", 1)[1] for p in inconsistent_beliefs(store, CONFIG)] == [
        "2026-03-05.parquet: inconsistent with the nights",
        "2026-03-08.parquet: inconsistent with the nights",
    ]
    recompute_beliefs(store, CONFIG)
    assert believed(store) == first


def test_check_computes_one_night_of_beliefs_that_carry_their_inputs(tmp_path, monkeypatch) -> None:
    """Of ten nights only the newest is computed again, also after the oldest nights are deleted and after a note on a
    later repair. Another limit causes all nights to be computed.
    """
    store, counted = store_of(tmp_path / "s", ten_nights()), []

    def counting(before: Any, row: Any, *more: Any) -> Any:
        counted.append(row["night"])
        return step(before, row, *more)

    monkeypatch.setattr("analyzer.belief.nights.step", counting)
    assert inconsistent_beliefs(store, CONFIG) == []
    assert counted == ["2026-03-11"]
    assert pruned(store, 4, None)
    notes.add(store.path, Note("L", ten_nights()[9]["start_s"] + 20 * 86400.0, "valve replaced"))
    assert inconsistent_beliefs(store, CONFIG) == []
    assert counted == 2 * ["2026-03-11"]
    other = replace(CONFIG, belief=replace(CONFIG.belief, half_life=5.0))
    assert inconsistent_beliefs(store, other)
    assert len(counted) > 3


@pytest.mark.parametrize("k", [0, 4, 9])
def test_check_sees_a_night_that_was_written_again(k: int, tmp_path: Path) -> None:
    """The check finds any night whose table has changed since its beliefs were computed."""
    rows = ten_nights()
    store = store_of(tmp_path / "s", rows)
    again = row_of({**row(k, WORN, backlash_pct=2.0), "night": rows[k]["night"]}, NIGHTS)
    store.write("nights", rows[k]["night"], rows_table([again], NIGHTS))
    named = [p.seen for p in inconsistent_beliefs(store, CONFIG)]
    assert any(rows[k]["night"] in seen for seen in named)


def test_a_store_of_an_earlier_version_is_used(tmp_path: Path) -> None:
    """Nights without stored beliefs and without stored evidence are enough for the next run to find the valve
    fault.
    """
    store = Store(tmp_path / "s")
    for k in range(4):
        old = row(k, WORN, backlash_pct=2.0, evidence=40.0)
        store.write("nights", old["night"], rows_table([row_of(old, NIGHTS)], NIGHTS))
    keep(store, row(4, CALM, witness=witness(2.0, 0.0, 0.0)))
    (reported,) = store.rows("nights", "2026-03-06", ("cause", "action", "due", "worn_pct", "certain_since"))
    assert (reported["cause"], reported["action"], reported["due"]) == (
        "valve",
        "repair valve",
        "next shutdown",
    )
    assert reported["certain_since"] == "2026-03-02"


def test_the_verdict_uses_all_nights_and_the_figures_use_one_night(tmp_path: Path) -> None:
    """The list shows the fault that all nights found together; the stored row of a night still contains that night's
    own result.
    """
    store = store_of(tmp_path / "s", ten_nights())
    (listed,), _ = ranked(store)
    assert (listed["cause"], listed["valve_fault"], listed["backlash_pct"]) == (
        "valve",
        "backlash",
        pytest.approx(0.8, rel=0.05),
    )
    assert "10 nights: valve backlash 0.8 % of OP" in listed["reason"]
    (own,) = store.own_rows("nights", "2026-03-11", ("cause", "valve_fault", "oscillating_pct"))
    assert (own["cause"], own["valve_fault"], own["oscillating_pct"]) == (
        "none",
        "none",
        listed["oscillating_pct"],
    )


def test_a_loop_keeps_its_belief_over_nights_without_assessment(tmp_path: Path) -> None:
    """Nights in manual, and nights that contain only other loops, neither add evidence nor end a belief."""
    rows, other = ten_nights(), {**row(0, CALM), "loop": "M"}
    store = Store(tmp_path / "s")
    for k, r in enumerate(rows):
        if k == 7:
            keep(
                store,
                {**r, "status": "not assessed", "cause": None, "witness": None, "oscillating_pct": None},
            )
        elif k == 8:
            keep(store, {**other, "night": r["night"]})
        else:
            keep(store, r)
    (reported,) = store.rows("nights", "2026-03-11", ("cause", "worn_nights"), ["L"])
    assert (reported["cause"], reported["worn_nights"]) == ("valve", 8.0)
    (by_hand,) = store.rows("nights", "2026-03-09", ("cause", "status"), ["L"])
    assert by_hand == {"cause": None, "status": "not assessed"}


def test_a_late_note_on_a_repair_counts_when_beliefs_are_computed_again(tmp_path: Path) -> None:
    """A note on a repair ends the belief in the night of the repair, whose samples belong to two valves, and in no
    other night.
    """
    rows = ten_nights()
    store = store_of(tmp_path / "s", rows)
    notes.add(store.path, Note("L", rows[5]["start_s"] - 600.0, "valve replaced"))
    recompute_beliefs(store, CONFIG)
    found = {n: store.rows("nights", n, ("worn_nights",))[0]["worn_nights"] for n in store.nights()}
    assert [found[f"2026-03-0{day}"] for day in (5, 6, 7, 8)] == [4.0, 0.0, 1.0, 2.0]


def test_beliefs_still_include_deleted_nights(tmp_path: Path) -> None:
    """The beliefs after deletion of old nights still include those nights, and the check reports no problem."""
    store = store_of(tmp_path / "s", ten_nights())
    last = believed(store)["2026-03-11"]
    assert pruned(store, 4, None)
    assert len(store.nights()) == 5
    assert inconsistent_beliefs(store, CONFIG) == []
    recompute_beliefs(store, CONFIG)
    assert believed(store)["2026-03-11"] == last


def test_a_belief_that_fails_concerns_its_loop_only(tmp_path: Path) -> None:
    """If the evidence of one loop is invalid, that loop is named, the other loops get their beliefs, and the night is
    kept.
    """
    store = Store(tmp_path / "s")
    broken = {**row(0, CALM, witness=json.dumps({"profile": "x"})), "loop": "B"}
    rows = [row_of(r, NIGHTS) for r in (row(0, CALM, witness=witness(0.8, 6.0)), broken)]
    store.write("nights", "2026-03-02", rows_table(rows, NIGHTS))
    lost = update_beliefs(store, "2026-03-02", CONFIG)
    assert len(lost) == 1
    assert lost[0].startswith("B: no belief of night 2026-03-02")
    assert [r["loop"] for r in believed(store)["2026-03-02"]] == ["L"]


def test_damaged_beliefs_of_the_night_before_are_computed_again(tmp_path: Path) -> None:
    """An unreadable table of beliefs does not stop a night: all beliefs are computed again from the nights."""
    rows = ten_nights()
    store = store_of(tmp_path / "s", rows[:9])
    store.file("beliefs", rows[8]["night"]).write_bytes(b"PAR1 no table PAR1")
    keep(store, rows[9])
    assert believed(store) == believed(store_of(tmp_path / "t", rows))


def test_beliefs_of_a_night_cost_little(tmp_path: Path) -> None:
    """A night reads its own table and the beliefs of the night before, and no older night, for any number of
    nights.
    """
    rows = ten_nights()
    store = store_of(tmp_path / "s", rows[:9])
    reads: list[tuple[str, str]] = []
    own = Store.own_rows

    def counted(self: Store, table: str, night: str, *more: Any) -> list[dict[str, Any]]:
        reads.append((table, night))
        return own(self, table, night, *more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "own_rows", counted)
        keep(store, rows[9])
    assert reads == [("beliefs", "2026-03-10"), ("nights", "2026-03-11")]
