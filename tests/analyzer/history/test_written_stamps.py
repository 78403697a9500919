"""Stamps with words and zones of many countries are read at their time, or refused in one line."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from analyzer.history import stamps
from analyzer.history.export import open_export
from analyzer.history.table import ReadOptions
from identification.errors import InputError

FIRST = datetime(2024, 11, 21, 8, 0, 0, tzinfo=UTC)
MOMENTS = [FIRST + timedelta(seconds=5 * k) for k in range(60)]


def written(path: Path, show: Callable[[datetime], str], time: str = "Time") -> Path:
    """An export with the stamps in the given form."""
    rows = [f"{show(at)};{k}" for k, at in enumerate(MOMENTS)]
    path.write_text("\n".join([f"{time};a.PV", *rows]) + "\n", encoding="utf-8")
    return path


def check(path: Path, timezone: str | None = None) -> list[str]:
    """Check that all stamps have the right times; returns the notes."""
    export = open_export([path], ReadOptions(timezone=timezone))
    stamp_s = export.read(["a.PV"])["a.PV"].stamp_s
    np.testing.assert_allclose(stamp_s, [at.timestamp() for at in MOMENTS], rtol=0, atol=1e-3)
    return list(export.notes)


NOVEMBER = (
    *(
        "November",
        "nov.",
        "noviembre",
        "novembre",
        "novembro",
        "marraskuuta",
        "listopada",
        "listopadu",
        "ноября",
    ),
    *("листопада", "Kasım", "noiembrie", "nóvember", "Νοεμβρίου", "lapkričio", "novembris", "Novembra"),
)


@pytest.mark.parametrize("month", NOVEMBER)
def test_a_month_in_another_language(tmp_path: Path, month: str) -> None:
    """November is recognized by its name."""
    check(written(tmp_path / "x.csv", lambda at: f"{at:%d}. {month} {at:%Y %H:%M:%S}"))


JUNE = ("Ιουνίου", "июня", "Haziran", "czerwca", "juin", "birželio", "kesäkuuta", "června")
JULY = ("Ιουλίου", "июля", "Temmuz", "lipca", "juillet", "liepos", "heinäkuuta", "července", "červenec")


@pytest.mark.parametrize(("name", "month"), [*((n, 6) for n in JUNE), *((n, 7) for n in JULY)])
def test_june_is_not_july(tmp_path: Path, name: str, month: int) -> None:
    """Months with similar names are distinguished, in the form used with a day."""
    path = written(tmp_path / "x.csv", lambda at: f"{at:%d} {name} {at:%Y %H:%M:%S}")
    stamp_s = open_export([path]).read(["a.PV"])["a.PV"].stamp_s
    assert stamp_s[0] == datetime(2024, month, 21, 8, tzinfo=UTC).timestamp()


SHOWN = (
    *(
        "%a %b %d %H:%M:%S %Y",
        "%A, %B %d, %Y %I:%M:%S %p",
        "%B %d, %Y at %I:%M:%S %p",
        "%dst %B %Y, %H:%M:%S",
    ),
    *(
        "%H:%M:%S %d/%m/%Y",
        "%d de noviembre de %Y %H:%M:%S",
        "%Y年%m月%d日 %H:%M:%S",
        "%Y年%m月%d日 %H时%M分%S秒",
    ),
    *(
        "Do. %d.%m.%Y %H:%M:%S",
        "jeu. %d nov. %Y %H:%M:%S",
        "%a, %d %b %Y %H:%M:%S +0000",
        "%a %b %d %H:%M:%S UTC %Y",
    ),
)


@pytest.mark.parametrize("form", SHOWN)
def test_a_stamp_in_words(tmp_path: Path, form: str) -> None:
    """Stamps of ctime, long English, weekday names, the time of day first, Spanish and Chinese dates are read."""
    check(written(tmp_path / "x.csv", lambda at: at.strftime(form)))


ZONES = (
    *((" EST", -5.0), (" (CET)", 1.0), (" [CET]", 1.0), (" AEST", 10.0), (" Europe/Berlin", 1.0)),
    *(
        (" [Europe/Berlin]", 1.0),
        ("+01:00[Europe/Berlin]", 1.0),
        (" GMT+0100 (Central European Standard Time)", 1.0),
    ),
)


@pytest.mark.parametrize(("behind", "hours"), ZONES)
def test_a_zone_after_the_stamp(tmp_path: Path, behind: str, hours: float) -> None:
    """Letters, names and offsets of zones are read, with or without brackets."""
    east = timedelta(hours=hours)
    check(written(tmp_path / "x.csv", lambda at: f"{at + east:%Y-%m-%d %H:%M:%S}{behind}"))


@pytest.mark.parametrize(
    ("zone", "hours"),
    [("EST", -5.0), ("MESZ", 2.0), ("AEST", 10.0), ("Europe/Berlin", 1.0), ("UTC-03:00", -3.0)],
)
@pytest.mark.parametrize("name", ["Time ({})", "Timestamp [{}]", "Timestamp {}"])
def test_a_zone_in_the_column_s_name(tmp_path: Path, name: str, zone: str, hours: float) -> None:
    """The zone in the name of a column is the zone of its stamps."""
    east = timedelta(hours=hours)
    check(written(tmp_path / "x.csv", lambda at: f"{at + east:%Y-%m-%d %H:%M:%S}", name.format(zone)))


@pytest.mark.parametrize(
    ("letters", "zone", "hours"), [("CST", "America/Chicago", -6.0), ("CST", "Asia/Shanghai", 8.0)]
)
def test_letters_of_several_zones(tmp_path: Path, letters: str, zone: str, hours: float) -> None:
    """Letters of several zones are refused after a stamp and noted in a column name, until the zone is stated."""
    east = timedelta(hours=hours)
    behind = written(tmp_path / "x.csv", lambda at: f"{at + east:%Y-%m-%d %H:%M:%S} {letters}")
    named = written(tmp_path / "y.csv", lambda at: f"{at + east:%Y-%m-%d %H:%M:%S}", f"Time ({letters})")
    with pytest.raises(InputError, match=f"'{letters}' means several; state --timezone"):
        open_export([behind])
    assert "; state --timezone" in open_export([named]).notes[0]
    check(behind, zone)
    check(named, zone)


def test_eastern_time_has_summer_time(tmp_path: Path) -> None:
    """If the stated zone uses the name EST, a column with that name follows the zone in summer too."""
    rows = "\n".join(f"2024-07-01 08:00:{k:02d};{k}" for k in range(60))
    (tmp_path / "x.csv").write_text(f"Time (EST);a.PV\n{rows}\n")
    export = open_export([tmp_path / "x.csv"], ReadOptions(timezone="America/New_York"))
    assert export.read(["a.PV"])["a.PV"].stamp_s[0] == datetime(2024, 7, 1, 12, tzinfo=UTC).timestamp()


def test_times_beyond_a_day_need_no_column_name(tmp_path: Path) -> None:
    """A column of times such as 25:10:03 is the clock, counted from the start, under any name."""
    rows = "".join(f"25:10:{k:02d},{k},{2 * k}\n" for k in range(40))
    (tmp_path / "x.csv").write_text("Z1,A,B\n" + rows)
    export = open_export([tmp_path / "x.csv"])
    assert export.tags == ("A", "B")
    assert export.span() == (25 * 3600 + 600.0, 25 * 3600 + 639.0)


@pytest.mark.parametrize(
    ("written", "month"),
    [
        *[("5. svibnja 2026. 08:00:00", 5), ("05-ožu-2026 08:00:00", 3), ("5. srpnja 2026. 8:00:00", 7)],
        *[("05 lipanj 2026 08:00", 6), ("05 lipca 2026 08:00", 7), ("05 srpna 2026 08:00", 8)],
    ],
)
def test_croatian_months(written: str, month: int) -> None:
    """Croatian month names are read if they are not Polish or Czech ones."""
    parts = stamps.fields(pa.array([written]))
    assert parts is not None
    assert stamps.stamp_seconds(parts)[0] == datetime(2026, month, 5, 8, tzinfo=UTC).timestamp()


def test_a_month_of_two_languages_is_that_of_the_zone() -> None:
    """Listopad is October in Zagreb and November in Warsaw."""
    for zone, month in (("Europe/Zagreb", 10), ("Europe/Warsaw", 11)):
        parts = stamps.fields(pa.array(["05 listopad 2026 08:00"]), zone)
        assert parts is not None
        assert stamps.stamp_seconds(parts)[0] == datetime(2026, month, 5, 8, tzinfo=UTC).timestamp()


@pytest.mark.parametrize("written", ["{} Central European Standard Time", "{} (W. Europe Standard Time)"])
@pytest.mark.parametrize(("month", "hours"), [(1, 1), (7, 2)])
def test_zones_as_windows_names_them(tmp_path: Path, written: str, month: int, hours: int) -> None:
    """A zone in words after the stamps is that zone with its summer time; an unknown zone is refused."""
    at = [f"2026-{month:02d}-05 08:00:{k:02d}" for k in range(60)]
    path = tmp_path / "x.csv"
    path.write_text("time,a.PV\n" + "".join(f"{written.format(t)},{k}\n" for k, t in enumerate(at)))
    first = open_export([path]).read(["a.PV"])["a.PV"].stamp_s[0]
    assert first == datetime(2026, month, 5, 8 - hours, tzinfo=UTC).timestamp()
    path.write_text(path.read_text().replace("Europe", "Atlantis"))
    if "W." in written:
        with pytest.raises(InputError):
            open_export([path])


@pytest.mark.parametrize(("unit", "unit_s"), [("us", 1e-6), ("µs", 1e-6), ("ns", 1e-9), ("ms", 1e-3)])
def test_a_unit_in_the_name_is_the_unit(tmp_path: Path, unit: str, unit_s: float) -> None:
    """A clock is read in the unit of its column name: 10 ms stay 10 ms."""
    step = round(0.01 / unit_s)
    rows = "".join(f"{123456789 + k * step},{k % 7}\n" for k in range(100))
    (tmp_path / "x.csv").write_text(f"time ({unit}),a.PV\n{rows}", encoding="utf-8")
    stamp_s = open_export([tmp_path / "x.csv"]).read(["a.PV"])["a.PV"].stamp_s
    np.testing.assert_allclose(np.diff(stamp_s), 0.01, rtol=1e-3)
