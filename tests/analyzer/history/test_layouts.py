"""Tables after preambles, tables separated by blanks, clocks that count from the start, and stamps without
seconds.
"""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analyzer.history import stamps
from analyzer.history.export import open_export
from analyzer.history.table import ReadOptions
from identification.errors import InputError

MOMENTS = pd.date_range("2024-11-21 08:00", periods=60, freq="5s", tz="UTC")
NUMBER = np.arange(60) / 4


def lines(sep: str, form: str = "%Y-%m-%d %H:%M:%S", time: str = "Time") -> list[str]:
    """A table of two tags."""
    rows = [f"{at:{form}}{sep}{v}{sep}{50 - v}" for at, v in zip(MOMENTS, NUMBER, strict=True)]
    return [sep.join([time, "FIC1.PV", "FIC1.OP"]), *rows]


def check(path: Path, text: list[str]) -> None:
    """Check that both tags are read with each sample at its time, and that nothing is left out."""
    path.write_text("\n".join(text) + "\n", encoding="utf-8")
    export = open_export([path])
    assert export.tags == ("FIC1.PV", "FIC1.OP")
    series = export.read(export.tags)
    np.testing.assert_array_equal(series["FIC1.PV"].value, NUMBER)
    np.testing.assert_array_equal(series["FIC1.OP"].value, 50 - NUMBER)
    np.testing.assert_array_equal(series["FIC1.OP"].stamp_s, MOMENTS.as_unit("s").asi8)
    assert not any("left out" in note for note in export.notes)


PREAMBLES = (
    ["Trend report;Mill A;north"],
    ["Trend report;Mill A;north", "User;joe;", "From;2024-11-21 08:00:00;", "To;2024-11-21 09:00:00;"],
    ["Trend report;Mill A;", "Operator;A;B", "Shift;2;B"],
)


@pytest.mark.parametrize("preamble", PREAMBLES)
def test_a_preamble_as_wide_as_the_table(tmp_path: Path, preamble: list[str]) -> None:
    """Lines of a preamble are not the header if a row of names with a time column follows."""
    check(tmp_path / "x.csv", preamble + lines(";"))


@pytest.mark.parametrize(
    ("form", "time"),
    [("%Y-%m-%d %H:%M:%S", "Time"), ("%Y-%m-%d %H:%M:%S", "Date Time"), ("%Y-%m-%dT%H:%M:%S", "Time")],
)
def test_columns_separated_by_one_blank(tmp_path: Path, form: str, time: str) -> None:
    """Columns separated by one blank form a table, also if date and time have one column name."""
    check(tmp_path / "x.txt", lines(" ", form, time))


@pytest.mark.parametrize("step_s", [1, 60, 3600])
def test_hours_minutes_and_seconds_since_the_start(tmp_path: Path, step_s: int) -> None:
    """Times without a date that begin with zero count from the start, also beyond a day."""
    at = np.arange(60) * step_s
    rows = [f"{s // 3600}:{s // 60 % 60:02d}:{s % 60:02d},{k}" for k, s in enumerate(at)]
    (tmp_path / "x.csv").write_text("\n".join(["Elapsed,a.PV", *rows]) + "\n")
    export = open_export([tmp_path / "x.csv"])
    np.testing.assert_array_equal(export.read(["a.PV"])["a.PV"].stamp_s, at)
    assert any("since the start" in note for note in export.notes)


def test_the_search_for_stamps_does_not_grow_with_the_columns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The number of calls that split stamps, the slowest part of opening, does not grow with the number of
    columns.
    """
    whole, calls = stamps.fields, []
    monkeypatch.setattr(stamps, "fields", lambda *texts: calls.append(1) or whole(*texts))
    met = []
    for columns in (3, 300):
        rows = [f"{at:%Y-%m-%d %H:%M:%S}" + f",{k}" * columns for k, at in enumerate(MOMENTS)]
        names = [f"FIC{k}.PV" for k in range(columns)]
        (tmp_path / "x.csv").write_text("\n".join([",".join(["Time", *names]), *rows]) + "\n")
        calls.clear()
        assert open_export([tmp_path / "x.csv"]).tags == tuple(names)
        met.append(len(calls))
    assert met[0] == met[1] > 0


@pytest.mark.parametrize("form", ["%H:%M:%S", "%I:%M:%S %p"])
@pytest.mark.parametrize("blocks", [False, True])
def test_a_time_of_day_without_a_date_is_read(tmp_path: Path, form: str, blocks: bool) -> None:
    """Times from 23:00 to 01:00 of the third day continue over both midnights, and a note says that no date is
    stated.

    This holds too in a table of one tag after another.
    """
    at = pd.date_range("1970-01-01 23:00", "1970-01-03 01:00", freq="60s")
    rows = [f"{t.strftime(form)},{k}" for k, t in enumerate(at)]
    if blocks:
        rows = [f"{tag},{row}" for tag in ("a.PV", "a.OP") for row in rows]
    head = "tag,Time,value" if blocks else "Time,a.PV"
    (tmp_path / "x.csv").write_text("\n".join([head, *rows]) + "\n")
    export = pickle.loads(pickle.dumps(open_export([tmp_path / "x.csv"])))
    np.testing.assert_array_equal(export.read(["a.PV"])["a.PV"].stamp_s, 82800.0 + 60.0 * np.arange(len(at)))
    assert any("no date" in note for note in export.notes)


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize("form", ["%m/%d/%Y %H:%M", "%m/%d/%Y %I:%M %p", "%Y-%m-%d %H:%M:00"])
@pytest.mark.parametrize("step_s", [5, 30, 60])
def test_stamps_that_lost_their_seconds(tmp_path: Path, long: bool, form: str, step_s: int) -> None:
    """Several samples with the stamp of one minute are refused in one line; samples a minute apart are read."""
    at = pd.date_range("2024-11-21 08:00", periods=120, freq=f"{step_s}s")
    rows = [
        f"{f'{tag},' if long else ''}{t.strftime(form)},{k}"
        for k, t in enumerate(at)
        for tag in "ab"[: 1 + long]
    ]
    (tmp_path / "x.csv").write_text("\n".join(["tag,time,value" if long else "time,a.PV", *rows]) + "\n")
    if step_s < 60:
        with pytest.raises(InputError, match=r"x\.csv: stamps without their seconds, .* on .* whole minutes"):
            open_export([tmp_path / "x.csv"])
    else:
        export = open_export([tmp_path / "x.csv"])
        assert export.read([export.tags[0]])[export.tags[0]].stamp_s.size == 120


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_a_name_split_over_columns_is_one_tag(tmp_path: Path, mark: str) -> None:
    """Columns of area, loop and parameter form the name of a tag together."""
    rows = [("time", "area", "loop", "parameter", "value")]
    for k, at in enumerate(MOMENTS):
        rows += [
            (f"{at:%Y-%m-%d %H:%M:%S}", "A1", loop, p, k + i)
            for loop in "FG"
            for i, p in enumerate(("PV", "OP"))
        ]
    (tmp_path / "x.csv").write_text("\n".join(mark.join(map(str, row)) for row in rows) + "\n")
    export = open_export([tmp_path / "x.csv"])
    assert export.tags == ("A1/F.PV", "A1/F.OP", "A1/G.PV", "A1/G.OP")
    np.testing.assert_array_equal(export.read(["A1/G.OP"])["A1/G.OP"].value, np.arange(60) + 1)


@pytest.mark.parametrize("long", [False, True])
def test_rows_of_one_stamp_need_their_interval(tmp_path: Path, long: bool) -> None:
    """If no stamp advances, one line says what to state; with a stated interval the rows are read."""
    rows = [f"Aug-04-07 20:47:20,{k}" for k in range(60)]
    if long:
        rows = [f"{tag},{row}" for row in rows for tag in ("a.PV", "a.OP")]
    head = "tag,Time,value" if long else "Time,a.PV"
    (tmp_path / "x.csv").write_text("\n".join([head, *rows]) + "\n")
    with pytest.raises(InputError, match=r"the time column 'Time' does not advance.*--interval 30s"):
        open_export([tmp_path / "x.csv"])
    for stated in ("30s", "0.5 min", "30000 ms", "30"):
        export = open_export([tmp_path / "x.csv"], ReadOptions(interval=stated))
        stamp_s = export.read(["a.PV"])["a.PV"].stamp_s
        np.testing.assert_allclose(np.diff(stamp_s), 30.0)
        assert len(stamp_s) == 60
        assert export.span() == (stamp_s[0], stamp_s[-1])
    for wrong in ("soon", "-3s", "0", "30 parsecs"):
        with pytest.raises(InputError, match="--interval"):
            open_export([tmp_path / "x.csv"], ReadOptions(interval=wrong))
