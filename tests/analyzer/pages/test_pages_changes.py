"""Changes are read in the usual notations, and an error names the wrong row."""

from __future__ import annotations

from pathlib import Path

import pytest

from analyzer.history.stamps import parse_time
from analyzer.loops.changes import TuningChange, read_changes, stated_changes
from identification.errors import InputError

T = 1773043200.0


def written(folder: Path, text: str) -> Path:
    """A file with a text."""
    path = folder / "changes.csv"
    path.write_text(text, "utf-8")
    return path


def test_all_columns_are_read(tmp_path: Path) -> None:
    """Loop, time, settings and name are read as written, for each delimiter and decimal mark."""
    head = "loop;time;kp_old;ti_old;kp_new;ti_new;who\n"
    path = written(
        tmp_path,
        "\ufeff" + head + "A;2026-03-09T08:00Z;0,8;100;0,8;140;M. Laine\n\nB;2026-03-09 08:00;;;;;\n",
    )
    assert read_changes(path) == (TuningChange("A", T, 0.8, 100, 0.8, 140, "M. Laine"), TuningChange("B", T))


def test_the_mills_changes_are_read() -> None:
    """The seven changes of the sample are read with their settings."""
    found = read_changes(Path(__file__).parents[3] / "sample_data" / "changes.csv")
    assert len(found) == 7
    assert found[0] == TuningChange("LIC2101", T, 0.8, 100.0, 0.8, 140.0, "M. Laine")


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        ("loop,when\nA,2026\n", "no column 'time'"),
        ("loop,time\nA,yesterday evening\n", "row 2: time"),
        ("loop,time,kp_new\nA,2026-03-09,much\n", "row 2: kp_new 'much'"),
        ("loop,time\n", "no changes"),
    ],
)
def test_errors_name_the_place(tmp_path: Path, text: str, fragment: str) -> None:
    """An error is reported with its row and column."""
    with pytest.raises(InputError, match=fragment):
        read_changes(written(tmp_path, text))


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    """A missing file is an error of one line."""
    with pytest.raises(InputError, match="cannot be opened"):
        read_changes(tmp_path / "none.csv")


@pytest.mark.parametrize("text", ["2026-03-09T08:00:00Z", "2026-03-09 08:00", "2026-03-09T10:00+02:00"])
def test_times_have_zones(text: str) -> None:
    """A time with a zone is read in that zone, and one without is UTC."""
    assert parse_time(text, "") == T


def test_settings_that_differ_between_nights_are_changes() -> None:
    """Settings of loops.csv that differ from the night before are a change at the start of that night."""
    rows = [
        {"loop": "A", "start_s": T + k, "settings_changed_s": None, "kp": kp, "ti": 10.0}
        for k, kp in enumerate((1.0, 1.0, 2.0, 2.0))
    ]
    (found,) = stated_changes(rows)
    assert (found.time_s, found.kp_old, found.kp_new) == (T + 2, 1.0, 2.0)
    assert found.seen


def test_a_change_within_a_night_is_dated_to_its_sample() -> None:
    """If settings were typed in during a night, the change is dated to that moment, not to the start of the night."""
    days = [
        {"loop": "A", "start_s": T + 86400.0 * k, "settings_changed_s": None, "kp": 1.0 + (k > 0), "ti": 10.0}
        for k in range(2)
    ]
    days[1]["settings_changed_s"] = T + 86400.0 + 30_611.0
    assert [c.time_s for c in stated_changes(days)] == [T + 86400.0 + 30_611.0]
