"""Content that could be lost silently is read, or reported and not assessed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analyzer.config import QualityLimits
from analyzer.history.export import ReadOptions, open_export
from analyzer.history.values import parsed
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from identification.errors import InputError, NotAssessedError

N = 400
STAMPS = [f"2024-11-21 08:{k // 60:02d}:{k % 60:02d}" for k in range(N)]


def table(tmp_path: Path, cells: list[str], delimiter: str = ";", name: str = "FIC1.PV") -> Path:
    """An export with one tag and the given cells."""
    lines = [
        f"timestamp{delimiter}{name}",
        *(f"{s}{delimiter}{c}" for s, c in zip(STAMPS, cells, strict=False)),
    ]
    (tmp_path / "x.csv").write_text("\n".join(lines), encoding="utf-8")
    return tmp_path / "x.csv"


@pytest.mark.parametrize(
    ("cells", "decimal", "numbers"),
    [
        (["1,234.5", "-12,000", "999"], ".", [1234.5, -12000, 999]),
        (["1.234,5", "-12.000", "999"], ",", [1234.5, -12000, 999]),
        (["1 234,5", "12\u00a0000,25", "1'000"], ",", [1234.5, 12000.25, 1000]),
        (["12.5 t/h", "-3 t/h", "1e3 t/h"], ".", [12.5, -3, 1000]),
        (["45 °C", "46.5 °C"], ".", [45, 46.5]),
        (["12 %", "13.5%"], ".", [12, 13.5]),
        (["\u22123.5", "\u20131", "2"], ".", [-3.5, -1, 2]),
        (["12", "13", "12,5"], ".", [12, 13, 12.5]),
        (["0,125", "0,250"], ".", [0.125, 0.25]),
    ],
)
def test_numbers_in_usual_notations(cells: list[str], decimal: str, numbers: list[float]) -> None:
    """Grouped thousands, units after the number, other minus signs and late decimal commas are read."""
    assert parsed(cells, decimal)[0].tolist() == numbers


@pytest.mark.parametrize("cells", [["1,23,4", "5"], ["12 t/h", "13 kg"], ["3/4"], ["1.2.3"]])
def test_an_ambiguous_text_is_no_number(cells: list[str]) -> None:
    """Groups of another length, mixed units and fractions are not read as numbers."""
    assert np.isnan(parsed(cells, ".")[0]).any()


def test_a_loop_with_many_unread_values_is_not_assessed(tmp_path: Path) -> None:
    """If a tenth of PV cannot be read, the loop is not assessed, and the line shows one such value."""
    cells = [f"{50 + k % 7}" if k % 10 else "5:30" for k in range(N)]
    series = open_export([table(tmp_path, cells)]).read(["FIC1.PV"])
    with pytest.raises(NotAssessedError, match=r"40 values of FIC1\.PV, such as '5:30', are not understood"):
        prepare(LoopSpec("FIC1", pv="FIC1.PV"), series, QualityLimits())


def test_text_instead_of_a_pv_is_no_trend(tmp_path: Path) -> None:
    """A PV column of words has no good sample."""
    series = open_export([table(tmp_path, ["AUTO", "MAN"] * (N // 2))]).read(["FIC1.PV"])
    with pytest.raises(NotAssessedError, match="none that is good"):
        prepare(LoopSpec("FIC1", pv="FIC1.PV"), series, QualityLimits())


def test_a_quote_that_is_not_closed_loses_no_rows(tmp_path: Path) -> None:
    """One extra quote in row 50 loses no other row."""
    cells = [('"' if k == 50 else "") + str(k) for k in range(N)]
    export = open_export([table(tmp_path, cells, ",")])
    assert export.read(["FIC1.PV"])["FIC1.PV"].value.tolist() == list(range(N))
    assert "a quote is not closed" in " ".join(export.notes)


def test_several_date_formats_in_one_file(tmp_path: Path) -> None:
    """ISO dates, dates with points and month names in one file are all read."""
    lines = ["timestamp,FIC1.PV"]
    for k in range(N):
        clock = f"08:{k // 60:02d}:{k % 60:02d}"
        lines.append((f"2024-11-21 {clock}", f"21.11.2024 {clock}", f"21-Nov-24 {clock}")[k % 3] + f",{k}")
    (tmp_path / "x.csv").write_text("\n".join(lines))
    series = open_export([tmp_path / "x.csv"]).read(["FIC1.PV"])["FIC1.PV"]
    assert series.value.tolist() == list(range(N))


def test_july_is_not_june_in_french(tmp_path: Path) -> None:
    """15 juillet and 15 juin are thirty days apart, and août and février are read."""
    days = ["15 juin 2024", "15 juillet 2024", "15 août 2024", "15 février 2025", "15-juil.-25"]
    lines = ["Date;FIC1.PV", *(f"{day} 08:00:00;{k}" for k, day in enumerate(days))]
    (tmp_path / "x.csv").write_text("\n".join(lines), encoding="utf-8")
    stamp = open_export([tmp_path / "x.csv"]).read(["FIC1.PV"])["FIC1.PV"].stamp_s
    assert (np.diff(stamp) / 86400).tolist() == [30, 31, 184, 150]


@pytest.mark.parametrize(
    ("header", "step_s"),
    [("Time (min)", 60.0), ("time_h", 3600.0), ("Time [s]", 1.0), ("t (ms)", 0.001), ("Zeit (min)", 60.0)],
)
def test_clocks_that_count_from_the_start_in_their_own_unit(
    tmp_path: Path, header: str, step_s: float
) -> None:
    """Minutes, hours and milliseconds since the start are read in the unit of the column name."""
    (tmp_path / "x.csv").write_text(f"{header},FIC1.PV\n" + "\n".join(f"{k},{k}" for k in range(N)))
    stamp = open_export([tmp_path / "x.csv"]).read(["FIC1.PV"])["FIC1.PV"].stamp_s
    assert np.diff(stamp) == pytest.approx(step_s)


def test_a_day_in_seconds_is_not_in_excel_days(tmp_path: Path) -> None:
    """Seconds from 0 to 86,400 are not read as dates of the last century."""
    (tmp_path / "x.csv").write_text("time,FIC1.PV\n" + "\n".join(f"{k},{k}" for k in range(0, 86400, 60)))
    stamp = open_export([tmp_path / "x.csv"]).read(["FIC1.PV"])["FIC1.PV"].stamp_s
    assert (stamp[0], stamp[-1]) == (0.0, 86340.0)


def test_stamps_that_cannot_be_read_are_not_replaced_by_a_count(tmp_path: Path) -> None:
    """If the time column cannot be read, no row number or value replaces it."""
    rows = [f"{k},first shift {k},{50 + k % 5}" for k in range(N)]
    (tmp_path / "x.csv").write_text("index,timestamp,FIC1.PV\n" + "\n".join(rows))
    with pytest.raises(InputError, match="'first shift 0' is no time stamp"):
        open_export([tmp_path / "x.csv"])


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("DataQuality", "Good", "Bad"),
        ("Validity", "1", "0"),
        ("IsGood", "True", "False"),
        ("Qualität", "Gut", "Schlecht"),
    ],
)
def test_quality_under_other_names(tmp_path: Path, name: str, good: str, bad: str) -> None:
    """A quality column is recognized by its usual names, and each tenth sample is bad."""
    rows = [f"{s},FIC1.PV,{k},{bad if k % 10 == 0 else good}" for k, s in enumerate(STAMPS)]
    (tmp_path / "x.csv").write_text(f"timestamp,tag,value,{name}\n" + "\n".join(rows), encoding="utf-8")
    series = open_export([tmp_path / "x.csv"]).read(["FIC1.PV"])["FIC1.PV"]
    assert series.bad.tolist() == [k % 10 == 0 for k in range(N)]


def test_columns_of_time_and_quality_can_be_named(tmp_path: Path) -> None:
    """Options name the columns of time and quality if their names are unknown; a wrong name is reported."""
    rows = [f"{s},FIC1.PV,{k},{'x' if k % 10 == 0 else 'Good'}" for k, s in enumerate(STAMPS)]
    (tmp_path / "x.csv").write_text("when,tag,value,how\n" + "\n".join(rows))
    options = ReadOptions(time_column="when", quality_column="how")
    series = open_export([tmp_path / "x.csv"], options).read(["FIC1.PV"])["FIC1.PV"]
    assert series.bad.sum() == N / 10
    with pytest.raises(InputError, match="no column 'who' among when, tag, value, how"):
        open_export([tmp_path / "x.csv"], ReadOptions(time_column="who"))
