"""A cluster without workers, with a scheduler that does not respond, or with another disk is reported, and the run
ends.
"""

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
"""A command that sees an empty disk instead of a folder."""


@pytest.mark.parametrize(("hung", "text"), [(False, "no workers"), (True, "the scheduler does not respond")])
def test_a_cluster_that_does_nothing_is_reported_and_the_run_ends(tmp_path, monkeypatch, capsys, hung, text):
    """Without workers, or with a scheduler that does not respond, a line says so.

    The run ends after the stated time and names --resume.
    """
    with whole_cluster(tmp_path, workers=0) as (address, parts):
        connected = cluster.Cluster(address, abs)
        with connected:
            for name, value in (("QUIET_S", 0.2), ("ANSWER_S", 1.0), ("GIVEN_UP_S", 1.0)):
                monkeypatch.setattr(cluster, name, value)
            connected.submit(-1)
            if hung:
                os.kill(parts[0].pid, signal.SIGSTOP)
            with pytest.raises(InputError, match=f"{text}.*--resume"):
                list(connected.results())
    assert text in capsys.readouterr().err


def test_a_relative_store_is_refused_on_a_cluster(tmp_path):
    """A relative store, which each worker would search for in its own folder, is refused before anything is
    computed.
    """
    export = write_export(tmp_path / "x.parquet", {"L0": quiet(0, 900)})
    arguments = ["run", str(export), "--store", "store", "--scheduler", "tcp://127.0.0.1:9"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    assert "--store store with --scheduler" in result.stderr
    assert f"state --store {Path('store').resolve()}" in result.stderr
    assert not Path("store").exists()


def can_mount(folder: Path) -> bool:
    """Whether this user may create mounts."""
    arguments = ["unshare", "-m", "sh", "-c", APART, str(folder), "true"]
    return (
        shutil.which("unshare") is not None and not subprocess.run(arguments, capture_output=True).returncode
    )


def test_workers_that_share_no_disk_are_an_error(tmp_path):
    """If one worker writes its pieces to its own disk, the run ends with exit 2 and names --resume.

    No night with a part of the loops is stored.
    """
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
        arguments = ["unshare", "-m", "sh", "-c", APART, str(shared), *alone, "--no-dashboard"]
        quietly = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        with subprocess.Popen([*arguments, "--local-directory", str(tmp_path)], **quietly) as worker:
            run = ["run", str(export), "--store", str(shared / "store"), "--scheduler", address]
            result = CliRunner().invoke(main, run)
            worker.kill()
    assert result.exit_code == 2, result.output
    assert "all workers see" in result.stderr
    assert "--resume" in result.stderr.splitlines()[-1]
    assert not list((shared / "store" / "nights").glob("*"))
