"""The page on operations agrees with what the program does."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from analyzer.commands.run import RunLog
from analyzer.store.store import Store
from proofs.plant import Sketch, simulate, write_export

ROOT = Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "docs" / "deploy"
EVENT = re.compile(r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ triage\[\d+\] [a-z ]+( [a-z]+=.*)?$")


@pytest.fixture
def plant(tmp_path: Path) -> Path:
    """A plant's folder with loops.csv and two exports; the newer export has two loops of one hour."""
    folder = tmp_path / "mill"
    (folder / "exports").mkdir(parents=True)
    (folder / "exports" / "old.csv").write_text("no export at all")
    os.utime(folder / "exports" / "old.csv", (1.0, 1.0))
    sketch = Sketch("none", (1.0, 20.0, 3.0), 1.0, 20.0)
    write_export(folder / "exports" / "new.parquet", {f"FIC{k}": simulate(sketch, 1.0, k) for k in (1, 2)})
    rows = "".join(f"FIC{k},0,100,1.0,20.0\n" for k in (1, 2, 3))
    (folder / "loops.csv").write_text("loop,pv_lo,pv_hi,kp,ti\n" + rows)
    return folder


@pytest.mark.skipif(shutil.which("sh") is None, reason="no shell")
def test_the_night_script_stores_a_night(plant: Path) -> None:
    """The script for cron and systemd reads the newest export, stores the night, and writes the pages and the
    log."""
    triage = f"{sys.executable} -m analyzer.cli"
    environment = {**os.environ, "TRIAGE": triage, "PYTHONPATH": str(ROOT), "ZONE": "Europe/Helsinki"}
    script = ["sh", str(DEPLOY / "night.sh"), str(plant)]
    done = subprocess.run(script, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert len(Store(plant / "store").nights()) == 1
    assert (plant / "pages" / "index.html").exists()
    log = (plant / "triage.log").read_text(encoding="utf-8").splitlines()
    assert [line.split()[2] for line in log if " note " not in line] == ["begin", "lost", "assessed", "end"]
    assert all(EVENT.match(line) for line in log)
    assert "loop=FIC3" in next(line for line in log if " lost " in line)


def test_a_night_that_cannot_begin_is_logged(plant: Path) -> None:
    """Without a usable export the script ends with 2, and the log states the reason."""
    (plant / "exports" / "new.parquet").unlink()
    environment = {**os.environ, "TRIAGE": f"{sys.executable} -m analyzer.cli", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(["sh", str(DEPLOY / "night.sh"), str(plant)], env=environment, check=False)
    assert done.returncode == 2
    last = (plant / "triage.log").read_text(encoding="utf-8").splitlines()[-1]
    assert " nothing done error=" in last
    assert "old.csv" in last


def test_a_log_event_is_one_line_of_words(tmp_path: Path) -> None:
    """An event with any reason is one line of printable characters, and the shell's quoting rules split the
    line into its words again."""
    log = RunLog(tmp_path / "logs" / "x.log")
    log.write("lost", loop="FIC 1", reason='a "quoted"\nline\x1b[2J \u202e back\\slash', share=0.5)
    (line,) = (tmp_path / "logs" / "x.log").read_text(encoding="utf-8").splitlines()
    assert line.isprintable()
    words = shlex.split(line)
    assert words[2:] == [
        "lost",
        "loop=FIC 1",
        'reason=a "quoted" line\\x1b[2J \\u202e back\\slash',
        "share=0.5",
    ]


def test_a_log_that_cannot_be_written_does_not_stop_the_night(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """If the log's folder is a file, the program reports this once and continues to work."""
    (tmp_path / "file").write_text("")
    log = RunLog(tmp_path / "file" / "x.log")
    log.write("begin")
    log.write("end")
    assert capsys.readouterr().err.count("no log is kept") == 1


def test_the_page_names_existing_files_and_options() -> None:
    """The files that the page links exist, and the program has the options that the page and the script use."""
    page = (ROOT / "docs" / "operations.md").read_text(encoding="utf-8")
    for target in re.findall(r"\]\((deploy[^)]*)\)", page):
        assert (ROOT / "docs" / target).exists(), target
    for command in ("run", "pages", "store prune", "store check"):
        printed = subprocess.run(
            [sys.executable, "-m", "analyzer.cli", *command.split(), "--help"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        used = re.findall(rf"(?:triage|TRIAGE) {command} (.*)", page + (DEPLOY / "night.sh").read_text())
        for option in re.findall(r"--[a-z-]+", " ".join(used)):
            assert option in printed, (command, option)
