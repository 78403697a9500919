"""The shipped systemd unit runs a night in a tree where only the paths that the unit names are writable."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from test_operations import DEPLOY, ROOT, plant  # noqa: F401

from analyzer.cli import main
from analyzer.store.store import Store

UNIT = (DEPLOY / "triage.service").read_text(encoding="utf-8")
TRIAGE = f"{sys.executable} -m analyzer.cli"
READ_ONLY = r"""
set -e
mount --make-rprivate /
for folder in $WRITABLE; do mount --bind "$folder" "$folder"; done
while read -r _ at kind _; do
    case "$kind" in ext*|xfs|btrfs|overlay|fuse*|9p|virtiofs|tmpfs) ;; *) continue ;; esac
    case " $WRITABLE /dev/shm " in *" $at "*) continue ;; esac
    mount -o remount,bind,ro "$at" 2>/dev/null || true
done </proc/mounts
! touch "$TREE/written" 2>/dev/null || { echo "still writable"; exit 99; }
exec "$@"
"""
"""The effect of ProtectSystem=strict without systemd: all mounts except some folders become read-only, then a
command runs."""


def can_mount() -> bool:
    """Whether this user may create private mounts."""
    command_line = ["unshare", "-m", "sh", "-c", "mount --make-rprivate / && mount --bind /usr /usr"]
    return (
        shutil.which("unshare") is not None
        and not subprocess.run(command_line, capture_output=True).returncode
    )


mounts = pytest.mark.skipif(not can_mount(), reason="needs mounts of its own (root on Linux)")


def stated(key: str) -> list[str]:
    """The values of a key of the unit."""
    return [value for line in re.findall(rf"^{key}=(.*)$", UNIT, re.MULTILINE) for value in line.split()]


def in_read_only_tree(
    writable: list[Path], command: list[str], **more: str
) -> subprocess.CompletedProcess[str]:
    """Run a command while the installation, HOME and all folders except the writable ones are read-only."""
    removed = {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "CACHE_DIRECTORY", "TMPDIR"}
    env = {k: v for k, v in os.environ.items() if k not in removed}
    env |= {"WRITABLE": " ".join(map(str, writable)), "TREE": str(ROOT), "HOME": "/nonexistent"}
    env |= {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1", **more}
    command_line = ["unshare", "-m", "sh", "-c", READ_ONLY, "sh", *command]
    return subprocess.run(command_line, env=env, cwd="/", capture_output=True, text=True, check=False)


@mounts
def test_the_unit_stores_a_night(plant: Path, tmp_path: Path) -> None:  # noqa: F811
    """The unit's command, with its environment, cache and writable paths, stores the night and ends with 0."""
    private, cache = tmp_path / "private", tmp_path / "cache"
    private.mkdir()
    cache.mkdir()
    more = dict(text.split("=", 1) for text in stated("Environment")) | {
        "TRIAGE": TRIAGE,
        "TMPDIR": str(private),
    }
    if stated("CacheDirectory"):
        more["CACHE_DIRECTORY"] = str(cache)
    assert stated("ReadWritePaths") == ["/srv/triage"]
    assert stated("ExecStart")[1].startswith("/srv/triage")
    done = in_read_only_tree([plant, private, cache], ["sh", str(DEPLOY / "night.sh"), str(plant)], **more)
    errors = (plant / "triage.err").read_text() if (plant / "triage.err").exists() else ""
    assert done.returncode == 0, (done.stdout, done.stderr, errors)
    assert "Traceback" not in errors
    assert len(Store(plant / "store").nights()) == 1
    assert list(cache.glob("kernels-*/*/*.nbi"))


@mounts
@pytest.mark.parametrize("writable", [[], ["private"]])
def test_kernels_need_no_writable_folder(tmp_path: Path, writable: list[str]) -> None:
    """Without a cache, and without any writable folder, the import of kernels works. No temporary file of the
    import is left at the end."""
    folders = [tmp_path / name for name in writable]
    for folder in folders:
        folder.mkdir()
    more = {"TMPDIR": str(folders[0])} if folders else {}
    command_line = [sys.executable, "-c", "import identification.signals.reversals"]
    done = in_read_only_tree(folders, command_line, **more)
    assert done.returncode == 0, done.stderr[-400:]
    assert not [left for folder in folders for left in folder.iterdir()]


@pytest.mark.parametrize("crash", ["exit 1", f"{sys.executable} -c 'import nothing_of_that_name'"])
def test_a_program_that_cannot_start_is_not_a_success(plant: Path, tmp_path: Path, crash: str) -> None:  # noqa: F811
    """If Python itself ends with 1, the script ends with 70, because the unit accepts status 1 as a success.
    The end line of yesterday's log does not change this."""
    assert stated("SuccessExitStatus") == ["1"]
    script = tmp_path / "triage"
    script.write_text(f"#!/bin/sh\n{crash}\n")
    script.chmod(0o755)
    (plant / "triage.log").write_text(
        "2026-03-01T02:34:41Z triage[1] end status=1 night=2026-02-28 seconds=1\n"
    )
    env = {**os.environ, "TRIAGE": str(script)}
    assert subprocess.run(["sh", str(DEPLOY / "night.sh"), str(plant)], env=env, check=False).returncode == 70


def test_a_night_with_failed_loops_ends_with_1(plant: Path, tmp_path: Path) -> None:  # noqa: F811
    """If the run writes in the log that some loops failed, the script ends with 1, as the run does."""
    script = tmp_path / "triage"
    line = "2026-03-03T02:34:41Z triage[2] end status=1 night=2026-03-02 seconds=1"
    script.write_text(f'#!/bin/sh\n[ "$1" = run ] || exit 0\necho "{line}" >>triage.log\nexit 1\n')
    script.chmod(0o755)
    env = {**os.environ, "TRIAGE": str(script)}
    assert subprocess.run(["sh", str(DEPLOY / "night.sh"), str(plant)], env=env, check=False).returncode == 1


def test_a_missing_package_gives_one_line() -> None:
    """An installation that lacks a package ends with 2 and one line, not with 1 and a traceback."""
    code = "import sys; sys.modules['click'] = None; from analyzer.entry import main; main()"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert "cannot start" in done.stderr


def test_an_unexpected_error_gives_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """An unexpected error of the program ends with 2 and one line that names the place of the error, not with
    1."""
    from click.testing import CliRunner

    from analyzer.night import check

    def fails(_options: object) -> None:
        raise KeyError("of all things")

    monkeypatch.setattr(check, "check_lines", fails)
    result = CliRunner().invoke(main, ["check", "x.csv"])
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "KeyError: 'of all things'; test_service.py, line" in result.stderr
