"""Answers to typing errors, and columns whose meaning loops.csv states against their names."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.columns import NIGHTS
from analyzer.store.table import rows_table, write_table

BEGUN = datetime(2026, 3, 2, 23, 30)


def export(path: Path, heads: str, *first: str, form: str = "%Y-%m-%d %H:%M:%S") -> Path:
    """An hour of SP, PV and OP at 2 s, after columns with the same text in each row."""
    noise = np.random.default_rng(3).normal(0.0, 1.0, (1800, 2))
    stamps = ((BEGUN + timedelta(seconds=2 * k)).strftime(form) for k in range(1800))
    rows = (
        f"{t},{''.join(f'{x},' for x in first)}50,{50 + a:.3f},{40 + b:.3f}"
        for t, (a, b) in zip(stamps, noise, strict=True)
    )
    path.write_text("\n".join([heads, *rows]) + "\n", encoding="utf-8")
    return path


def checked(path: Path, loops: str, *more: str) -> Result:
    """`triage check` of an export with a loops.csv."""
    listed = path.with_name("loops.csv")
    listed.write_text(loops, encoding="utf-8")
    return CliRunner().invoke(main, ["check", str(path), "--loops", str(listed), *more])


@pytest.mark.parametrize("spelt", ["fic-101", "FIC101", "FIC 101", "FIC_101"])
def test_another_spelling_of_a_tag_gives_a_suggestion(tmp_path, spelt):
    """For a tag of loops.csv that the export has in another spelling, the spelling of the export is suggested."""
    found = checked(
        export(tmp_path / "day.csv", "timestamp,FIC-101.SP,FIC-101.PV,FIC-101.OP"), f"loop\n{spelt}\n"
    )
    assert found.exit_code == 1
    assert "did you mean FIC-101.PV?" in found.output


def test_a_tag_of_another_name_gives_no_suggestion(tmp_path):
    """A tag that the export has in no spelling is missing, and no other tag is suggested."""
    found = checked(
        export(tmp_path / "day.csv", "timestamp,FIC-101.SP,FIC-101.PV,FIC-101.OP"), "loop\nFIC-110\n"
    )
    assert "no PV tag FIC-110.PV in the export\n" in found.output


def test_a_pv_with_the_name_of_a_time_is_a_pv(tmp_path):
    """A column that loops.csv states as PV is no time column, although 'Data' means date in some languages."""
    path = export(tmp_path / "day.csv", "Time,sp,Data,out")
    found = checked(path, "loop,sp,pv,op\nTIC1,sp,Data,out\n")
    assert found.exit_code == 0, found.output
    assert "TIC1: SP sp, PV Data, OP out; 1800 samples every 2 s" in found.output


def test_an_error_with_fractions_is_no_quality(tmp_path):
    """A column 'error' with fractions is a signal next to a column 'status', and rejects no sample."""
    path = export(tmp_path / "day.csv", "time,status,sp,error,output", "3")
    found = checked(path, "loop,sp,pv,op\nTC1,sp,error,output\n")
    assert found.exit_code == 0, found.output
    assert "taken as bad" not in found.output


def test_a_stated_tag_is_no_quality(tmp_path):
    """A column that loops.csv states as a tag is no quality column, for any name and any values."""
    path = export(tmp_path / "day.csv", "time,quality,sp,pv,op", "3")
    found = checked(path, "loop,sp,pv,op,mode\nTC1,sp,pv,op,quality\n")
    assert "taken as bad" not in found.output


@pytest.mark.parametrize("form", ["%H:%M:%S", "%I:%M:%S %p"])
def test_times_of_day_are_read_over_midnight_in_a_stated_format(tmp_path, form):
    """A format without a date reads times of day with the next day after midnight: the hour has its 1,800 samples."""
    path = export(tmp_path / "day.csv", "clock,TIC1.SP,TIC1.PV,TIC1.OP", form=form)
    found = checked(path, "loop\nTIC1\n", "--date-format", form)
    assert found.exit_code == 0, found.output
    assert "1970-01-01 23:30 to 1970-01-02 00:29" in found.output
    assert "1800 samples every 2 s" in found.output


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """A store of one night of one loop."""
    row = {"loop": "FIC1", "night": "2026-03-02", "status": "ok", "reason": "does not oscillate"}
    write_table(rows_table([row], NIGHTS), tmp_path / "store" / "nights" / "2026-03-02.parquet")
    return tmp_path / "store"


def test_a_misspelt_column_gives_a_suggestion(store):
    """`--by eror` suggests columns of errors in one short line, and an unknown name does not list all columns."""
    near = CliRunner().invoke(main, ["rank", str(store), "--by", "eror"])
    assert near.exit_code == 2
    assert "average_absolute_error_pct" in near.output
    far = CliRunner().invoke(main, ["rank", str(store), "--by", "xyzzy"])
    assert far.exit_code == 2
    assert max(len(near.output), len(far.output)) < 250


def test_a_list_needs_no_terminal_and_no_unicode(store):
    """`rank` prints a list if the output is cp1252, and ends without error if the output is closed."""
    command = [sys.executable, "-m", "analyzer.cli", "rank", str(store)]
    western = subprocess.run(
        command, capture_output=True, env={**os.environ, "PYTHONIOENCODING": "cp1252"}, check=False
    )
    assert western.returncode == 0, western.stderr
    assert b"----" in western.stdout
    assert b"\\u" not in western.stdout
    closed = subprocess.run(
        ["sh", "-c", 'exec "$@" >&-', "sh", *command], stderr=subprocess.PIPE, text=True, check=False
    )
    assert (closed.returncode, closed.stderr) == (0, "")
