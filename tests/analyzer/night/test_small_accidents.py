"""Small accidents of a command line: forged lines, misspelt names, poor terminals, what a kill leaves."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from analyzer.cli import main
from analyzer.commands.options import what_went_wrong
from analyzer.night import workers
from tests.reports.small_store import small_store


def test_a_tag_forges_no_line(tmp_path: Path) -> None:
    """A tag that holds a line break adds no line to what check says."""
    start = 1_772_409_600_000_000
    stamps = pa.array([start + 1_000_000 * k for k in range(300)], pa.timestamp("us"))
    values = pa.array([50.0 + k % 7 for k in range(300)])
    forged = "X\nFIC9: PV FIC9.PV; fit for all questions"
    pq.write_table(pa.table({"timestamp": stamps, f"{forged}.PV": values}), tmp_path / "x.parquet")
    told = CliRunner().invoke(main, ["check", str(tmp_path / "x.parquet")])
    assert "FIC9" in told.output
    assert not [line for line in told.output.splitlines() if line.startswith("FIC9")]


def test_a_misspelt_column_gets_those_near_it() -> None:
    """--by with a name that is nearly a column's names that column, and not forty."""
    told = CliRunner().invoke(main, ["rank", "nowhere", "--by", "perod_s"])
    assert told.exit_code == 2
    assert "one such as period_s" in told.stderr
    assert len(told.stderr) < 200


@pytest.mark.parametrize(
    ("name", "meant"), [("Helsinki", "Europe/Helsinki"), ("new york", "America/New_York")]
)
def test_a_town_gets_its_zone(name: str, meant: str) -> None:
    """A time zone that is a town's name alone gets the whole name."""
    told = CliRunner().invoke(main, ["check", "x.csv", "--timezone", name])
    assert told.exit_code == 2
    assert f"an IANA name such as {meant}" in told.stderr


def test_a_terminal_without_a_character_is_no_error(tmp_path: Path) -> None:
    """What a code page cannot show is shown by its number, and the command ends as it should."""
    kept = small_store(tmp_path / "store", loops=6, nights=1)
    loop = kept.read("nights", kept.nights()[-1], ["loop"]).column(0)[0].as_py()
    asked = [sys.executable, "-m", "analyzer.cli", "note", str(kept.path), loop, "slips \u03a9 \u2192 seat"]
    env = {**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"}
    done = subprocess.run(asked, env=env, capture_output=True, check=False, cwd=Path(__file__).parents[3])
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"\u03a9" in done.stdout


@pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="no such sockets")
def test_folders_of_dead_servers_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder of a server that was killed is removed; that of one that listens, and of anything else, stays."""
    monkeypatch.setattr(workers, "NEW_S", -1.0)
    monkeypatch.setattr(workers.forkserver._forkserver, "_forkserver_pid", None)
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    for name in ("pymp-dead", "pymp-alive", "pymp-other"):
        Path(name).mkdir()
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind("pymp-dead/listener-x")
    Path("pymp-other/file").touch()
    with socket.socket(socket.AF_UNIX) as alive:
        alive.bind("pymp-alive/listener-x")
        alive.listen()
        alive.settimeout(0.0)
        workers._forget_dead_servers(Path())
        with pytest.raises(BlockingIOError):  # nobody has asked it anything, which would end it
            alive.accept()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["pymp-alive", "pymp-other"]


@pytest.mark.parametrize(
    "error", [PermissionError("The provided token has expired."), OSError(16, "Slow down")]
)
def test_what_storage_refuses_speaks_of_credentials(error: OSError) -> None:
    """What a storage's library raises without a file's name is told with what to look at there."""
    told = what_went_wrong(error)
    assert told is not None
    assert "credentials" in told
    assert "try again" in told
