"""Each command that reads an export handles damaged and malicious files within two gigabytes: one line, within
seconds.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.analyzer.commands.hostile_files import KINDS, written

ROOT = Path(__file__).parents[3]
SCRIPT = """
import json, resource, sys, time
if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_DATA, (2 << 30, 2 << 30))
    from click.testing import CliRunner
    from analyzer.cli import main
    command, *paths = sys.argv[1:]
    for path in paths:
        more = {"check": [], "run": ["--store", path + ".store"]}.get(command, ["--loop", "FIC1"])
        begun = time.monotonic()
        done = CliRunner().invoke(main, [command, path, *more])
        strange = done.exception if not isinstance(done.exception, SystemExit) else None
        said = {"status": done.exit_code, "err": done.stderr, "out": done.stdout, "error": repr(strange)}
        print(json.dumps({"path": path, "s": time.monotonic() - begun, **said}), flush=True)
"""
FEWEST = 60
MOST_S = 10.0
MARKS = ("Traceback", "panicked", "RUST_BACKTRACE", "terminate called", "an error of the program")
"""Output that shows an unhandled error of a program, in any language."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """One file of each kind, and paths that are not files."""
    return [str(path) for path in written(tmp_path_factory.mktemp("hostile"))]


def results_of(command: str, paths: list[str]) -> tuple[list[dict[str, Any]], str]:
    """The result of a command for each file, and the text that reached the terminal outside Python."""
    arguments = [
        sys.executable,
        "-c",
        SCRIPT,
        command,
        paths[0],
        *paths,
    ]  # the first waits for the server of workers
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, check=False)
    return [json.loads(line) for line in done.stdout.splitlines()][1:], done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux alone")
@pytest.mark.parametrize(
    "command",
    ["run", *(pytest.param(c, marks=pytest.mark.slow) for c in ("check", "tune", "explain", "test-plan"))],
)
def test_no_file_causes_a_crash(files: list[str], command: str) -> None:
    """For each of more than sixty kinds, the exit status is 1 or 2, with at most one error line, within ten
    seconds.
    """
    assert len(KINDS) > FEWEST
    answers, leaked = results_of(command, files)
    assert leaked == ""
    assert len(answers) == len(files)
    for a in answers:
        name = Path(a["path"]).name
        assert a["status"] in (1, 2), (name, a)
        assert a["error"] == "None", (name, a)
        assert not any(mark in a["err"] + a["out"] for mark in MARKS), (name, a)
        errors = [line for line in a["err"].splitlines() if line.startswith("triage: ")]
        assert len(errors) <= 1 or command == "run", (name, a)
        assert a["status"] == 1 or errors, (name, a)
        assert a["s"] < MOST_S, (name, a["s"])
