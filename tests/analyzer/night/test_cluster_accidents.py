"""A cluster without workers, that hangs, or whose workers see another disk: told, and ended in time."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from identification.errors import InputError
from proofs.plant import write_export
from tests.analyzer.night.dask_cluster import whole_cluster
from tests.analyzer.night.test_batch import quiet

pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
from analyzer.night import cluster

APART = 'mount --make-rprivate / && mount -t tmpfs none "$0" && exec "$@"'
"""A command that sees an empty disk in the place of a folder."""


@pytest.mark.parametrize(("hung", "told"), [(False, "no workers"), (True, "the scheduler does not respond")])
def test_a_cluster_that_does_nothing_is_told_and_left(tmp_path, monkeypatch, capsys, hung, told):
    """Without workers, or with a scheduler that hangs, a line says so and the run ends after the time stated, with
    --resume as what to do."""
    with whole_cluster(tmp_path, workers=0) as (address, parts):
        asked = cluster.Cluster(address, abs)
        with asked:
            for name, value in (("QUIET_S", 0.2), ("ANSWER_S", 1.0), ("GIVEN_UP_S", 1.0)):
                monkeypatch.setattr(cluster, name, value)
            asked.submit(-1)
            if hung:
                os.kill(parts[0].pid, signal.SIGSTOP)
            with pytest.raises(InputError, match=f"{told}.*--resume"):
                list(asked.results())
    assert told in capsys.readouterr().err


def test_a_relative_store_is_refused_on_a_cluster(tmp_path):
    """A store that each worker would look for in a folder of its own is refused before anything is computed."""
    export = write_export(tmp_path / "x.parquet", {"L0": quiet(0, 900)})
    asked = ["run", str(export), "--store", "store", "--scheduler", "tcp://127.0.0.1:9"]
    told = CliRunner().invoke(main, asked)
    assert told.exit_code == 2
    assert "--store store with --scheduler" in told.stderr
    assert f"say {Path('store').resolve()}" in told.stderr
    assert not Path("store").exists()


def can_mount(folder: Path) -> bool:
    """Whether this user may have mounts of his own."""
    asked = ["unshare", "-m", "sh", "-c", APART, str(folder), "true"]
    return shutil.which("unshare") is not None and not subprocess.run(asked, capture_output=True).returncode


def test_workers_that_share_no_disk_are_an_error(tmp_path):
    """Where one worker writes its pieces to a disk of its own, the run ends with exit 2 and names --resume; no night
    of half the loops is kept."""
    shared = tmp_path / "shared"
    shared.mkdir()
    if not can_mount(shared):
        pytest.skip("needs mounts of its own (root on Linux)")
    export = write_export(tmp_path / "x.parquet", {f"L{k:02d}": quiet(k, 900) for k in range(8)})
    with whole_cluster(tmp_path, workers=0) as (address, _):
        alone = [
            sys.executable,
            "-m",
            "distributed.cli.dask_worker",
            address,
            "--nthreads",
            "1",
            "--no-nanny",
        ]
        asked = ["unshare", "-m", "sh", "-c", APART, str(shared), *alone, "--no-dashboard"]
        quietly = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        with subprocess.Popen([*asked, "--local-directory", str(tmp_path)], **quietly) as worker:
            run = ["run", str(export), "--store", str(shared / "store"), "--scheduler", address]
            told = CliRunner().invoke(main, run)
            worker.kill()
    assert told.exit_code == 2, told.output
    assert "all workers see" in told.stderr
    assert "--resume" in told.stderr.splitlines()[-1]
    assert not list((shared / "store" / "nights").glob("*"))
