"""Models, limits, stores and names that were made as an attack give one line each; nothing in them is executed or
computed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.commands.options import MOST_CHARACTERS, one_line
from analyzer.explain.models import checked
from analyzer.store.store import Store
from identification.errors import InputError
from proofs.plant import Sketch, simulate, write_export
from tests.analyzer.night.test_batch import stopped
from tests.reports.small_store import small_store

MODEL: dict[str, Any] = {
    "version": 1,
    "loop": "L0",
    "effects": [],
    "constants": {"K": 1.5, "T": 20.0, "L": 3.0},
    "middle_op_pct": 50.0,
    "level_pv_pct": 50.0,
    "late_s": 0.0,
    "scale": {"pv_low": 0.0, "pv_span": 100.0, "op_low": 0.0, "op_span": 100.0},
}


def run_command(*arguments: object) -> Result:
    """Result of a command line."""
    return CliRunner().invoke(main, [str(a) for a in arguments])


def refused(result: Result) -> str:
    """The one line on stderr of a refused command."""
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stderr.count("\n") == 1
    return result.stderr


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One loop of twelve minutes."""
    trends = simulate(Sketch("none", (1.0, 20.0, 3.0), 1.0, 20.0), 0.2)
    return write_export(tmp_path_factory.mktemp("hostile") / "x.parquet", {"L0": trends})


def test_a_valid_model_is_run(export: Path, tmp_path: Path) -> None:
    """The valid model, from which the others are derived, is simulated with a finite PV."""
    (tmp_path / "m.json").write_text(json.dumps(MODEL))
    out = tmp_path / "out.parquet"
    assert run_command("simulate", tmp_path / "m.json", export, "--loop", "L0", "--out", out).exit_code == 0
    assert pq.read_table(out).column("PV").null_count == 0


def test_a_stray_stamp_is_not_simulated(export: Path, tmp_path: Path) -> None:
    """A time stamp of 1601 among the others is removed before a model is run, and is not written into the output."""
    table = pq.read_table(export)
    first = table.slice(0, 1)
    stray = pa.array(["1601-01-05 00:00:00"]).cast(table.schema.field("timestamp").type)
    pq.write_table(
        pa.concat_tables([first.set_column(0, "timestamp", stray), table]), tmp_path / "stray.parquet"
    )
    (tmp_path / "m.json").write_text(json.dumps(MODEL))
    out = tmp_path / "out.parquet"
    given = ("simulate", tmp_path / "m.json", tmp_path / "stray.parquet", "--loop", "L0", "--out", out)
    assert run_command(*given).exit_code == 0
    assert pq.read_table(out).num_rows == table.num_rows


@pytest.mark.parametrize(
    "change",
    [
        {"scale": {**MODEL["scale"], "pv_span": 0.0}},
        {"scale": {**MODEL["scale"], "pv_span": -100.0}},
        {"scale": {**MODEL["scale"], "pv_low": float("nan")}},
        {"scale": {**MODEL["scale"], "op_span": True}},
        {"constants": {**MODEL["constants"], "K": 1e300}},
        {"constants": {**MODEL["constants"], "K": 10**400}},
        {"constants": {**MODEL["constants"], "CLIP_HI": -50.0, "CLIP_LO": 150.0}},
        {"constants": {**MODEL["constants"], "RATE": 0.0}},
        {"constants": {**MODEL["constants"], "T": "20"}},
        {"constants": []},
        {"version": 99},
        {"level_pv_pct": 1e300},
    ],
)
def test_a_model_with_impossible_values_is_refused(
    export: Path, tmp_path: Path, change: dict[str, Any]
) -> None:
    """Models with zero spans, huge gains, reversed limits or another version are refused, and no output is
    written.
    """
    (tmp_path / "m.json").write_text(json.dumps({**MODEL, **change}))
    out = tmp_path / "out.parquet"
    refused(run_command("simulate", tmp_path / "m.json", export, "--loop", "L0", "--out", out))
    assert not out.exists()


@pytest.mark.parametrize("text", ["[" * 100_000, '{"constants": {"K": NaN}}', "\x00", "{}", '"x"'])
def test_a_file_without_a_model_is_refused(export: Path, tmp_path: Path, text: str) -> None:
    """Deeply nested JSON and JSON of another content are reported in one line."""
    (tmp_path / "m.json").write_text(text)
    line = refused(
        run_command("simulate", tmp_path / "m.json", export, "--loop", "L0", "--out", tmp_path / "o")
    )
    assert "m.json" in line


def test_numbers_of_a_model_are_numbers() -> None:
    """A boolean in a model is refused as a number."""
    with pytest.raises(InputError, match="K is True"):
        checked({**MODEL, "constants": {"K": True}}, Path("m.json"))


@pytest.mark.parametrize(
    "text",
    [
        f"[oscillation]\nperiods = {'9' * 400}\n",
        f"[oscillation]\nperiods = {'9' * 5000}\n",
        "[oscillation]\nperiods = " + "[" * 10_000 + "]" * 10_000,
        "[oscillation]\nperiods = nan\n",
        '[oscillation]\n"a\\nb" = 1\n',
    ],
)
def test_limits_of_excessive_size_are_refused(export: Path, tmp_path: Path, text: str) -> None:
    """Too long numbers, deep nesting and names with a line break in --config give one line."""
    (tmp_path / "limits.toml").write_text(text)
    assert "limits.toml" in refused(run_command("check", export, "--config", tmp_path / "limits.toml"))


@pytest.mark.parametrize(
    "options",
    [
        ("--delimiter", ";;"),
        ("--delimiter", "\n"),
        ("--encoding", "hex"),
        ("--encoding", "rot13"),
        ("--date-format", "%"),
        ("--date-format", "%Q"),
        ("--date-format", "%Y%Y"),
        ("--timezone", "nowhere"),
    ],
)
def test_options_that_fit_no_file_are_refused(tmp_path: Path, options: tuple[str, str]) -> None:
    """Options that fit no text file are reported before a file is read."""
    (tmp_path / "x.csv").write_text("timestamp,L0.PV\n2026-03-02 00:00:00,1\n2026-03-02 00:00:01,2\n")
    assert repr(options[1]).strip("'") in refused(run_command("check", tmp_path / "x.csv", *options))


def test_a_damaged_piece_is_assessed_again(tmp_path: Path) -> None:
    """If a piece of a stopped run cannot be read, a resumed run assesses its loops again."""
    loops = {f"L{k:02d}": simulate(Sketch("none", (1.0, 20.0, 3.0), 1.0, 20.0), 0.5, k) for k in range(10)}
    path, store = write_export(tmp_path / "x.parquet", loops), tmp_path / "store"
    stopped(path, store, 1)
    (piece,) = store.glob("parts/*/nights-*.parquet")
    piece.write_bytes(b"")
    result = run_command("run", path, "--store", store, "--resume")
    assert result.exit_code == 0, result.output
    kept = Store(store)
    assert kept.read("nights", kept.require(), ["loop"]).num_rows == 10


def test_names_do_not_control_the_terminal(tmp_path: Path) -> None:
    """Escape sequences and bidirectional marks in a name or a reason are shown as escapes in each list."""
    store = small_store(tmp_path / "store", loops=3, nights=1)
    path = store.path / "nights" / f"{store.nights()[0]}.parquet"
    table = pq.read_table(path)
    names = pa.array(["A\x1b[2J", "B\u202eC", "D"])
    nasty = pa.array(["x\x1b]0;y\x07", "a\u2066b", "c"])
    table = table.set_column(table.column_names.index("loop"), "loop", names)
    pq.write_table(table.set_column(table.column_names.index("reason"), "reason", nasty), path)
    for form in ("table", "csv", "markdown"):
        text = run_command("rank", store.path, "--format", form).stdout
        assert all(c.isprintable() or c == "\n" for c in text), form
        assert r"A\x1b" in text.replace("\\\\", "\\"), form
        assert r"B\u202eC" in text.replace("\\\\", "\\"), form


def test_nan_and_infinity_are_unknown_values(tmp_path: Path) -> None:
    """NaN and infinity in a store are empty cells in tables and null in JSON."""
    store = small_store(tmp_path / "store", loops=3, nights=1)
    path = store.path / "nights" / f"{store.nights()[0]}.parquet"
    table = pq.read_table(path)
    place = table.column_names.index("kp")
    bad = pa.array([float("nan"), float("inf"), 1.0])
    pq.write_table(table.set_column(place, "kp", bad), path)
    rows = json.loads(run_command("rank", store.path, "--format", "json").stdout, parse_constant=pytest.fail)
    assert sorted(str(r["kp"]) for r in rows) == ["1.0", "None", "None"]


@pytest.mark.parametrize(
    "options",
    [
        ("--days", "1e300"),
        ("--days", "nan"),
        ("--before", "0001-01-01", "9999-01-01"),
        ("--after", "1971-01-01", "2098-01-01"),
    ],
)
def test_a_report_is_bounded(tmp_path: Path, options: tuple[str, ...]) -> None:
    """Spans of centuries are refused with exit status 2 and without a traceback."""
    store = small_store(tmp_path / "store", loops=3, nights=3)
    change = ("--loop", "FIC0000", "--changed", "2026-03-03 12:00")
    result = run_command("report", store.path, *change, *options, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert isinstance(result.exception, SystemExit)


def test_a_message_is_one_line() -> None:
    """A message is one line that fits a screen, independently of the text that it quotes."""
    text = one_line("a\nb\x1b[2J\u202e" + "x" * 100_000)
    assert text.isprintable()
    assert len(text) < MOST_CHARACTERS + 20


def test_a_group_with_a_missing_loop(tmp_path: Path) -> None:
    """A group with a loop that is missing from the night is listed without an error."""
    store = small_store(tmp_path / "store", loops=3, nights=1)
    night = store.nights()[0]
    row = {
        "loop": "GONE",
        "night": night,
        "group": "1",
        "role": "source",
        "source_pct": 90.0,
        "group_period_s": 60.0,
    }
    (store.path / "groups").mkdir(exist_ok=True)
    pq.write_table(pa.Table.from_pylist([row]), store.path / "groups" / f"{night}.parquet")
    for arguments in (("rank", store.path, "--groups"), ("pages", store.path, "--out", tmp_path / "out")):
        assert run_command(*arguments).exit_code == 0
