"""Nights are the days of the plant, also across both clock changes; times without a zone are those of the plant."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from analyzer.api import read
from analyzer.cli import main
from analyzer.config import Config
from analyzer.history import plant_clock
from analyzer.history.stamps import parse_time
from analyzer.night.nights import in_nights
from analyzer.store.store import Store
from identification.errors import InputError

HELSINKI = "Europe/Helsinki"


def at(text: str) -> float:
    """A UTC time [s]."""
    return datetime.fromisoformat(text).replace(tzinfo=UTC).timestamp()


@pytest.mark.parametrize(("first", "hours"), [("2026-03-28T22:00", [23, 24]), ("2026-10-24T21:00", [25, 24])])
def test_a_local_day_is_one_night_through_both_clock_changes(first: str, hours: list[int]) -> None:
    """The Sundays of the clock changes in Helsinki are one night each, of 23 and 25 hours, named by their date."""
    start = at(first)
    found = in_nights([(start, start + 3600.0 * sum(hours) - 1.0)], Config().nights, HELSINKI)
    assert [round((n.last_s - n.first_s) / 3600) for n in found] == hours
    local = [plant_clock.local(n.first_s, HELSINKI) for n in found]
    assert [(t.hour, t.minute) for t in local] == [(0, 0)] * 2
    assert [n.name for n in found] == [t.strftime("%Y-%m-%d") for t in local]


def test_utc_is_the_default() -> None:
    """Without a zone the nights are those of UTC."""
    start = at("2026-03-28T00:00")
    found = in_nights([(start, start + 2 * 86400.0 - 1)], Config().nights)
    assert [n.first_s for n in found] == [start, start + 86400.0]


@pytest.mark.parametrize(
    ("text", "utc"),
    [("2026-07-01 08:00", "2026-07-01T05:00"), ("2026-01-01 08:00", "2026-01-01T06:00")],
)
def test_times_without_a_zone_are_those_of_the_plant(text: str, utc: str) -> None:
    """08:00 in changes.csv is 05:00 UTC in summer and 06:00 in winter; a time with a zone keeps its zone."""
    assert parse_time(text, "here", HELSINKI) == at(utc)
    assert parse_time(text + "Z", "here", HELSINKI) == at(text.replace(" ", "T"))


def test_an_unknown_zone_is_one_line() -> None:
    """A zone that does not exist is reported with an example."""
    with pytest.raises(InputError, match="Europe/Berlin"):
        plant_clock.zone_of("Europe/Nowhere")


def test_a_notebook_has_the_plants_nights_and_times(tmp_path: Path) -> None:
    """`read(timezone=...)` divides at the same midnights as `run --timezone`, and reads changes in that zone."""
    start = at("2026-07-01T00:00")
    stamp = (start + 60.0 * np.arange(2880)) * 1e6
    table = {"timestamp": pa.array(stamp.astype("int64"), pa.timestamp("us", tz="UTC"))}
    table |= {f"FIC1.{r}": pa.array(np.full(2880, 50.0)) for r in ("SP", "PV", "OP")}
    pq.write_table(pa.table(table), tmp_path / "export.parquet")
    (tmp_path / "changes.csv").write_text("loop,time,kp_new\nFIC1,2026-07-02 08:00,2.0\n", encoding="utf-8")
    plant = read(tmp_path / "export.parquet", changes=tmp_path / "changes.csv", timezone=HELSINKI)
    midnight = at("2026-07-01T21:00")
    assert [n.last_s for n in plant.spans.values()][:-1] == [midnight]
    assert {n.zone for n in plant.spans.values()} == {HELSINKI}
    assert [c.time_s for c in plant.changes] == [at("2026-07-02T05:00")]


def test_read_refuses_options_of_commands(tmp_path: Path) -> None:
    """`read` takes no span of time, and raises an error instead of ignoring it."""
    with pytest.raises(TypeError, match="since"):
        read(tmp_path / "export.parquet", since="2026-07-01")


def test_the_store_and_its_pages_keep_the_zone(tmp_path: Path) -> None:
    """`run --timezone` divides at the midnight of the plant, --since is in the zone of the plant, and the page uses
    that zone.
    """
    start = at("2026-07-01T00:00")
    n = 86400 // 10
    stamp = (start + 10.0 * np.arange(n)) * 1e6
    rng = np.random.default_rng(0)
    table = {"timestamp": pa.array(stamp.astype("int64"), pa.timestamp("us", tz="UTC"))}
    table |= {f"FIC1.{r}": pa.array(50 + rng.normal(size=n)) for r in ("SP", "PV", "OP")}
    pq.write_table(pa.table(table), tmp_path / "export.parquet")
    arguments = [
        "run",
        str(tmp_path / "export.parquet"),
        "--store",
        str(tmp_path / "store"),
        "--timezone",
        HELSINKI,
    ]
    result = CliRunner().invoke(
        main, [*arguments, "--since", "2026-07-01T12:00", "--until", "2026-07-01T20:00"]
    )
    assert result.exit_code == 0, result.output
    store = Store(tmp_path / "store")
    row = store.read("nights", "2026-07-01").to_pylist()[0]
    assert (row["timezone"], store.zone()) == (HELSINKI, HELSINKI)
    assert row["start_s"] == at("2026-07-01T09:00")
    assert row["duration_s"] == pytest.approx(8 * 3600.0, abs=20.0)
    drawn = CliRunner().invoke(main, ["pages", str(tmp_path / "store"), "--out", str(tmp_path / "pages")])
    assert drawn.exit_code == 0, drawn.output
    page = (tmp_path / "pages" / "index.html").read_text(encoding="utf-8")
    assert f'data-zone="{HELSINKI}"' in page
    assert f"times in {HELSINKI}" in page
