"""Pairs of columns are read with a separate clock for each tag, for all forms of the header."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analyzer.history.export import open_export

START_S = 1732176000.0
TAGS = ("FIC101.PV", "FIC101.SP", "FIC101.OP")
STEPS = {"FIC101.PV": 5.0, "FIC101.SP": 600.0, "FIC101.OP": 7.0}
"""Interval of each tag [s]."""
HEADERS = {
    "tag above the stamps": lambda tag: (tag, ""),
    "time and tag": lambda tag: ("Time", tag),
    "tag time and tag value": lambda tag: (f"{tag} Time", f"{tag} Value"),
    "numbered": lambda tag: (f"Timestamp_{TAGS.index(tag) + 1}", tag),
}


def stamps(tag: str) -> np.ndarray:
    """An hour of stamps of a tag, with its own first stamp [s]."""
    return START_S + TAGS.index(tag) + np.arange(0.0, 3600.0, STEPS[tag])


def number(tag: str) -> np.ndarray:
    """Values of a tag."""
    return np.round(50 + np.sin(stamps(tag) / 60 + TAGS.index(tag)), 3)


def written(stamp_s: float, excel: bool) -> str:
    """A stamp in the form of a spreadsheet."""
    if excel:
        return f"{stamp_s / 86400 + 25569:.8f}"
    return np.datetime64(int(stamp_s), "s").astype(object).strftime("%d-%b-%y %H:%M:%S")


def sheet(header: str, excel: bool, quality: bool = False) -> str:
    """The three tags in pairs of columns; the shorter ones have blank cells at the end."""
    names, columns = [], []
    for tag in TAGS:
        names += HEADERS[header](tag)
        columns.append([written(s, excel) for s in stamps(tag)])
        columns.append([f"{v:g}" for v in number(tag)])
        if quality:
            names.append("Quality")
            columns.append(["Bad" if k % 10 == 0 else "Good" for k in range(number(tag).size)])
    rows = max(len(c) for c in columns)
    padded = [c + [""] * (rows - len(c)) for c in columns]
    lines = [",".join(names), *(",".join(row) for row in zip(*padded, strict=True))]
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("name", "behind", "hours"),
    [
        ("Time (UTC+01:00)", "", 1.0),
        ("Time [CET]_1", "", 1.0),
        ("Time [Europe/Helsinki]", "", 2.0),
        ("Time", " [Europe/Helsinki]", 2.0),
        ("FIC101_MET", "", 0.0),
    ],
)
def test_a_zone_in_names_or_stamps_is_used(tmp_path: Path, name: str, behind: str, hours: float) -> None:
    """A zone in the name or in the stamps is used as in other tables.

    Letters after a tag above the stamps are no zone.
    """
    rows = [f"2024-11-21 08:00:{k:02d}{behind},{k},2024-11-21 08:00:{k:02d}{behind},{k}" for k in range(20)]
    (tmp_path / "x.csv").write_text("\n".join([f"{name},a.PV,{name},a.OP", *rows]) + "\n")
    series = open_export([tmp_path / "x.csv"]).read(["a.PV", "a.OP"])
    for tag in series.values():
        np.testing.assert_array_equal(tag.stamp_s, START_S - 3600 * hours + np.arange(20))


@pytest.mark.parametrize("excel", [False, True])
@pytest.mark.parametrize("header", HEADERS)
def test_each_tag_is_read_with_its_own_clock(tmp_path: Path, header: str, excel: bool) -> None:
    """Three tags at 5, 600 and 7 s are read with their own stamps and values."""
    (tmp_path / "x.csv").write_text(sheet(header, excel))
    export = open_export([tmp_path / "x.csv"])
    assert export.tags == TAGS
    for tag, series in export.read(TAGS).items():
        assert series.stamp_s == pytest.approx(stamps(tag), abs=0.01)
        assert series.value == pytest.approx(number(tag), abs=1e-4)
        assert not series.bad.any()
    assert "3 tags with 3 clocks of their own" in " ".join(export.notes)
    assert export.span() == pytest.approx((START_S, START_S + 3597.0), abs=3)


def test_quality_after_each_pair(tmp_path: Path) -> None:
    """A quality column after each pair marks the bad samples of that tag."""
    (tmp_path / "x.csv").write_text(sheet("time and tag", False, quality=True))
    for series in open_export([tmp_path / "x.csv"]).read(TAGS).values():
        assert series.bad.tolist() == [k % 10 == 0 for k in range(series.bad.size)]


def test_two_clocks_for_one_table_are_no_pairs(tmp_path: Path) -> None:
    """A wide table with local and UTC stamps, next to each other or at the end, is one table with one clock."""
    rows = [f"2024-11-21 08:00:{k:02d},2024-11-21 07:00:{k:02d},{k},{k}" for k in range(60)]
    (tmp_path / "a.csv").write_text("timestamp,utc,FIC101.PV,FIC101.OP\n" + "\n".join(rows))
    turned = [",".join((r.split(",")[0], *r.split(",")[2:], r.split(",")[1])) for r in rows]
    (tmp_path / "b.csv").write_text("timestamp,FIC101.PV,FIC101.OP,logged\n" + "\n".join(turned))
    for name in ("a.csv", "b.csv"):
        series = open_export([tmp_path / name]).read(["FIC101.PV", "FIC101.OP"])
        assert all(s.value.tolist() == list(range(60)) for s in series.values())
        assert series["FIC101.PV"].stamp_s[0] == START_S
