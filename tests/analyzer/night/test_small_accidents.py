"""Small errors of a command line: line breaks in tags, misspelt names, limited terminals, remains of a killed
process.
"""

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


def test_a_tag_adds_no_line(tmp_path: Path) -> None:
    """A tag with a line break adds no line to the output of `check`."""
    start = 1_772_409_600_000_000
    stamps = pa.array([start + 1_000_000 * k for k in range(300)], pa.timestamp("us"))
    values = pa.array([50.0 + k % 7 for k in range(300)])
    forged = "X\nFIC9: PV FIC9.PV; fit for all questions"
    pq.write_table(pa.table({"timestamp": stamps, f"{forged}.PV": values}), tmp_path / "x.parquet")
    result = CliRunner().invoke(main, ["check", str(tmp_path / "x.parquet")])
    assert "FIC9" in result.output
    assert not [line for line in result.output.splitlines() if line.startswith("FIC9")]


def test_a_misspelt_column_gives_the_nearest_one() -> None:
    """--by with a misspelt column gives the nearest column, and not all forty."""
    result = CliRunner().invoke(main, ["rank", "nowhere", "--by", "perod_s"])
    assert result.exit_code == 2
    assert "one such as period_s" in result.stderr
    assert len(result.stderr) < 200


@pytest.mark.parametrize(
    ("name", "meant"), [("Helsinki", "Europe/Helsinki"), ("new york", "America/New_York")]
)
def test_a_town_gives_its_time_zone(name: str, meant: str) -> None:
    """A time zone given as a town gets its full name."""
    result = CliRunner().invoke(main, ["check", "x.csv", "--timezone", name])
    assert result.exit_code == 2
    assert f"an IANA name such as {meant}" in result.stderr


def test_a_terminal_without_a_character_is_no_error(tmp_path: Path) -> None:
    """A character that a code page cannot show is shown by its number, and the command ends without error."""
    kept = small_store(tmp_path / "store", loops=6, nights=1)
    loop = kept.read("nights", kept.nights()[-1], ["loop"]).column(0)[0].as_py()
    arguments = [
        sys.executable,
        "-m",
        "analyzer.cli",
        "note",
        str(kept.path),
        loop,
        "slips \u03a9 \u2192 seat",
    ]
    env = {**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"}
    done = subprocess.run(arguments, env=env, capture_output=True, check=False, cwd=Path(__file__).parents[3])
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"\u03a9" in done.stdout


@pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="no such sockets")
def test_folders_of_dead_servers_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder of a killed server is removed; the folder of a listening server, and other folders, are kept."""
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
        with pytest.raises(BlockingIOError):  # no connection was made, which would end the server
            alive.accept()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["pymp-alive", "pymp-other"]


@pytest.mark.parametrize(
    "error", [PermissionError("The provided token has expired."), OSError(16, "Slow down")]
)
def test_an_error_of_storage_mentions_credentials(error: OSError) -> None:
    """An error of a storage library without a file name is reported with what to check."""
    result = what_went_wrong(error)
    assert result is not None
    assert "credentials" in result
    assert "try again" in result
