"""Limits come from one table, a file changes them, and each error in the file is reported in one line."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields, replace
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.config import Config, configured, limit_of, limits_document, read_config
from analyzer.explain.case import requested_cases, whole
from analyzer.loops.changes import TuningChange
from analyzer.night.opened import guarded
from analyzer.night.request import ExportRequest
from analyzer.store.store import Store
from proofs.plant import START_S, Sketch, simulate, write_export
from tests.reports.small_store import small_store

TANK = Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5)
"""A tank on a valve with backlash."""
READERS = ("run", "check", "tune", "explain", "simulate")
"""Commands that read an EXPORT (contract)."""
CASES = [
    ("[oscilation]\nperiods = 4", ["section [oscilation]", "oscillation"]),
    ("[oscillation]\nperiodes = 4", ["[oscillation] periodes", "periods"]),
    ("[oscillation]\nperiods = 'four'", ["periods is 'four'", "a number from 1 to 100"]),
    ("[oscillation]\nperiods = true", ["periods is True", "a number from 1 to 100"]),
    ("[oscillation]\nperiods = nan", ["periods is nan", "a number from 1 to 100"]),
    ("[oscillation]\nperiods = 0", ["periods is 0", "a number from 1 to 100"]),
    ("[quality]\nsamples = 200.5", ["samples is 200.5", "a whole number from 20"]),
    ("[quality]\nstale_s = -1.0", ["stale_s is -1.0", "[s]"]),
    ("[tuning]\nms_most = [2.0]", ["ms_most is [2.0]", "a number from 1.1 to 10"]),
    ("[cause]\nfast_process = [['flow', 60.0]]", ["fast_process has ['flow', 60.0]", '["flow", 60.0, 30.0]']),
    ("[cause]\nfast_process = [['flow', -1.0, 3.0]]", ["fast_process has ['flow', -1.0, 3.0]"]),
    ("cause = 3", ["cause is 3", "a section [cause]"]),
    ("[cause", ["TOML"]),
]


def run_command(*arguments: str | Path) -> Result:
    """Result of a command."""
    return CliRunner().invoke(main, [*map(str, arguments)])


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three hours of two tanks that oscillate."""
    folder = tmp_path_factory.mktemp("config")
    trends = {name: simulate(TANK, 3.0, seed) for seed, name in enumerate(("LIC1", "LIC2"), 1)}
    return write_export(folder / "export.parquet", trends)


def test_the_printed_defaults_are_the_defaults():
    """`triage config` prints TOML that gives the default limits again when it is read; each number has a comment."""
    printed = run_command("config").stdout
    stated = tomllib.loads(printed)
    assert configured(stated, "printed") == Config()
    names = {name for section in stated.values() for name in section}
    for name in names:
        assert re.search(rf"\n# .*\n{name} = ", printed), name
    assert max(map(len, printed.splitlines())) <= 118


def test_every_limit_has_unit_range_meaning_and_source():
    """Each limit has a unit, a meaning and a source, and each default lies in its range."""
    for table in (getattr(Config(), section.name) for section in fields(Config)):
        for field in fields(table):
            limit, value = limit_of(field), getattr(table, field.name)
            assert all((limit.unit, limit.meaning, limit.source)), field.name
            numbers = [value] if isinstance(value, int | float) else [x for row in value for x in row[1:]]
            assert all(limit.least <= x <= limit.most for x in numbers), field.name


def test_sections_are_printed_with_the_description_of_their_class():
    """The comment above the heading of a section is the description of its class."""
    printed = limits_document(Config())
    descriptions = re.findall(r"^# (.*)\n\[(\w+)\]$", printed, re.MULTILINE)
    assert len({words for words, _ in descriptions}) == len(descriptions) == len(fields(Config))
    assert (
        "Limits of time and memory for opening an export, above which it is given up.",
        "opening",
    ) in descriptions


def test_a_file_changes_what_it_states_and_nothing_else(tmp_path: Path):
    """A file with two limits changes only these two; whole numbers are accepted as numbers."""
    file = tmp_path / "limits.toml"
    file.write_text("[oscillation]\nperiods = 4\n[tuning]\nms_most = 1.8\n")
    found, default = read_config(file), Config()
    wanted = replace(
        default,
        oscillation=replace(default.oscillation, periods=4.0),
        tuning=replace(default.tuning, ms_most=1.8),
    )
    assert found == wanted
    assert limits_document(found).count("periods = 4.0") == 1


def test_a_byte_order_mark_changes_nothing(tmp_path: Path):
    """A file with a byte order mark, as Notepad saves it, gives the same limits as without the mark."""
    text = "[oscillation]\nperiods = 3.5\n"
    plain, marked = tmp_path / "plain.toml", tmp_path / "marked.toml"
    plain.write_text(text, encoding="utf-8")
    marked.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert read_config(marked) == read_config(plain) != Config()


@pytest.mark.parametrize(("text", "fragments"), CASES)
def test_what_is_wrong_in_a_file_is_one_line(text, fragments, tmp_path: Path, export: Path):
    """Unknown names, wrong types and values out of range give one line with value, expectation and remedy; exit
    status 2.
    """
    file = tmp_path / "limits.toml"
    file.write_text(text)
    result = run_command("check", export, "--config", file)
    assert (result.exit_code, result.stdout) == (2, "")
    assert len(result.stderr.splitlines()) == 1
    assert "triage config" in result.stderr
    assert all(fragment in result.stderr for fragment in (*fragments, "limits.toml", "expected")), (
        result.stderr
    )


def test_a_missing_file_is_one_line(tmp_path: Path, export: Path):
    """A missing file of limits is named in one line, exit status 2."""
    result = run_command("check", export, "--config", tmp_path / "none.toml")
    assert result.exit_code == 2
    assert "none.toml" in result.stderr
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize("name", READERS)
def test_commands_that_read_an_export_take_the_same_options(name):
    """Each command that reads an export has the options for loops, changes, span, time zone and limits (contract)."""
    options = {option for p in main.commands[name].params for option in p.opts}
    assert {"--loops", "--changes", "--since", "--until", "--timezone", "--config"} <= options


@pytest.mark.slow
def test_the_limits_reach_every_part_of_a_run(tmp_path: Path, export: Path):
    """Limits of each part change the result of that part for one export: quality, figures, oscillation, cause,
    advice.
    """
    plain = night(tmp_path, export, "")
    assert (plain["cause"], plain["status"]) == ("valve", "ok")
    assert night(tmp_path, export, "[quality]\nsamples = 100000")["status"] == "not assessed"
    assert night(tmp_path, export, "[oscillation]\nperiods = 100.0")["oscillating_pct"] == 0.0
    assert night(tmp_path, export, "[cause]\nevidence = 1e6")["cause"] != "valve"
    wide = night(tmp_path, export, "[figures]\ntravel_deadband_pct = 3.0")
    assert wide["valve_travel_pct_per_h"] < plain["valve_travel_pct_per_h"]
    assert night(tmp_path, export, "[advice]\nleast_h = 4.0")["osc_valve_pct"] == 75.0


def night(folder: Path, export: Path, text: str) -> dict[str, object]:
    """The row of the first tank under the given limits."""
    file, store = folder / "limits.toml", folder / "store"
    file.write_text(text)
    run_command("run", export, "--store", store, "--config", file, "--replace")
    row: dict[str, object] = Store(store).read("nights", Store(store).require()).to_pylist()[0]
    return row


def test_tune_takes_its_limits(tmp_path: Path, export: Path):
    """With a backlash limit below the valve's backlash, `tune` reports it as beyond tuning; by default it does
    not.
    """
    loops = tmp_path / "loops.csv"
    loops.write_text("loop,type,pv_lo,pv_hi,kp,ti\nLIC1,level,0,100,0.9,40\n")
    file = tmp_path / "limits.toml"
    file.write_text("[tuning]\nband_beyond = 0.5\n")
    command = ("tune", export, "--loops", loops, "--loop", "LIC1")
    assert "cannot compensate" not in run_command(*command).stdout
    assert "cannot compensate" in run_command(*command, "--config", file).stdout


def test_report_takes_its_limits(tmp_path: Path):
    """The report states the limits that it was made with in its sentence on spans that are not compared."""
    store, file = small_store(tmp_path / "store", loops=8), tmp_path / "limits.toml"
    file.write_text("[before_after]\nload_pct = 7.5\n")
    change = ("--loop", "ТИК-1", "--changed", "2026-03-09T00:00Z", "--format", "markdown")
    for name, more in (("plain", ()), ("own", ("--config", file))):
        assert run_command("report", store.path, *change, *more, "--out", tmp_path / name).exit_code == 0
    plain, own = ((tmp_path / name / "before-after.md").read_text() for name in ("plain", "own"))
    assert "mean OP by over 10 %" in plain
    assert "mean OP by over 7.5 %" in own


def test_explain_and_simulate_work_on_the_span_with_its_settings(export: Path):
    """For the second hour, both commands use only that hour, with the settings that were in force then."""
    hour = START_S + 3600.0, START_S + 7200.0
    changes = (
        TuningChange("LIC1", START_S + 60.0, kp_new=3.0),
        TuningChange("LIC1", START_S + 9000.0, kp_new=9.0),
    )
    loops = export.with_name("loops.csv")
    loops.write_text("loop,type,pv_lo,pv_hi,kp,ti\nLIC1,level,0,100,0.9,40\n")
    request = ExportRequest((export,), loops, changes, hour, Config(), "UTC", {})
    case, pv = whole(request, "LIC1")
    explained, held_out = requested_cases(request, guarded(request), "LIC1", ())
    assert not held_out
    assert explained.spec == case.spec
    assert (pv.stamp_s[0], pv.stamp_s[-1]) == (hour[0], hour[1] - 1.0)
    assert (case.spec.kp, case.spec.ti) == (3.0, 40.0)


def test_check_and_tune_take_a_span_of_time(export: Path):
    """For one hour of an export, `check` uses the samples of that hour; for a span without samples, `tune` reports it
    in one line.
    """
    span = ("--since", "2026-03-02T00:00:00", "--until", "2026-03-02T01:00:00")
    assert run_command("check", export, *span).stdout.count("3600 samples every 1 s") == 2
    nothing = run_command("tune", export, "--loop", "LIC1", "--since", "2026-03-05")
    assert nothing.exit_code == 2
    assert "no samples between --since and --until" in nothing.stderr
    turned = run_command("check", export, "--since", "2026-03-05", "--until", "2026-03-04")
    assert turned.exit_code == 2
    assert "swap them" in turned.stderr
