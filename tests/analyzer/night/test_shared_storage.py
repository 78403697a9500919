"""Exports and stores on shared storage behave as directories; the tests use an S3-compatible server on loopback."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from analyzer import locations
from analyzer.cli import main
from analyzer.store import lock as store_lock
from analyzer.store import store as store_module
from analyzer.store.lock import OWNER, locked
from identification.errors import InputError
from proofs.plant import write_export
from tests.analyzer.night.test_batch import at_rest, cycling, tables
from tests.analyzer.night.test_cluster import cluster  # noqa: F401

pytest.importorskip("upath", reason="the extra 'remote' is not installed")
pytest.importorskip("s3fs", reason="the extra 'remote' is not installed")
pytest.importorskip("moto.server", reason="no S3-compatible server to test against")
ENVIRONMENT = {
    "AWS_ACCESS_KEY_ID": "mill",
    "AWS_SECRET_ACCESS_KEY": "mill",
    "AWS_DEFAULT_REGION": "us-east-1",
}
SERVER = """
import sys, time
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer(ip_address="127.0.0.1", port=0)
server.start()
print(server.get_host_and_port()[1], flush=True)
sys.stdin.read()
"""


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    """URL of an empty bucket of a separate server."""
    import s3fs

    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, "-c", SERVER], text=True, **pipes) as server:
        assert server.stdout is not None
        port = next(line for line in server.stdout if line.strip().isdigit()).strip()
        with pytest.MonkeyPatch.context() as patch:
            for name, value in {**ENVIRONMENT, "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}"}.items():
                patch.setenv(name, value)
            s3fs.S3FileSystem.clear_instance_cache()
            s3fs.S3FileSystem().mkdir("mill")
            yield "s3://mill"
        server.kill()
    s3fs.S3FileSystem.clear_instance_cache()


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four loops that do not oscillate and two that do, a quarter of an hour at 1 s."""
    loops = {f"L{k:02d}": at_rest(k, 900) if k < 4 else cycling(k) for k in range(6)}
    return write_export(tmp_path_factory.mktemp("shared") / "night.parquet", loops)


@pytest.fixture(scope="module")
def whole(export: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, object]]]:
    """The tables of a run in a directory."""
    store = tmp_path_factory.mktemp("whole") / "store"
    assert ran(str(export), str(store)).exit_code == 0
    return tables(store)


def ran(export: str, store: str, *more: str) -> Result:
    """The batch."""
    return CliRunner().invoke(main, ["run", export, "--store", store, *more])


def kept(store: str, folder: Path) -> dict[str, list[dict[str, object]]]:
    """The tables of a store at a URL."""
    (copy,), _ = locations.local_copies([locations.place(store)], folder)
    return tables(copy)


def put(path: Path, url: str) -> str:
    """A file copied to a URL."""
    locations.place(url).write_bytes(path.read_bytes())
    return url


def test_a_night_on_shared_storage_is_that_of_a_directory(
    bucket: str, export: Path, whole: Any, tmp_path: Path
):
    """Export and store at URLs give the same tables as paths, leave no other files, and are ranked in the same
    way.
    """
    url, store = put(export, f"{bucket}/in/night.parquet"), f"{bucket}/store"
    result = ran(url, store, "--jobs", "2")
    assert result.exit_code == 0, result.stderr
    assert kept(store, tmp_path) == whole
    names = {p.name for p in locations.place(store).rglob("*") if p.is_file()}
    assert names == {"2026-03-02.parquet", "store.json"}
    listed = [CliRunner().invoke(main, ["rank", where, "--format", "csv"]).stdout for where in (store, store)]
    assert listed[0].count("\n") == 7
    assert "valve" in listed[0]


def test_a_folder_behind_a_url_is_read_as_one_export(bucket: str, export: Path, whole: Any, tmp_path: Path):
    """A URL of a folder means the files in it; --replace removes the loops of the night from the store."""
    put(export, f"{bucket}/day/deep/night.parquet")
    store = f"{bucket}/folder-store"
    for more in ((), ("--replace",)):
        assert ran(f"{bucket}/day", store, *more).exit_code == 0
    assert kept(store, tmp_path) == whole


def test_pages_notes_and_care_read_shared_storage(bucket: str, export: Path, tmp_path: Path):
    """Pages, notes, check, prune and summary accept a URL instead of a directory."""
    store = f"{bucket}/kept"
    assert ran(str(export), store).exit_code == 0

    def run_command(*words: str) -> Result:
        return CliRunner().invoke(main, list(words))

    assert run_command("note", store, "L04", "stroked, packing tight").exit_code == 0
    assert run_command("note", store, "L04", "ordered").exit_code == 0
    assert "packing tight" in run_command("note", store, "L04").output
    assert "packing tight" not in run_command("rank", store).output  # the newest note is shown
    assert run_command("pages", store, "--out", str(tmp_path / "pages")).exit_code == 0
    assert (tmp_path / "pages" / "index.html").exists()
    assert "no problem" in run_command("store", "check", store).output
    assert run_command("store", "prune", store, "--keep", "400d").exit_code == 0
    assert run_command("summary", store).exit_code == 0


def test_a_stopped_run_on_shared_storage_is_continued(
    bucket: str, export: Path, whole: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """--resume continues with pieces on shared storage as with those of a directory."""
    from analyzer.night import finish

    store = f"{bucket}/stopped"

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("analyzer.night.batch.finish_night", killed)
        ran(str(export), store)
    assert any(p.name.startswith("nights-") for p in locations.place(store).rglob("*"))
    assert finish.finish_night is not killed
    assert ran(str(export), store, "--resume").exit_code == 0
    assert kept(store, tmp_path) == whole


def test_two_runs_on_one_store_at_once(bucket: str, monkeypatch: pytest.MonkeyPatch):
    """A current signature refuses a second run in one line; a signature that is too old belongs to a dead run."""
    store = locations.place(f"{bucket}/held")
    monkeypatch.setattr(store_lock, "ALIVE_S", 0.05)
    with locked(store):
        with (
            pytest.raises(
                InputError,
                match=f"in use by process {os.getpid()} .*if it died, its hold ends in 10 min, then --resume",
            ),
            locked(store),
        ):
            pass
        first = json.loads(locations.content(store / OWNER))["alive_s"]
        for _ in range(1000):
            if json.loads(locations.content(store / OWNER))["alive_s"] > first:
                break
            time.sleep(0.01)
        else:
            pytest.fail("the signature was not renewed")
    assert not (store / OWNER).exists()
    (store / OWNER).write_text(json.dumps({"alive_s": time.time() - 3600.0, "mark": "dead"}))
    with locked(store):
        assert json.loads(locations.content(store / OWNER))["process"] == os.getpid()


def test_an_empty_url_is_not_damaged(bucket: str, monkeypatch: pytest.MonkeyPatch):
    """An empty URL is no store and not damaged; an error of the storage is reported in its own words."""
    result = CliRunner().invoke(main, ["rank", f"{bucket}/empty"])
    assert (result.exit_code, "s3://mill/empty: nothing there" in result.stderr) == (2, True)

    def denied(path: Path) -> bytes:
        raise PermissionError("Access Denied")

    monkeypatch.setattr(store_module, "content", denied)
    result = CliRunner().invoke(main, ["rank", f"{bucket}/empty"])
    assert "s3://mill/empty: Access Denied" in result.stderr
    assert "damaged" not in result.stderr


@pytest.mark.parametrize(
    ("export_url", "store", "text"),
    [
        ("s3://mill/nothing.parquet", "s3://mill/s", "s3://mill/nothing.parquet: nothing there"),
        ("s3://nowhere/x.parquet", "s3://mill/s", "s3://nowhere/x.parquet: The specified bucket"),
        ("nosuch://x/y.parquet", "s3://mill/s", "this kind of storage is not supported"),
        ("{export}", "s3://nowhere/store", "s3://nowhere/store: The specified bucket"),
    ],
)
def test_an_error_of_storage_is_one_line(bucket: str, export: Path, export_url: str, store: str, text: str):
    """A missing object, bucket or kind of storage is reported in one line, with status 2 and no traceback."""
    result = ran(export_url.format(export=export), store)
    assert result.exit_code == 2
    assert text in result.stderr
    assert "Traceback" not in result.output


def test_a_worker_on_another_machine_fetches_a_missing_copy(bucket: str, export: Path, tmp_path: Path):
    """An export without a copy on this machine is fetched again when a loop is read."""
    from analyzer.history.export import ReadOptions, open_export

    url = locations.place(put(export, f"{bucket}/again/night.parquet"))
    opened = open_export([url], ReadOptions(scratch=tmp_path))
    (copy,) = opened.origins
    before = opened.read(["L00.PV"])["L00.PV"].value
    copy.unlink()
    assert (opened.read(["L00.PV"])["L00.PV"].value == before).all()


@pytest.mark.slow
def test_a_cluster_reads_and_writes_shared_storage(
    bucket: str,
    export: Path,
    whole: Any,
    tmp_path: Path,
    cluster: Any,  # noqa: F811
):
    """Workers over TCP read the export at one URL and write their pieces to another: the store is the same."""
    url, store = put(export, f"{bucket}/cluster/night.parquet"), f"{bucket}/cluster-store"
    result = ran(url, store, "--scheduler", cluster[0])
    assert result.exit_code == 0, result.output
    assert kept(store, tmp_path) == whole


def test_a_name_that_leads_out_is_refused(bucket: str, export: Path, tmp_path: Path):
    """An object whose name leads out of its folder is refused before anything is written."""
    import s3fs

    s3fs.S3FileSystem().pipe_file("mill/climbing/../../../evil.parquet", export.read_bytes())
    with pytest.raises(InputError, match="leads out of its folder"):
        locations.local_copies([locations.place(f"{bucket}/climbing")], tmp_path / "copies")
    assert not list(tmp_path.rglob("*.parquet"))
