"""Bad input: one clear line, no traceback, and the exit status of DESIGN.md."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from proofs.plant import START_S

N = 600
COMMANDS = ("check", "run")


def frame(loops: tuple[str, ...] = ("FIC1",), n: int = N) -> pd.DataFrame:
    """A wide export of healthy loops, one sample a second."""
    stamp = pd.to_datetime(START_S + np.arange(n), unit="s")
    columns: dict[str, object] = {"timestamp": stamp}
    for k, loop in enumerate(loops):
        pv = 50 + np.convolve(np.random.default_rng(k).standard_normal(n + 9), np.ones(10) / 10, mode="valid")
        columns |= {f"{loop}.SP": np.full(n, 50.0), f"{loop}.PV": pv, f"{loop}.OP": 50 - 0.5 * (pv - 50)}
    return pd.DataFrame(columns)


def asked(command: str, export: Path, *arguments: str | Path) -> Result:
    """Answer of `triage check` or `triage run` with a store beside the export."""
    store = ["--store", str(export.parent / "store")] if command == "run" else []
    return CliRunner().invoke(main, [command, str(export), *store, *map(str, arguments)])


def told(result: Result, status: int) -> str:
    """All that was printed, of a command that ended as it should: no traceback, no stray exception."""
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == status, result.output
    assert "Traceback" not in result.output
    return result.output


def one_line(result: Result) -> str:
    """The one line on stderr of a command that could do nothing."""
    told(result, 2)
    assert re.fullmatch(r"(reading .*\n)?", result.stdout)
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert result.stderr.startswith("triage: ")
    return result.stderr


# Nothing can be done: exit 2


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", ["export.csv", "export.parquet"])
def test_empty_file(tmp_path, command, name):
    """An empty file is told as empty, with its path."""
    (tmp_path / name).write_bytes(b"")
    line = one_line(asked(command, tmp_path / name))
    assert "empty file" in line
    assert str(tmp_path / name) in line


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    "content", [b"timestamp,FIC1.PV\n2026-03-02,1\n", b"PAR1 cut short", os.urandom(3000)]
)
def test_no_parquet(tmp_path, command, content):
    """A file that is named as Parquet and is none is told so."""
    (tmp_path / "export.parquet").write_bytes(content)
    assert "named as Parquet, but cannot be read as such" in one_line(
        asked(command, tmp_path / "export.parquet")
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_parquet_cut_short(tmp_path, command):
    """A Parquet file whose end is missing, as after a broken copy, is told so."""
    frame().to_parquet(tmp_path / "export.parquet")
    data = (tmp_path / "export.parquet").read_bytes()
    (tmp_path / "export.parquet").write_bytes(data[: len(data) // 2])
    assert "cannot be read as such" in one_line(asked(command, tmp_path / "export.parquet"))


@pytest.mark.parametrize("command", COMMANDS)
def test_no_such_file(tmp_path, command):
    """A path that does not exist is told with the path."""
    assert "no such file or folder" in one_line(asked(command, tmp_path / "none.parquet"))


@pytest.mark.parametrize("command", COMMANDS)
def test_folder_without_exports(tmp_path, command):
    """A folder that holds no export is told so."""
    (tmp_path / "empty").mkdir()
    assert "a folder without exports" in one_line(asked(command, tmp_path / "empty"))


@pytest.mark.parametrize("command", COMMANDS)
def test_missing_time_column(tmp_path, command):
    """An export without time stamps is told with the columns that it has."""
    frame().drop(columns="timestamp").to_csv(tmp_path / "export.csv", index=False)
    assert "no time column among FIC1.SP, FIC1.PV" in one_line(asked(command, tmp_path / "export.csv"))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_column_that_stands_twice(tmp_path, command):
    """Two columns of one name are told by name."""
    text = frame().to_csv(index=False).replace("FIC1.OP", "FIC1.PV", 1)
    (tmp_path / "export.csv").write_text(text)
    assert "column 'FIC1.PV' occurs twice" in one_line(asked(command, tmp_path / "export.csv"))


@pytest.mark.parametrize("command", COMMANDS)
def test_two_loops_with_one_name(tmp_path, command):
    """A loops.csv that names a loop twice is told with the loop and both rows."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nFIC1\nFIC2\nFIC1\n")
    line = one_line(asked(command, tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv"))
    assert "loop FIC1 in rows 2, 4" in line


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("content", "fragment"),
    [
        ("loop,gian_unit\nFIC1,percent\n", "did you mean 'gain_unit'"),
        ("loops\nFIC1\n", "'loop'"),
        ("tag,pv_lo\nFIC1,0\n", "no column 'loop'"),
        ("loop,kp\nFIC1,fast\n", "row 2, column 'kp': 'fast'"),
        ("loop,ti_unit\nFIC1,hours\n", "row 2, column 'ti_unit': 'hours'"),
        ("loop,pv_lo,pv_hi\nFIC1,100,0\n", "pv_hi above pv_lo"),
        ("loop\n", "no loops"),
        ("", "empty file"),
    ],
)
def test_misspelt_loops_csv(tmp_path, command, content, fragment):
    """A misspelt column, a number that is none, an unknown unit: each told with file, row, column and remedy."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text(content)
    line = one_line(asked(command, tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv"))
    assert fragment in line
    assert "loops.csv" in line


def test_no_loop_of_loops_csv_is_in_the_export(tmp_path):
    """With nothing but unknown loops the run does nothing and says which tag it looked for."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nTIC7\nTIC8\n")
    result = asked("run", tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv")
    assert "TIC7.PV" in told(result, 2)
    assert not (tmp_path / "store" / "nights").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_missing_loops_csv(tmp_path, command):
    """A loops.csv that does not exist is told with its path."""
    frame().to_parquet(tmp_path / "export.parquet")
    line = one_line(asked(command, tmp_path / "export.parquet", "--loops", tmp_path / "none.csv"))
    assert "none.csv" in line


def test_no_loops_in_the_export(tmp_path):
    """Columns that end in nothing known make no loop, and the line says how tags should end."""
    frame().rename(columns=lambda c: c.replace("FIC1.", "column ")).to_csv(
        tmp_path / "export.csv", index=False
    )
    assert "no loops in the export" in one_line(asked("run", tmp_path / "export.csv"))


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind this user")
@pytest.mark.parametrize("command", COMMANDS)
def test_no_permission_to_read(tmp_path, command):
    """An export that may not be read is told so."""
    frame().to_csv(tmp_path / "export.csv", index=False)
    (tmp_path / "export.csv").chmod(0)
    assert "cannot be opened" in one_line(asked(command, tmp_path / "export.csv"))


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind this user")
def test_no_permission_to_write(tmp_path):
    """A store that may not be written is told so."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "store").mkdir(mode=0o500)
    assert "check path and permissions" in told(asked("run", tmp_path / "export.parquet"), 2)


def test_store_that_is_a_file(tmp_path):
    """A store that is a file is told with its path."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "store").write_text("no store")
    assert "store" in told(asked("run", tmp_path / "export.parquet"), 2)


def test_span_outside_the_export(tmp_path):
    """--since after the last sample is told."""
    frame().to_parquet(tmp_path / "export.parquet")
    assert "no samples between --since and --until" in told(
        asked("run", tmp_path / "export.parquet", "--since", "2030-01-01"), 2
    )


# A loop that cannot be assessed: its reason, exit 2 where it is the only one, else 1


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda f: f.assign(**{"FIC1.PV": np.nan}), "needs PV samples, has none that is good"),
        (lambda f: f.iloc[:1], "needs 200 good PV samples, has 1"),
        (lambda f: f.iloc[:150], "needs 200 good PV samples, has 150"),
    ],
    ids=["all NaN", "one sample", "too short"],
)
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_loop_without_enough_samples(tmp_path, spoil, reason, ending):
    """All NaN, one sample, too few: one line with what is needed and what there is; nothing done, exit 2."""
    path = tmp_path / f"export.{ending}"
    spoiled = spoil(frame())
    spoiled.to_csv(path, index=False) if ending == "csv" else spoiled.to_parquet(path)
    result = asked("run", path)
    assert [line for line in told(result, 2).splitlines() if line.startswith("FIC1:")] == [f"FIC1: {reason}"]
    assert reason in told(asked("check", path), 1)


def test_missing_columns_of_a_loop(tmp_path):
    """A loop of loops.csv without PV is not assessed and named; one without SP and OP is, and it is said."""
    made = frame(("FIC1", "FIC2", "FIC3")).drop(columns=["FIC2.PV", "FIC3.SP", "FIC3.OP"])
    made.to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nFIC1\nFIC2\nFIC3\n")
    arguments = ("--loops", tmp_path / "loops.csv")
    said = told(asked("run", tmp_path / "export.parquet", *arguments), 0)
    assert "FIC2: no PV tag FIC2.PV in the export" in said
    assert "2 of 3 loops assessed" in said
    checked = told(asked("check", tmp_path / "export.parquet", *arguments), 1)
    third = next(line for line in checked.splitlines() if line.startswith("FIC3:"))
    assert "no SP recorded" in third
    assert "no OP recorded" in third


def test_unknown_loops_in_loops_csv(tmp_path):
    """Loops that the export does not have are named one a line; the others are assessed."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nFIC1\nTIC7\n")
    result = asked("run", tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv")
    assert "TIC7: no PV tag TIC7.PV in the export" in told(result, 0)
    assert "1 of 2 loops assessed" in result.stderr


def test_loops_that_only_the_export_has_are_said(tmp_path):
    """Loops of the export that loops.csv leaves out are counted and named, and cost no exit status."""
    frame(("FIC1", "FIC2")).to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nFIC1\n")
    result = asked("run", tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv")
    assert "1 loops of the export are not in loops.csv, not assessed: FIC2" in told(result, 0)


def test_text_among_numbers_costs_its_samples_alone(tmp_path):
    """Error texts of a historian among the numbers are bad samples, not the end of the loop."""
    made = frame().astype({"FIC1.PV": object})
    made.loc[100:119, "FIC1.PV"] = "I/O Timeout"
    made.to_csv(tmp_path / "export.csv", index=False)
    told(asked("run", tmp_path / "export.csv"), 0)
    assert "gap 3 % of the time" in told(asked("check", tmp_path / "export.csv"), 0)


# Odd, but fit for use: exit 0


@pytest.mark.parametrize("order", ["newest first", "shuffled", "an hour twice"])
def test_clock_running_backwards(tmp_path, order):
    """Stamps newest first, out of order, or set back are put in order, and check says so."""
    made = frame()
    if order == "an hour twice":
        made["timestamp"] -= pd.to_timedelta(np.where(np.arange(N) < 300, 0, 100), unit="s")
    else:
        made = made.iloc[::-1] if order == "newest first" else made.sample(frac=1, random_state=1)
    made.to_csv(tmp_path / "export.csv", index=False)
    told(asked("run", tmp_path / "export.csv"), 0)
    said = told(asked("check", tmp_path / "export.csv"), 0)
    expected = {
        "newest first": "newest first and are reversed",
        "shuffled": "samples were out of order",
        "an hour twice": "samples repeat a stamp",
    }
    assert expected[order] in said


@pytest.mark.parametrize("level", [0.0, 50.0])
def test_a_constant(tmp_path, level):
    """A loop that stands still is assessed or refused in words, without traceback and without a verdict."""
    made = frame()
    made[["FIC1.PV", "FIC1.OP"]] = level
    made.to_parquet(tmp_path / "export.parquet")
    result = asked("run", tmp_path / "export.parquet")
    told(result, 0)
    ranked = CliRunner().invoke(main, ["rank", str(tmp_path / "store"), "--format", "csv"]).stdout
    header, row = (line.split(",") for line in ranked.splitlines())
    found = dict(zip(header, row, strict=True))
    assert (found["status"], found["cause"], found["oscillation_significance"]) == ("ok", "none", "0.0")
    assert "nan" not in ranked.lower()


@pytest.mark.parametrize(
    "arguments", [[], ["run"], ["run", "x.csv"], ["rank"], ["dance"], ["rank", "s", "--top", "0"]]
)
def test_wrong_usage_is_told(arguments):
    """What cannot be parsed is told with a hint, not a traceback."""
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code in (0, 2)
    assert "Usage: " in result.output
    assert "Traceback" not in result.output
