"""A table that is written in many formats gives the same numbers at the same times."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from analyzer.history import sheet
from analyzer.history.export import ReadOptions, open_export

STAMP_FORMATS = (
    "%Y-%m-%d %H:%M:%S",
    "%Y-%m-%dT%H:%M:%S",
    "%Y-%m-%dT%H:%M:%SZ",
    "%Y-%m-%d %H:%M:%S.%f",
    "%Y/%m/%d %H:%M:%S",
    "%d.%m.%Y %H:%M:%S",
    "%d.%m.%y %H:%M:%S",
    "%d/%m/%Y %H:%M:%S",
    "%m/%d/%Y %H:%M:%S",
    "%m/%d/%Y %I:%M:%S %p",
    "%d-%b-%y %H:%M:%S",
    "%d-%b-%Y %H:%M:%S.%f",
    "%b %d, %Y %I:%M:%S %p",
    "%Y%m%d %H%M%S",
    "%Y%m%d%H%M%S",
    "epoch s",
    "epoch ms",
    "epoch us",
    "excel",
)
PREAMBLES = ("", "# exported 21 Nov\n# by hand\n", "[Data]\n", "sep={delimiter}\n", "\n")


def day(start: str = "2024-11-21 11:59:50", n: int = 30) -> pd.DataFrame:
    values = np.random.default_rng(3).integers(-100_000, 100_000, (n, 2)) / 1000
    table = pd.DataFrame(values, columns=["FIC101.PV", "FIC101.OP"])
    table.insert(0, "Timestamp", pd.date_range(start, periods=n, freq="s"))
    return table


def stamps_as(stamps: pd.Series, written: str) -> list[str]:
    ticks = stamps.to_numpy().astype("datetime64[us]").astype(np.int64)
    epoch = {"epoch s": 1_000_000, "epoch ms": 1000, "epoch us": 1}
    if written in epoch:
        return [str(tick // epoch[written]) for tick in ticks]
    if written == "excel":
        return [f"{tick / 86_400e6 + 25569:.9f}" for tick in ticks]
    return list(stamps.dt.strftime(written))


def as_text(table: pd.DataFrame, written: str, delimiter: str, decimal: str, quote: str) -> str:
    stamps = stamps_as(table["Timestamp"], written)
    quote = '"' if delimiter in written else quote
    if written == "excel":
        stamps = [stamp.replace(".", decimal) for stamp in stamps]
    lines = [delimiter.join(f"{quote}{name}{quote}" for name in table.columns)]
    for stamp, *cells in zip(stamps, *(table[name] for name in table.columns[1:]), strict=True):
        numbers = [f"{cell:.3f}".replace(".", decimal) for cell in cells]
        lines.append(delimiter.join([f"{quote}{stamp}{quote}", *numbers]))
    return "\n".join(lines) + "\n"


def assert_read(path: Path, table: pd.DataFrame, options: ReadOptions | None = None) -> tuple[str, ...]:
    export = open_export([path], options or ReadOptions())
    stamp_s = table["Timestamp"].to_numpy().astype("datetime64[us]").astype(np.int64) / 1e6
    read = export.read(["FIC101.PV", "FIC101.OP"])
    for tag, series in read.items():
        np.testing.assert_allclose(series.stamp_s, stamp_s, rtol=0, atol=2e-3)
        np.testing.assert_allclose(series.value, table[tag].to_numpy(), rtol=1e-15)
        assert not series.bad.any()
    return export.notes


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    written=st.sampled_from(STAMP_FORMATS),
    dialect=st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", ".")]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"]),
    quote=st.sampled_from(["", '"']),
    preamble=st.sampled_from(PREAMBLES),
    newest_first=st.booleans(),
    line_end=st.sampled_from(["\n", "\r\n"]),
)
def test_any_written_format_is_read(
    written: str,
    dialect: tuple[str, str],
    encoding: str,
    quote: str,
    preamble: str,
    newest_first: bool,
    line_end: str,
) -> None:
    """Each wide CSV equals its table after reading, for all formats of stamps, numbers and lines."""
    table = day()
    rows = table[::-1] if newest_first else table
    text = preamble.format(delimiter=dialect[0]) + as_text(rows, written, *dialect, quote)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "export.csv"
        path.write_bytes(text.replace("\n", line_end).encode(encoding))
        assert_read(path, table)


@pytest.mark.parametrize("written", ["%d/%m/%Y %H:%M:%S", "%m/%d/%Y %H:%M:%S"])
def test_day_or_month_by_a_day_above_twelve(tmp_path: Path, written: str) -> None:
    """One day above 12 in the column decides the order of day and month for all rows."""
    table = day("2024-11-12 23:59:45")
    (tmp_path / "x.csv").write_text(as_text(table, written, ",", ".", ""))
    assert any("exceeds 12" in note for note in assert_read(tmp_path / "x.csv", table))


@pytest.mark.parametrize("written", ["%d/%m/%Y %H:%M:%S", "%m/%d/%Y %H:%M:%S"])
def test_day_or_month_by_the_order_of_the_stamps(tmp_path: Path, written: str) -> None:
    """Without such a day, the order in which time continues without a jump is used."""
    table = day("2024-02-01 23:59:45")
    (tmp_path / "x.csv").write_text(as_text(table, written, ",", ".", ""))
    assert any("without a jump" in note for note in assert_read(tmp_path / "x.csv", table))


def test_day_or_month_by_another_file(tmp_path: Path) -> None:
    """A file with ambiguous dates follows a file of the same export with unambiguous ones."""
    for name, start in (("a.csv", "2024-11-05 08:00"), ("b.csv", "2024-11-21 08:00")):
        (tmp_path / name).write_text(as_text(day(start), "%d/%m/%Y %H:%M:%S", ",", ".", ""))
    export = open_export([tmp_path])
    assert export.span()[0] == pd.Timestamp("2024-11-05 08:00").timestamp()
    assert "a.csv: dates are read day first: as in b.csv" in export.notes


def test_day_or_month_undecided_is_reported(tmp_path: Path) -> None:
    """Dates that fit both orders are read month first with a note; a stated order changes this."""
    table = day("2024-11-05 08:00")
    (tmp_path / "x.csv").write_text(as_text(table, "%d/%m/%Y %H:%M:%S", ",", ".", ""))
    notes = open_export([tmp_path]).notes
    assert any("month first: every date fits both orders" in note for note in notes)
    assert_read(tmp_path / "x.csv", table, ReadOptions(day_first=True))


def test_a_stated_date_format(tmp_path: Path) -> None:
    """A stated date format is used where no detection could succeed."""
    table = day()
    (tmp_path / "x.csv").write_text(as_text(table, "%y%j_%H.%M.%S", ",", ".", ""))
    assert_read(tmp_path / "x.csv", table, ReadOptions(date_format="%y%j_%H.%M.%S"))


@pytest.mark.parametrize(
    ("date", "time"), [("%d.%m.%Y", "%H:%M:%S"), ("%Y-%m-%d", "%H:%M:%S"), ("%m/%d/%Y", "%I:%M:%S %p")]
)
def test_separate_date_and_time(tmp_path: Path, date: str, time: str) -> None:
    """A column of dates and a column of times are combined into one time."""
    table = day()
    apart = table.drop(columns="Timestamp")
    apart.insert(0, "Time", table["Timestamp"].dt.strftime(time))
    apart.insert(0, "Date", table["Timestamp"].dt.strftime(date))
    apart.to_csv(tmp_path / "x.csv", index=False)
    assert_read(tmp_path / "x.csv", table)


@pytest.mark.parametrize(
    "names",
    [
        ("NAME", "IP_TREND_TIME", "IP_TREND_VALUE"),
        ("Tag Name", "Time Stamp", "Value"),
        ("TagName", "DateTime", "Value"),
        ("point", "t_stamp", "val"),
        ("Tag", "Zeit", "Messung"),
    ],
)
@pytest.mark.parametrize("by_tag", [True, False])
def test_names_of_long_columns(tmp_path: Path, names: tuple[str, str, str], by_tag: bool) -> None:
    """Long tables are recognized by the column names of historians, for any order of rows."""
    table = day()
    rows = table.melt(id_vars="Timestamp", var_name="tag", value_name="value")
    rows = rows if by_tag else rows.sort_values("Timestamp")
    tag, stamp, value = names
    rows.rename(columns={"tag": tag, "Timestamp": stamp, "value": value}).to_csv(
        tmp_path / "x.csv", index=False
    )
    assert_read(tmp_path / "x.csv", table)


def test_one_loop_a_file_named_for_it(tmp_path: Path) -> None:
    """Columns named only PV and OP belong to the loop with the name of the file."""
    table = day()
    bare = table.rename(columns={"FIC101.PV": "PV", "FIC101.OP": "OP"})
    bare.to_csv(tmp_path / "FIC101.csv", index=False)
    assert_read(tmp_path / "FIC101.csv", table)


def test_parquet_with_text_stamps_and_index(tmp_path: Path) -> None:
    """Parquet with stamps as text, or as a pandas index, gives the same result."""
    table = day()
    written = table.assign(Timestamp=table["Timestamp"].dt.strftime("%d.%m.%Y %H:%M:%S"))
    written.to_parquet(tmp_path / "a.parquet")
    table.set_index("Timestamp").rename_axis(None).to_parquet(tmp_path / "b.parquet")
    table.assign(Timestamp=table["Timestamp"].dt.tz_localize("UTC").dt.tz_convert("Asia/Tokyo")).to_parquet(
        tmp_path / "c.parquet"
    )
    for name in ("a", "b", "c"):
        assert_read(tmp_path / f"{name}.parquet", table)


def test_lines_that_do_not_fit_are_reported(tmp_path: Path) -> None:
    """A footer is left out and counted; the other rows are read."""
    table = day()
    text = as_text(table, "%Y-%m-%d %H:%M:%S", ",", ".", "")
    (tmp_path / "x.csv").write_text(text + "(30 rows affected)\n")
    notes = assert_read(tmp_path / "x.csv", table)
    assert any("1 lines do not have as many columns as the header" in note for note in notes)


def test_a_file_too_big_to_keep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file above the size limit is opened by its first rows, with the same result."""
    monkeypatch.setattr("analyzer.history.sheet.WHOLE_BYTES", 100)
    table = day(n=70_000)
    (tmp_path / "x.csv").write_text(as_text(table, "%d.%m.%Y %H:%M:%S", ";", ",", ""))
    assert_read(tmp_path / "x.csv", table)


def test_a_text_is_parsed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A text is parsed once, both to find its format and to read its samples."""
    parsed, whole = [], sheet._parsed_sheet
    monkeypatch.setattr(sheet, "_parsed_sheet", lambda *how: parsed.append(how) or whole(*how))
    table = day()
    (tmp_path / "x.csv").write_text(as_text(table, "%d.%m.%Y %H:%M:%S", ";", ",", ""))
    assert_read(tmp_path / "x.csv", table)
    assert len(parsed) == 1


def test_a_latin_letter_late_in_the_file(tmp_path: Path) -> None:
    """A file that begins as UTF-8 and later contains Windows Latin letters is read."""
    table = day(n=60_000)
    text = as_text(table, "%Y-%m-%d %H:%M:%S", ",", ".", "")
    rows = "".join(f"{line},{'ü' if i == 60_000 else 'x'}\n" for i, line in enumerate(text.splitlines()))
    (tmp_path / "x.csv").write_bytes(rows.encode("cp1252"))
    assert_read(tmp_path / "x.csv", table)


@pytest.mark.parametrize(
    ("zone", "hours"), [("PST", -8), ("MST", -7), ("MET", 1), ("MEZ", 1), ("MSK", 3), ("CEST", 2), ("UTC", 0)]
)
def test_letters_of_a_zone_are_not_am_or_pm(tmp_path: Path, zone: str, hours: int) -> None:
    """PST is a zone and not an afternoon; AM and PM before a zone keep their meaning."""
    table = day()
    for clock in ("%H:%M:%S", "%I:%M:%S %p", "%I:%M:%S%p"):
        local = (table["Timestamp"] + pd.Timedelta(hours=hours)).dt.strftime(f"%Y-%m-%d {clock} {zone}")
        table.assign(Timestamp=local).to_csv(tmp_path / "x.csv", index=False)
        assert_read(tmp_path / "x.csv", table)
