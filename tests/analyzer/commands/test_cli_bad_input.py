"""Bad input gives one clear line, no traceback, and the exit status of DESIGN.md."""

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
    """A wide export of loops without fault, one sample a second."""
    stamp = pd.to_datetime(START_S + np.arange(n), unit="s")
    columns: dict[str, object] = {"timestamp": stamp}
    for k, loop in enumerate(loops):
        pv = 50 + np.convolve(np.random.default_rng(k).standard_normal(n + 9), np.ones(10) / 10, mode="valid")
        columns |= {f"{loop}.SP": np.full(n, 50.0), f"{loop}.PV": pv, f"{loop}.OP": 50 - 0.5 * (pv - 50)}
    return pd.DataFrame(columns)


def run_command(command: str, export: Path, *arguments: str | Path) -> Result:
    """Result of `triage check` or `triage run`; the store is in the folder of the export."""
    store = ["--store", str(export.parent / "store")] if command == "run" else []
    return CliRunner().invoke(main, [command, str(export), *store, *map(str, arguments)])


def output_of(result: Result, status: int) -> str:
    """The complete output of a command that ended with the given exit status, without a traceback or another
    exception.
    """
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == status, result.output
    assert "Traceback" not in result.output
    return result.output


def one_line(result: Result) -> str:
    """The one line on stderr of a command that had nothing to process."""
    output_of(result, 2)
    assert re.fullmatch(r"(reading .*\n)?", result.stdout)
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert result.stderr.startswith("triage: ")
    return result.stderr


# Nothing can be done: exit 2


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", ["export.csv", "export.parquet"])
def test_empty_file(tmp_path, command, name):
    """An empty file is reported as empty, with its path."""
    (tmp_path / name).write_bytes(b"")
    line = one_line(run_command(command, tmp_path / name))
    assert "empty file" in line
    assert str(tmp_path / name) in line


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    "content", [b"timestamp,FIC1.PV\n2026-03-02,1\n", b"PAR1 cut short", os.urandom(3000)]
)
def test_no_parquet(tmp_path, command, content):
    """A file with a Parquet name that is not Parquet is reported as such."""
    (tmp_path / "export.parquet").write_bytes(content)
    assert "named as Parquet, but cannot be read as such" in one_line(
        run_command(command, tmp_path / "export.parquet")
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_parquet_cut_short(tmp_path, command):
    """A Parquet file without its end, as after a broken copy, is reported as unreadable."""
    frame().to_parquet(tmp_path / "export.parquet")
    data = (tmp_path / "export.parquet").read_bytes()
    (tmp_path / "export.parquet").write_bytes(data[: len(data) // 2])
    assert "cannot be read as such" in one_line(run_command(command, tmp_path / "export.parquet"))


@pytest.mark.parametrize("command", COMMANDS)
def test_no_such_file(tmp_path, command):
    """A path that does not exist is reported."""
    assert "no such file or folder" in one_line(run_command(command, tmp_path / "none.parquet"))


@pytest.mark.parametrize("command", COMMANDS)
def test_folder_without_exports(tmp_path, command):
    """A folder without exports is reported."""
    (tmp_path / "empty").mkdir()
    assert "a folder without exports" in one_line(run_command(command, tmp_path / "empty"))


@pytest.mark.parametrize("command", COMMANDS)
def test_missing_time_column(tmp_path, command):
    """An export without time stamps is reported with its columns."""
    frame().drop(columns="timestamp").to_csv(tmp_path / "export.csv", index=False)
    assert "no time column among FIC1.SP, FIC1.PV" in one_line(run_command(command, tmp_path / "export.csv"))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_column_that_occurs_twice(tmp_path, command):
    """Two columns with the same name are reported with that name."""
    text = frame().to_csv(index=False).replace("FIC1.OP", "FIC1.PV", 1)
    (tmp_path / "export.csv").write_text(text)
    assert "column 'FIC1.PV' occurs twice" in one_line(run_command(command, tmp_path / "export.csv"))


@pytest.mark.parametrize("command", COMMANDS)
def test_two_loops_with_one_name(tmp_path, command):
    """A loops.csv with a loop in two rows is reported with the loop and both rows."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nFIC1\nFIC2\nFIC1\n")
    line = one_line(run_command(command, tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv"))
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
    """A misspelt column, an invalid number and an unknown unit are each reported with the file and the expected
    value.
    """
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text(content)
    line = one_line(run_command(command, tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv"))
    assert fragment in line
    assert "loops.csv" in line


def test_no_loop_of_loops_csv_is_in_the_export(tmp_path):
    """If no loop of loops.csv is in the export, the run writes no night and names the tags that it searched for."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nTIC7\nTIC8\n")
    result = run_command("run", tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv")
    assert "TIC7.PV" in output_of(result, 2)
    assert not (tmp_path / "store" / "nights").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_missing_loops_csv(tmp_path, command):
    """A loops.csv that does not exist is reported with its path."""
    frame().to_parquet(tmp_path / "export.parquet")
    line = one_line(run_command(command, tmp_path / "export.parquet", "--loops", tmp_path / "none.csv"))
    assert "none.csv" in line


def test_no_loops_in_the_export(tmp_path):
    """An export without known tag endings has no loops, and one line says so."""
    frame().rename(columns=lambda c: c.replace("FIC1.", "column ")).to_csv(
        tmp_path / "export.csv", index=False
    )
    assert "no loops in the export" in one_line(run_command("run", tmp_path / "export.csv"))


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind this user")
@pytest.mark.parametrize("command", COMMANDS)
def test_no_permission_to_read(tmp_path, command):
    """An export without read permission is reported."""
    frame().to_csv(tmp_path / "export.csv", index=False)
    (tmp_path / "export.csv").chmod(0)
    assert "cannot be opened" in one_line(run_command(command, tmp_path / "export.csv"))


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind this user")
def test_no_permission_to_write(tmp_path):
    """A store without write permission is reported."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "store").mkdir(mode=0o500)
    assert "check path and permissions" in output_of(run_command("run", tmp_path / "export.parquet"), 2)


def test_store_that_is_a_file(tmp_path):
    """A store that is a file is reported with its path."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "store").write_text("no store")
    assert "store" in output_of(run_command("run", tmp_path / "export.parquet"), 2)


def test_span_outside_the_export(tmp_path):
    """A --since after the last sample is reported."""
    frame().to_parquet(tmp_path / "export.parquet")
    assert "no samples between --since and --until" in output_of(
        run_command("run", tmp_path / "export.parquet", "--since", "2030-01-01"), 2
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
    """All NaN, one sample or too few samples give one line with the need and the present count; nothing is assessed,
    exit 2.
    """
    path = tmp_path / f"export.{ending}"
    spoiled = spoil(frame())
    spoiled.to_csv(path, index=False) if ending == "csv" else spoiled.to_parquet(path)
    result = run_command("run", path)
    assert [line for line in output_of(result, 2).splitlines() if line.startswith("FIC1:")] == [
        f"FIC1: {reason}"
    ]
    assert reason in output_of(run_command("check", path), 1)


def test_missing_columns_of_a_loop(tmp_path):
    """A loop of loops.csv without PV is not assessed and is named; a loop without SP and OP is assessed, with a
    note.
    """
    made = frame(("FIC1", "FIC2", "FIC3")).drop(columns=["FIC2.PV", "FIC3.SP", "FIC3.OP"])
    made.to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nFIC1\nFIC2\nFIC3\n")
    arguments = ("--loops", tmp_path / "loops.csv")
    output = output_of(run_command("run", tmp_path / "export.parquet", *arguments), 0)
    assert "FIC2: no PV tag FIC2.PV in the export" in output
    assert "2 of 3 loops assessed" in output
    checked = output_of(run_command("check", tmp_path / "export.parquet", *arguments), 1)
    third = next(line for line in checked.splitlines() if line.startswith("FIC3:"))
    assert "no SP recorded" in third
    assert "no OP recorded" in third


def test_unknown_loops_in_loops_csv(tmp_path):
    """Loops that are missing from the export are named, one in each line; the others are assessed."""
    frame().to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nFIC1\nTIC7\n")
    result = run_command("run", tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv")
    assert "TIC7: no PV tag TIC7.PV in the export" in output_of(result, 0)
    assert "1 of 2 loops assessed" in result.stderr


def test_loops_that_only_the_export_has_are_reported(tmp_path):
    """Loops of the export that are missing from loops.csv are counted and named, and the exit status stays 0."""
    frame(("FIC1", "FIC2")).to_parquet(tmp_path / "export.parquet")
    (tmp_path / "loops.csv").write_text("loop\nFIC1\n")
    result = run_command("run", tmp_path / "export.parquet", "--loops", tmp_path / "loops.csv")
    assert "1 loops of the export are not in loops.csv, not assessed: FIC2" in output_of(result, 0)


def test_text_among_numbers_invalidates_its_own_samples_only(tmp_path):
    """Error texts of a historian among the numbers are bad samples; the loop is still assessed."""
    made = frame().astype({"FIC1.PV": object})
    made.loc[100:119, "FIC1.PV"] = "I/O Timeout"
    made.to_csv(tmp_path / "export.csv", index=False)
    output_of(run_command("run", tmp_path / "export.csv"), 0)
    assert "gap 3 % of the time" in output_of(run_command("check", tmp_path / "export.csv"), 0)


# Odd, but fit for use: exit 0


@pytest.mark.parametrize("order", ["newest first", "shuffled", "an hour twice"])
def test_clock_running_backwards(tmp_path, order):
    """Time stamps in reverse order, out of order, or set back are sorted, and `check` reports it."""
    made = frame()
    if order == "an hour twice":
        made["timestamp"] -= pd.to_timedelta(np.where(np.arange(N) < 300, 0, 100), unit="s")
    else:
        made = made.iloc[::-1] if order == "newest first" else made.sample(frac=1, random_state=1)
    made.to_csv(tmp_path / "export.csv", index=False)
    output_of(run_command("run", tmp_path / "export.csv"), 0)
    output = output_of(run_command("check", tmp_path / "export.csv"), 0)
    expected = {
        "newest first": "newest first and are reversed",
        "shuffled": "samples were out of order",
        "an hour twice": "samples repeat a stamp",
    }
    assert expected[order] in output


@pytest.mark.parametrize("level", [0.0, 50.0])
def test_a_constant(tmp_path, level):
    """A loop with constant PV and OP is assessed without traceback and without a cause."""
    made = frame()
    made[["FIC1.PV", "FIC1.OP"]] = level
    made.to_parquet(tmp_path / "export.parquet")
    result = run_command("run", tmp_path / "export.parquet")
    output_of(result, 0)
    ranked = CliRunner().invoke(main, ["rank", str(tmp_path / "store"), "--format", "csv"]).stdout
    header, row = (line.split(",") for line in ranked.splitlines())
    found = dict(zip(header, row, strict=True))
    assert (found["status"], found["cause"], found["oscillation_significance"]) == ("ok", "none", "0.0")
    assert "nan" not in ranked.lower()


@pytest.mark.parametrize(
    "arguments", [[], ["run"], ["run", "x.csv"], ["rank"], ["dance"], ["rank", "s", "--top", "0"]]
)
def test_wrong_usage_is_reported(arguments):
    """A command line with wrong usage gives the usage text and no traceback."""
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code in (0, 2)
    assert "Usage: " in result.output
    assert "Traceback" not in result.output
